//! The scene while it is built.

use drawloom::glam::{Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Material, Mesh, RenderObject, Scene, SceneError};

use super::shared_assets::SharedAssets;

/// The scene while it is built, and the assets that its parts share.
pub(super) struct Site {
    pub scene: Scene,
    pub assets: SharedAssets,
}

impl Site {
    /// Adds an object that is not rotated.
    ///
    /// # Errors
    /// Returns the error of [`Scene::add_object`].
    pub(super) fn add_upright(
        &mut self,
        mesh: Handle<Mesh>,
        material: Handle<Material>,
        position: Vec3,
        scale: Vec3,
    ) -> Result<(), SceneError> {
        self.add(mesh, material, position, Quat::IDENTITY, scale)
    }

    /// Adds an object.
    ///
    /// # Errors
    /// Returns the error of [`Scene::add_object`].
    pub(super) fn add(
        &mut self,
        mesh: Handle<Mesh>,
        material: Handle<Material>,
        position: Vec3,
        orientation: Quat,
        scale: Vec3,
    ) -> Result<(), SceneError> {
        let object = RenderObject { orientation, scale, ..RenderObject::new(mesh, material, position.as_dvec3()) };
        self.scene.add_object(object)?;
        Ok(())
    }
}
