//! Nothing, one and very many.

use drawloom::FrameError;
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, RenderObject, Scene};
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::Case;
use crate::look::assert_alike;
use crate::signs::{RED, Sign, Signs, camera};
use crate::stage::Studio;

pub const CASES: &[Case] = &[
    ("a_scene_without_a_camera_is_refused", no_camera),
    ("an_empty_scene_is_background", empty),
    ("one_object_and_sixteen_bits_of_them_and_one_more", instances),
    ("as_many_at_one_place_look_like_one", at_one_place),
    ("lights_without_objects_and_objects_without_lights", lights_alone),
];

const SIZE: [u32; 2] = [48, 32];

fn no_camera(studio: &mut Studio) -> Result<(), Failed> {
    match studio.refusal(&Scene::new().as_scene_ref())? {
        FrameError::NoView => Ok(()),
        other => Err(other.to_string().into()),
    }
}

fn empty(studio: &mut Studio) -> Result<(), Failed> {
    Signs::new(camera(SIZE), [])?.expect(studio, "nothing", 0)?;
    // And after something.
    Signs::new(camera(SIZE), [Sign::before(&camera(SIZE), 5.0, 2.0)])?.expect(studio, "one", 1)?;
    Signs::new(camera(SIZE), [])?.expect(studio, "nothing again", 0)
}

fn instances(studio: &mut Studio) -> Result<(), Failed> {
    for count in [0, 1, 65_535, 65_537] {
        let camera = camera(SIZE);
        // The others lie behind one that hides them; of all of them this is the last.
        let mut signs = Signs::new(camera.clone(), [])?;
        if count > 0 {
            signs.add(Sign::before(&camera, 9.0, 1.0).colored(RED))?;
            let hidden = signs.scene.objects().next().ok_or("there is one")?;
            let hidden = signs.scene.object(hidden)?;
            for index in 2..count {
                let aside = DVec3::new(0.3, -0.4, -0.8) * (index as f64 * 1e-4);
                signs.scene.add_object(RenderObject { position: hidden.position + aside, ..hidden })?;
            }
        }
        if count > 1 {
            signs.add(Sign::before(&camera, 5.0, 2.0))?;
        }
        let drawn = studio.draw_whole(&signs.scene)?;
        if drawn.visible != count {
            return Err(format!("{} of {count} were drawn", drawn.visible).into());
        }
        signs.compare(&drawn, count.min(1))?;
    }
    Ok(())
}

fn at_one_place(studio: &mut Studio) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let one = Signs::new(camera.clone(), [Sign::before(&camera, 5.0, 2.0)])?;
    let alone = studio.draw_whole(&one.scene)?;
    let mut many = Signs::new(camera.clone(), [Sign::before(&camera, 5.0, 2.0)])?;
    many.scene.duplicate_objects(65_537);
    let drawn = studio.draw_whole(&many.scene)?;
    if drawn.visible != 65_537 {
        return Err(format!("{} of 65,537 were drawn", drawn.visible).into());
    }
    assert_alike("65,537 at one place", drawn.look.as_ref(), alone.look.as_ref())
}

fn lights_alone(studio: &mut Studio) -> Result<(), Failed> {
    let mut lights = Signs::new(camera(SIZE), [])?;
    lights.scene.lights = everything().lights;
    lights.expect(studio, "lights without objects", 0)?;
    let mut objects = everything();
    objects.lights.clear();
    objects.ambient = Vec3::ZERO;
    let drawn = studio.draw_whole(&objects)?;
    let Some(look) = drawn.look else { return Ok(()) };
    let camera: &Camera = &objects.cameras[0];
    let foot = look.radiance(camera.size[0] as usize / 2, camera.size[1] as usize - 1);
    if foot == [0.0; 3] { Ok(()) } else { Err(format!("an unlit floor is {foot:?}").into()) }
}
