//! Late latching: the picture of a frame whose camera was replaced is that of a frame that was recorded with the newer camera.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::process::{
    ClearColor, ComputeDispatch, Declare, Deferred, Draws, Format, FullScreen, RenderProcess, StorageBuffer,
};
use drawloom::scene::{Camera, CameraMotion, ClipPlane, Light, Material, Projection, RenderObject, Scene};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{cube, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::{assert_color, assert_different};

pub const CASES: &[Case] = &[
    ("a_replaced_camera_draws_what_it_draws_when_it_is_recorded", replaced),
    ("a_replaced_camera_draws_what_it_draws_in_software", replaced_in_software),
    ("the_latest_replacement_is_drawn_and_the_next_frame_knows_nothing_of_it", latest),
    ("frames_in_flight_are_replaced_independently", in_flight),
    ("a_mirror_is_replaced_with_its_camera", several_views),
    ("the_next_frame_reads_the_camera_and_the_picture_that_were_drawn", history),
];

const MOTION: CameraMotion = CameraMotion { distance: 0.6, angle: 0.4 };

/// The shipped processes with small shadow maps.
fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(ShadowMaps { side: 128, ..ShadowMaps::default() }))
}

fn fixture() -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.deferred(deferred()))
}

/// Cubes around the camera, in the light of lamps with and without shadow.
fn scene(camera: &Camera) -> Result<Scene, Failed> {
    let (mut scene, mut random) = (Scene::new(), Random::new());
    let mesh = scene.add(cube())?;
    let materials = [Vec3::X, Vec3::Y, Vec3::ONE].map(|diffuse| Material { diffuse, ..Material::default() });
    let materials = materials.map(|material| scene.add(material));
    for index in 0..150 {
        let position = random.direction() * random.between(3.0, 12.0);
        let orientation = Quat::from_axis_angle(random.direction().as_vec3().normalize(), 1.0);
        let material = materials[index % 3].clone()?;
        let cube = RenderObject { orientation, ..RenderObject::new(mesh, material, position) };
        scene.add_object(RenderObject { scale: random.vector(0.1, 0.7), ..cube })?;
    }
    for index in 0..6 {
        let position = random.direction() * 4.0;
        let (intensity, casts_shadow) = (Vec3::splat(30.0), index % 2 == 0);
        scene.lights.push(match index % 3 {
            0 => Light::Point { position, range: 12.0, intensity, casts_shadow },
            1 => Light::Spot {
                position,
                direction: -position.as_vec3().normalize(),
                intensity,
                range: 20.0,
                inner_angle: 0.4,
                outer_angle: 0.9,
                casts_shadow,
            },
            _ => Light::Hemispherical { position, direction: Vec3::NEG_Y, intensity, range: 10.0, casts_shadow },
        });
    }
    scene.ambient = Vec3::splat(0.1);
    scene.cameras = vec![camera.clone()];
    Ok(scene)
}

fn camera() -> Camera {
    let camera = Camera::looking_at("main", DVec3::new(0.3, 0.2, 0.1), DVec3::new(1.0, 0.4, -3.0));
    Camera { late_latch: Some(MOTION), ..sized(camera, [96, 54]) }
}

/// Perspective on and off centre, with an oblique near plane, and parallel projection.
fn cameras() -> [Camera; 4] {
    let plane = ClipPlane { point: DVec3::NEG_Z * 0.8, normal: Vec3::new(0.28, 0.0, -0.96) };
    let parallel = Projection::Orthographic { height: 9.0 };
    [
        camera(),
        Camera { shift: Vec2::new(0.6, -0.4), ..camera() },
        Camera { clip_plane: Some(plane), ..camera() },
        Camera { projection: parallel, far: 30.0, ..camera() },
    ]
}

/// As far from the camera as it may be.
fn newer(camera: &Camera) -> Camera {
    let turn = Quat::from_axis_angle(Vec3::new(0.48, 0.8, 0.36), MOTION.angle);
    let position = camera.position + DVec3::new(0.6, 0.0, 0.8) * f64::from(MOTION.distance);
    Camera { position, orientation: (turn * camera.orientation).normalize(), ..camera.clone() }
}

fn assert_same(one: &Picture, other: &Picture) -> Result<(), Failed> {
    let differing = one.bytes.iter().zip(&other.bytes).filter(|(one, other)| one != other).count();
    if one.bytes.len() == other.bytes.len() && differing == 0 {
        Ok(())
    } else {
        Err(format!("{differing} of {} bytes differ", one.bytes.len()).into())
    }
}

fn replaced() -> Result<(), Failed> {
    for camera in cameras() {
        let mut fixture = fixture()?;
        let recorded_with_it = fixture.draw(&scene(&newer(&camera))?)?;
        let still = fixture.draw(&scene(&camera)?)?;
        let mut recorded = fixture.record(&scene(&camera)?)?;
        recorded.replace_camera(0, &newer(&camera))?;
        assert_same(&fixture.submit(recorded)?.read(0, "picture")?, &recorded_with_it)?;
        assert_different(&still, &recorded_with_it)?;
    }
    Ok(())
}

fn replaced_in_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    for backend in [SoftwareBackend::new(Arc::clone(&scheduler)), SoftwareBackend::reference()] {
        let builder = Renderer::builder(backend).deferred(deferred());
        let (mut renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
        let mut draw = |camera: &Camera, replacement: Option<Camera>| -> Result<Picture, Failed> {
            let mut recorded = renderer.record(scene(camera)?.as_scene_ref())?;
            if let Some(camera) = replacement {
                recorded.replace_camera(0, &camera)?;
            }
            Ok(submitter.submit(recorded)?.submission.read(0, "picture")?)
        };
        let recorded_with_it = draw(&newer(&camera()), None)?;
        assert_same(&draw(&camera(), Some(newer(&camera())))?, &recorded_with_it)?;
        assert_different(&draw(&camera(), None)?, &recorded_with_it)?;
    }
    Ok(())
}

