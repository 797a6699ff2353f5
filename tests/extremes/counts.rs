//! Numbers of objects and lights: none, one and very many.

use drawloom::FrameError;
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, RenderObject, Scene};
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::assert_alike;
use crate::harness::Harness;
use crate::markers::{Marker, MarkerScene, RED, camera};

pub const CASES: &[Case] = &[
    ("a_scene_without_a_camera_is_refused", no_camera),
    ("an_empty_scene_is_background", empty),
    ("zero_to_65537_instances_are_drawn", instances),
    ("instances_at_one_position_draw_the_same_picture_as_one", at_one_position),
    ("lights_without_objects_and_objects_without_lights", lights_alone),
];

const SIZE: [u32; 2] = [48, 32];

fn no_camera(harness: &mut Harness) -> Result<(), Failed> {
    match harness.refusal(&Scene::new().as_scene_ref())? {
        FrameError::NoView => Ok(()),
        other => Err(other.to_string().into()),
    }
}

fn empty(harness: &mut Harness) -> Result<(), Failed> {
    MarkerScene::new(camera(SIZE), [])?.expect(harness, "nothing", 0)?;
    // Again after a frame with an object.
    MarkerScene::new(camera(SIZE), [Marker::before(&camera(SIZE), 5.0, 2.0)])?.expect(harness, "one", 1)?;
    MarkerScene::new(camera(SIZE), [])?.expect(harness, "nothing again", 0)
}

fn instances(harness: &mut Harness) -> Result<(), Failed> {
    for count in [0, 1, 65_535, 65_537] {
        let camera = camera(SIZE);
        // The last object hides all others.
        let mut markers = MarkerScene::new(camera.clone(), [])?;
        if count > 0 {
            markers.add(Marker::before(&camera, 9.0, 1.0).colored(RED))?;
            let hidden = markers.scene.objects().next().ok_or("there is one")?;
            let hidden = markers.scene.object(hidden)?;
            for index in 2..count {
                let offset = DVec3::new(0.3, -0.4, -0.8) * (index as f64 * 1e-4);
                markers.scene.add_object(RenderObject { position: hidden.position + offset, ..hidden })?;
            }
        }
        if count > 1 {
            markers.add(Marker::before(&camera, 5.0, 2.0))?;
        }
        let drawn = harness.draw_whole(&markers.scene)?;
        if drawn.visible != count {
            return Err(format!("{} of {count} were drawn", drawn.visible).into());
        }
        markers.compare(&drawn, count.min(1))?;
    }
    Ok(())
}

fn at_one_position(harness: &mut Harness) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let one = MarkerScene::new(camera.clone(), [Marker::before(&camera, 5.0, 2.0)])?;
    let alone = harness.draw_whole(&one.scene)?;
    let mut many = MarkerScene::new(camera.clone(), [Marker::before(&camera, 5.0, 2.0)])?;
    many.scene.duplicate_objects(65_537);
    let drawn = harness.draw_whole(&many.scene)?;
    if drawn.visible != 65_537 {
        return Err(format!("{} of 65,537 were drawn", drawn.visible).into());
    }
    assert_alike("65,537 at one position", drawn.capture.as_ref(), alone.capture.as_ref(), 0.0)
}

fn lights_alone(harness: &mut Harness) -> Result<(), Failed> {
    let mut lights = MarkerScene::new(camera(SIZE), [])?;
    lights.scene.lights = everything().lights;
    lights.expect(harness, "lights without objects", 0)?;
    let mut objects = everything();
    objects.lights.clear();
    objects.ambient = Vec3::ZERO;
    let drawn = harness.draw_whole(&objects)?;
    let Some(capture) = drawn.capture else { return Ok(()) };
    let camera: &Camera = &objects.cameras[0];
    let foot = capture.radiance(camera.size[0] as usize / 2, camera.size[1] as usize - 1);
    if foot == [0.0; 3] { Ok(()) } else { Err(format!("an unlit floor is {foot:?}").into()) }
}
