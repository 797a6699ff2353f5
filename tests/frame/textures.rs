//! Any number of textures.

use std::sync::Arc;

use drawloom::backend::{Backend, BackendError, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess, ShaderResource};
use drawloom::scene::{Camera, Changes, Material, RenderObject, Scene, SceneRef, Texture, TextureFormat, Topology};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom::{Renderer, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::{field, sized, square};

#[test]
fn a_hundred_thousand_textures_are_drawn_and_forgotten() {
    const TEXTURES: u32 = 100_000;
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [8, 8])];
    let mesh = scene.add(square(Topology::TriangleList)).unwrap();
    let mut textures = Vec::new();
    let mut bytes = 0;
    for index in 0..TEXTURES {
        // 16 classes, of which each fills many arrays.
        let size = [1 + index % 4, 1 + index / 4 % 4];
        let texels = vec![vec![7; (size[0] * size[1]) as usize]];
        let texture = Texture::with_levels("texture", TextureFormat::R8Unorm, size, texels).unwrap();
        bytes += texture.class().bytes();
        let texture = scene.add(texture).unwrap();
        textures.push(texture);
        let material = scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    }
    let (device, queue) = adapter::noop_device().unwrap();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let mut frame = |scene: &Scene, changes| {
        let before = renderer.backend().extras().uploaded_bytes();
        let recorded = renderer.record(SceneRef { changes, ..scene.as_scene_ref() }).unwrap();
        let issues = recorded.statistics().scene_issues.clone();
        submitter.submit(recorded).unwrap().submission.wait().unwrap();
        let issues: Vec<_> = issues.iter().map(|known| (known.reason, known.count)).collect();
        (issues, renderer.backend().extras().uploaded_bytes() - before)
    };
    let (issues, uploaded) = frame(&scene, Changes::Unknown);
    assert!(issues.is_empty() && uploaded > bytes, "{issues:?}, {uploaded} bytes of {bytes}");
    // The second frame may have buffers of its own.
    frame(&scene, Changes::NONE);
    let (issues, uploaded) = frame(&scene, Changes::NONE);
    assert!(issues.is_empty() && uploaded < bytes / 100, "{issues:?}, {uploaded} bytes");
    textures.iter().for_each(|texture| _ = scene.remove(*texture).unwrap());
    for _ in 0..2 {
        assert_eq!(frame(&scene, Changes::NONE).0, [(IssueReason::StaleTexture, TEXTURES as usize)]);
    }
}

/// Draws a full-screen triangle, with a number of textures.
struct Textured(Vec<ShaderResource<'static>>);

impl RenderProcess for Textured {
    fn name(&self) -> &str {
        "textured"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("color", Format::Rgba8Unorm, ClearColor::Background);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment fn fragment() -> @location(0) vec4<f32> { return vec4(1.0); }";
        Draws::FullScreen(FullScreen { shader, resources: self.0.clone(), ..FullScreen::default() })
    }
}

#[test]
fn an_error_says_whose_textures_are_too_many_for_a_shader() {
    for count in [10, 11] {
        let (device, queue) = adapter::noop_device().unwrap();
        let descriptor = wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        let texture = |_| ShaderResource::Texture {
            view: device.create_texture(&descriptor).create_view(&wgpu::TextureViewDescriptor::default()),
            dimension: wgpu::TextureViewDimension::D2,
        };
        let process = Textured((0..count).map(texture).collect());
        let builder = Renderer::builder(WgpuBackend::new(device.clone(), queue).unwrap()).process(process);
        let (mut renderer, _) = builder.output("color").build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let recorded = renderer.record(field(0).as_scene_ref());
        if count == 10 {
            drop(recorded.unwrap());
            continue;
        }
        let error = recorded.err().unwrap();
        let Some(BackendError::BindingLimit { process, stage: "fragment", needed: 17, limit, .. }) =
            error.backend_error()
        else {
            panic!("{error}")
        };
        assert_eq!((process.as_str(), *limit), ("textured", "max_sampled_textures_per_shader_stage"));
        assert!(error.to_string().contains("11 for its columns, materials and resources"), "{error}");
    }
}