fn latest() -> Result<(), Failed> {
    let (mut fixture, world) = (fixture()?, scene(&camera())?);
    let still = fixture.draw(&world)?;
    let mut recorded = fixture.record(&world)?;
    recorded.replace_camera(0, &newer(&camera()))?;
    let mut third = camera();
    third.position.y += 0.3;
    recorded.replace_camera(0, &third)?;
    let beyond = Camera { position: camera().position + DVec3::Y, ..camera() };
    if recorded.replace_camera(0, &beyond).is_ok() {
        return Err("a camera beyond the motion is accepted".into());
    }
    let picture = fixture.submit(recorded)?.read(0, "picture")?;
    assert_same(&picture, &fixture.draw(&scene(&third)?)?)?;
    // These frames have the same buffers.
    assert_same(&fixture.draw(&world)?, &still)?;
    let mut undone = fixture.record(&world)?;
    undone.replace_camera(0, &newer(&camera()))?;
    undone.replace_camera(0, &camera())?;
    assert_same(&fixture.submit(undone)?.read(0, "picture")?, &still)
}

fn in_flight() -> Result<(), Failed> {
    let (mut fixture, world) = (fixture()?, scene(&camera())?);
    let still = fixture.draw(&world)?;
    let moved = fixture.draw(&scene(&newer(&camera()))?)?;
    let (mut first, second) = (fixture.record(&world)?, fixture.record(&world)?);
    let mut third = fixture.record(&world)?;
    third.replace_camera(0, &newer(&camera()))?;
    first.replace_camera(0, &newer(&camera()))?;
    for (recorded, expected) in [(first, &moved), (second, &still), (third, &moved)] {
        assert_same(&fixture.submit(recorded)?.read(0, "picture")?, expected)?;
    }
    Ok(())
}

fn several_views() -> Result<(), Failed> {
    let plane = ClipPlane { point: DVec3::Y * -1.0, normal: Vec3::Y };
    let with_mirror = |camera: &Camera| -> Result<Scene, Failed> {
        let mut scene = scene(camera)?;
        // It is drawn as a main view, so that its picture can be read.
        let kind = camera.kind;
        scene.cameras.push(Camera { kind, ..camera.reflected("mirror", plane) });
        Ok(scene)
    };
    let mut fixture = fixture()?;
    let (world, expected) = (with_mirror(&camera())?, with_mirror(&newer(&camera()))?);
    let recorded = fixture.record(&expected)?;
    let submission = fixture.submit(recorded)?;
    let expected_pictures = [submission.read(0, "picture")?, submission.read(1, "picture")?];
    let recorded = fixture.record(&world)?;
    let submission = fixture.submit(recorded)?;
    let still = [submission.read(0, "picture")?, submission.read(1, "picture")?];
    // Each view alone, then both.
    for views in [vec![0], vec![1], vec![1, 0]] {
        let mut recorded = fixture.record(&world)?;
        for view in &views {
            recorded.replace_camera(*view, &expected.cameras[*view])?;
        }
        let submission = fixture.submit(recorded)?;
        for view in 0..2 {
            let expected = if views.contains(&view) { &expected_pictures[view] } else { &still[view] };
            assert_same(&submission.read(view, "picture")?, expected)?;
        }
    }
    Ok(())
}

/// The cameras of this frame and of the one before, as they were drawn.
const DRAWN: StorageBuffer<[f32; 4]> = StorageBuffer::new("drawn cameras", 2);

/// Keeps the position of the camera for the next frame, as a process does that reprojects.
struct KeepCamera;

impl RenderProcess for KeepCamera {
    fn name(&self) -> &str {
        "keep camera"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(DRAWN);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read_write> drawn_cameras: array<vec4<f32>>;

            @compute @workgroup_size(1)
            fn compute() {
                drawn_cameras[1] = drawn_cameras[0];
                drawn_cameras[0] = vec4<f32>(metres_from_origin(view.position_low, view.position_high), 1.0);
            }
        ";
        Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() })
    }
}

/// Shows the position of the camera of the frame before, in metres.
struct ShowCamera;

impl RenderProcess for ShowCamera {
    fn name(&self) -> &str {
        "show camera"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_buffer(DRAWN);
        declare.clears_color("camera before", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read> drawn_cameras: array<vec4<f32>>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return drawn_cameras[1];
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// Copies the picture of the frame before.
struct ShowHistory;

impl RenderProcess for ShowHistory {
    fn name(&self) -> &str {
        "show history"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_previous("picture");
        declare.clears_color("picture before", Format::Rgba8Srgb, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var before: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(before, vec2<i32>(in.position.xy), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn history() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| {
        let builder = builder.deferred(deferred()).process(KeepCamera).process(ShowCamera).process(ShowHistory);
        builder.output("camera before").output("picture before")
    })?;
    let world = scene(&camera())?;
    let mut first = fixture.record(&world)?;
    // The next frame is recorded before this one's camera is known.
    let second = fixture.record(&world)?;
    let latched = newer(&camera());
    first.replace_camera(0, &latched)?;
    let drawn = fixture.submit(first)?.read(0, "picture")?;
    let submission = fixture.submit(second)?;
    let position = latched.position.to_array().map(|metres| (metres * 255.0).round() as u8);
    assert_color(pixel(&submission.read(0, "camera before")?, 5, 5), position)?;
    assert_same(&submission.read(0, "picture before")?, &drawn)?;
    assert_different(&submission.read(0, "picture")?, &drawn)
}
