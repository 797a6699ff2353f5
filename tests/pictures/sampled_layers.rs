//! Views whose pictures a process samples as the layers of one texture: as an array, and as a cube map.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::{
    ClearColor, CpuShader, Declare, Deferred, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel,
    PassInputs, RenderProcess,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Camera, Material, Projection, RenderObject, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, wgpu};
use drawloom_testing::scenes::{cube, sized};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, device};

pub const CASES: &[Case] = &[
    ("a_cube_map_shows_in_each_direction_what_a_camera_sees", cube_map),
    ("a_cube_map_shows_the_same_in_software", cube_map_in_software),
    ("the_layers_of_an_array_are_the_pictures_of_its_views", layers),
    ("an_array_shows_the_same_in_software", layers_in_software),
    ("the_layer_of_a_view_that_is_gone_is_zeros_again", gone),
    ("an_array_keeps_its_layers_where_targets_are_transient", transient),
    ("a_target_that_is_a_layer_cannot_be_imported", import),
];

const SIZE: [u32; 2] = [64, 48];

/// Draws the cube map `probe` as the camera would see the world.
#[derive(Clone, Copy)]
pub struct Environment;

impl RenderProcess for Environment {
    fn name(&self) -> &str {
        "environment"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_view_cube(ViewKind::Reflection, "probe", "radiance");
        declare.clears_color("environment", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: include_str!("sampled_layers/environment.wgsl"),
            ..FullScreen::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Environment {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [x, y] = pixel.clip.0;
        let ray = pass.view.right * x + pass.view.up * y + pass.view.forward;
        targets[0] = pass.sampled[0].load_cube(ray);
        true
    }
}

/// Draws 16 columns of each layer of the array `screen`.
#[derive(Clone, Copy)]
struct Strips;

impl RenderProcess for Strips {
    fn name(&self) -> &str {
        "strips"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_view_layers(ViewKind::Reflection, "screen", "radiance", 4);
        declare.clears_color("strips", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("sampled_layers/strips.wgsl"), ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Strips {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = pass.sampled[0].load(pixel.coordinates, pixel.coordinates[0] / 16);
        true
    }
}

fn fixture() -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| {
        let builder = builder.pipeline(Deferred::to_picture()).process(Environment).process(Strips);
        builder.output("radiance").output("environment").output("strips")
    })
}

/// Cubes of different colours all around the origin, in ambient light.
pub fn world() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    for index in 0..40 {
        let [red, green, blue] = [(index * 7 % 11) as f32, (index * 5 % 13) as f32, (index * 3 % 7) as f32];
        let color = Vec3::new(red / 10.0, green / 12.0, blue / 6.0);
        let material = scene.add(Material { diffuse: color, ..Material::default() })?;
        let turn = Quat::from_rotation_y(index as f32 * 2.4) * Quat::from_rotation_x(index as f32 * 0.7);
        let position = CENTER + (turn * Vec3::new(0.0, 0.0, 3.0 + (index % 5) as f32)).as_dvec3();
        let mut object = RenderObject::new(mesh, material, position);
        object.scale = Vec3::splat(0.6);
        scene.add_object(object)?;
    }
    scene.ambient = Vec3::splat(0.8);
    scene.background = Vec3::new(0.1, 0.3, 0.6);
    Ok(scene)
}

pub const CENTER: DVec3 = DVec3::new(3.0, 1.0, -2.0);

/// A camera in the middle of the cubes.
pub fn inside(target: DVec3) -> Camera {
    let camera = Camera::looking_at("main", CENTER, CENTER + target);
    Camera { projection: Projection::Perspective { field_of_view: 1.2 }, ..sized(camera, SIZE) }
}

/// Directions to which each face contributes, and with edges and corners of the cube in the picture.
pub const DIRECTIONS: [DVec3; 8] = [
    DVec3::X,
    DVec3::NEG_X,
    DVec3::new(0.1, 1.0, 0.2),
    DVec3::new(0.3, -1.0, 0.1),
    DVec3::Z,
    DVec3::NEG_Z,
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(-1.0, -0.7, 1.0),
];

fn numbers(picture: &Picture) -> Vec<f64> {
    picture.bytes.chunks_exact(2).map(|bytes| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64()).collect()
}

/// The share of pixels in which the pictures differ by more than a tenth.
fn share_of_different(one: &Picture, other: &Picture) -> f64 {
    let (one, other) = (numbers(one), numbers(other));
    let pixels = one.chunks_exact(4).zip(other.chunks_exact(4));
    let differs =
        |(one, other): &(&[f64], &[f64])| one.iter().zip(*other).any(|(one, other)| (one - other).abs() > 0.1);
    pixels.filter(differs).count() as f64 / (one.len() / 4) as f64
}

fn cube_map() -> Result<(), Failed> {
    let mut scene = world()?;
    let mut fixture = fixture()?;
    let mut before: Option<Picture> = None;
    for direction in DIRECTIONS {
        scene.cameras = Camera::cube_faces("probe", CENTER, 256, 0.05).into();
        scene.cameras.push(inside(direction));
        let recorded = fixture.record(&scene)?;
        let submission = fixture.submit(recorded)?;
        let (seen, sampled) = (submission.read(6, "radiance")?, submission.read(6, "environment")?);
        // Pixels at edges of the cubes show another one.
        let share = share_of_different(&seen, &sampled);
        if share > 0.03 {
            return Err(format!("{share} of the pixels differ towards {direction}").into());
        }
        if before.is_some_and(|before| share_of_different(&before, &sampled) < 0.3) {
            return Err(format!("{direction} shows what the direction before showed").into());
        }
        before = Some(sampled);
    }
    Ok(())
}

fn software(scene: &Scene, target: &str) -> Result<Picture, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(Deferred::to_picture());
    let builder = builder.process(Environment).process(Strips).output("environment").output("strips");
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
    let main =
        scene.cameras.iter().position(|camera| camera.kind == ViewKind::Main).ok_or("there is no main camera")?;
    Ok(submission.read(main, target)?)
}

