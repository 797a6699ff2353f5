//! Scenes elsewhere in the world, and of other sizes.

use drawloom::glam::DVec3;
use drawloom::scene::{Light, Scene};
use libtest_mimic::Failed;

/// Moves the whole scene.
pub fn shift_scene(scene: &mut Scene, by: DVec3) -> Result<(), Failed> {
    for camera in &mut scene.cameras {
        camera.position += by;
    }
    for light in &mut scene.lights {
        if let Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } =
            light
        {
            *position += by;
        }
    }
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position += by;
        scene.replace_object(handle, object)?;
    }
    Ok(())
}

/// Scales the whole scene about the origin, with the same illuminance.
pub fn scale_scene(scene: &mut Scene, factor: f64) -> Result<(), Failed> {
    let (single, square) = (factor as f32, (factor * factor) as f32);
    for camera in &mut scene.cameras {
        camera.position *= factor;
        camera.near *= single;
    }
    for light in &mut scene.lights {
        match light {
            Light::Point { position, intensity, range, .. }
            | Light::Spot { position, intensity, range, .. }
            | Light::Hemispherical { position, intensity, range, .. } => {
                *position *= factor;
                *intensity *= square;
                *range *= single;
            }
            _ => {}
        }
    }
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position *= factor;
        object.scale *= single;
        scene.replace_object(handle, object)?;
    }
    Ok(())
}
