//! How the precision of transforms affects a picture.

use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::quality::{Quality, TransformPrecision};
use drawloom::scene::{Light, Scene, SceneError};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::image_distance::{assert_alike, assert_different};

pub const CASES: &[Case] = &[
    ("absolute_transforms_are_accurate_only_near_the_origin", absolute),
    ("the_precision_of_transforms_can_change_between_frames", changes),
];

fn quality(transforms: TransformPrecision) -> Quality {
    Quality { transforms, ..Quality::balanced() }
}

/// The field, moved by `shift` from the world's origin.
fn field_at(shift: DVec3) -> Result<Scene, SceneError> {
    let mut scene = field(300);
    scene.cameras.iter_mut().for_each(|camera| camera.position += shift);
    for light in &mut scene.lights {
        if let Light::Point { position, .. } = light {
            *position += shift;
        }
    }
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position += shift;
        scene.replace_object(handle, object)?;
    }
    Ok(scene)
}

fn absolute() -> Result<(), Failed> {
    let of =
        |transforms| Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality(transforms)));
    let mut exact = of(TransformPrecision::CameraRelative)?;
    let mut absolute = of(TransformPrecision::Absolute)?;
    for (distance, is_near) in [(0.0, true), (100.0, true), (1e6, false), (1e7, false)] {
        let scene = field_at(DVec3::new(distance, -distance * 0.5, distance * 0.25))?;
        let pictures = (exact.draw(&scene)?, absolute.draw(&scene)?);
        let assertion = if is_near { assert_alike } else { assert_different };
        assertion(&pictures.0, &pictures.1)
            .map_err(|failed| format!("at {distance} m: {}", failed.message().unwrap_or("")))?;
    }
    Ok(())
}

fn changes() -> Result<(), Failed> {
    let scene = field_at(DVec3::new(1e6, -5e5, 2.5e5))?;
    let mut fixture = Fixture::new()?;
    let exact = fixture.draw(&scene)?;
    for _ in 0..2 {
        fixture.renderer.set_quality(quality(TransformPrecision::Absolute))?;
        assert_different(&fixture.draw(&scene)?, &exact)?;
        fixture.renderer.set_quality(quality(TransformPrecision::CameraRelative))?;
        if fixture.draw(&scene)? != exact {
            return Err("back at the first precision it differs".into());
        }
    }
    Ok(())
}