fn cube_map_in_software() -> Result<(), Failed> {
    let mut scene = world()?;
    scene.cameras = vec![inside(DIRECTIONS[6])];
    // No view has the name of a face.
    if numbers(&software(&scene, "environment")?).iter().any(|number| *number != 0.0) {
        return Err("a cube map without views is not zeros".into());
    }
    scene.cameras.extend(Camera::cube_faces("probe", CENTER, 128, 0.05));
    let mut fixture = fixture()?;
    let recorded = fixture.record(&scene)?;
    let expected = fixture.submit(recorded)?.read(0, "environment")?;
    let share = share_of_different(&expected, &software(&scene, "environment")?);
    if share < 0.03 { Ok(()) } else { Err(format!("{share} of the pixels differ").into()) }
}

/// The main camera, and the views of layers 3, 0 and 1.
fn screens() -> Result<Scene, Failed> {
    let mut scene = world()?;
    scene.cameras = vec![inside(DIRECTIONS[0])];
    for (layer, direction) in [(3, DIRECTIONS[1]), (0, DIRECTIONS[2]), (1, DIRECTIONS[6])] {
        let name = format!("screen/{layer}");
        scene.cameras.push(Camera { name, kind: ViewKind::Reflection, ..inside(direction) });
    }
    Ok(scene)
}

/// The strips that the pictures of the cameras give: zeros for a layer without a camera.
fn expected_strips(scene: &Scene) -> Result<Vec<f64>, Failed> {
    let mut fixture = Fixture::with(1, |builder| builder.pipeline(Deferred::to_picture()).output("radiance"))?;
    let mut expected = vec![0.0; (SIZE[0] * SIZE[1] * 4) as usize];
    for layer in 0..4 {
        let name = format!("screen/{layer}");
        let Some(camera) = scene.cameras.iter().find(|camera| camera.name == name) else { continue };
        let mut alone = world()?;
        alone.cameras = vec![Camera { kind: ViewKind::Main, ..camera.clone() }];
        let recorded = fixture.record(&alone)?;
        let picture = numbers(&fixture.submit(recorded)?.read(0, "radiance")?);
        for (index, number) in expected.iter_mut().enumerate().filter(|(index, _)| index / 4 % 64 / 16 == layer) {
            *number = picture[index];
        }
    }
    Ok(expected)
}

fn assert_strips(fixture: &mut Fixture, scene: &Scene) -> Result<(), Failed> {
    let recorded = fixture.record(scene)?;
    let found = numbers(&fixture.submit(recorded)?.read(0, "strips")?);
    let expected = expected_strips(scene)?;
    let different = found.iter().zip(&expected).filter(|(found, expected)| found != expected).count();
    if different == 0 { Ok(()) } else { Err(format!("{different} numbers differ").into()) }
}

fn layers() -> Result<(), Failed> {
    assert_strips(&mut fixture()?, &screens()?)
}

fn layers_in_software() -> Result<(), Failed> {
    let scene = screens()?;
    let mut fixture = fixture()?;
    let recorded = fixture.record(&scene)?;
    let expected = fixture.submit(recorded)?.read(0, "strips")?;
    let share = share_of_different(&expected, &software(&scene, "strips")?);
    if share < 0.01 { Ok(()) } else { Err(format!("{share} of the pixels differ").into()) }
}

fn gone() -> Result<(), Failed> {
    let (mut fixture, mut scene) = (fixture()?, screens()?);
    assert_strips(&mut fixture, &scene)?;
    let camera = scene.cameras.remove(2);
    assert_strips(&mut fixture, &scene)?;
    scene.cameras.push(camera);
    assert_strips(&mut fixture, &scene)
}

fn transient() -> Result<(), Failed> {
    let mut fixture = Fixture::with_transient_targets(2, |builder| {
        builder.pipeline(Deferred::to_picture()).process(Strips).output("strips")
    })?;
    for _ in 0..2 {
        assert_strips(&mut fixture, &screens()?)?;
    }
    Ok(())
}

fn import() -> Result<(), Failed> {
    let (mut fixture, scene) = (fixture()?, screens()?);
    let (device, _) = device()?;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    fixture.renderer.backend().import_target("screen/0", "radiance", texture);
    match fixture.renderer.record(scene.as_scene_ref()) {
        Err(error @ FrameError::Backend(_)) if error.to_string().contains("layer of an array") => Ok(()),
        Err(error) => Err(format!("another error: {error}").into()),
        Ok(_) => Err("the frame was drawn".into()),
    }
}
