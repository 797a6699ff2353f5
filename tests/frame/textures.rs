//! Any number of textures.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Backend, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Changes, Material, RenderObject, Scene, SceneRef, Texture, TextureFormat, Topology};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom_testing::adapter;
use drawloom_testing::scenes::{sized, square};

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
