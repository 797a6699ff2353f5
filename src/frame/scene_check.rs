//! What must hold of a scene as a whole. Single objects and lights that are invalid are left out instead.

use super::FrameError;
use crate::scene::{SceneError, SceneRef};

/// # Errors
/// If no frame can be made of the scene.
pub(super) fn check_scene(scene: &SceneRef<'_>) -> Result<(), FrameError> {
    scene.check_lengths()?;
    if scene.cameras.is_empty() {
        return Err(FrameError::NoView);
    }
    for camera in scene.cameras {
        let [width, height] = camera.size;
        if width == 0 || height == 0 {
            return Err(FrameError::EmptyTarget { view: camera.name.clone(), width, height });
        }
        camera.check()?;
    }
    for (name, color) in [("ambient", scene.ambient), ("background", scene.background)] {
        if !color.is_finite() || color.min_element() < 0.0 {
            return Err(SceneError::InvalidColor { name }.into());
        }
    }
    Ok(())
}
