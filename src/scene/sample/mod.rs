//! The project's own scene.
use super::{Scene, SceneError};
/// Draft.
pub fn colonnade() -> Result<Scene, SceneError> {
    Ok(Scene::new())
}
