//! The collection of meshes, materials and textures.

use super::{Material, Mesh, SceneError, Texture};
use crate::handle::{Handle, Slots, StaleHandle};

/// Owns meshes, materials and textures. An engine with its own storage for objects keeps its assets here too, so that a
/// frame uploads an asset only when it is new or has changed; and a mesh not before the first frame in which an object has it.
///
/// ```
/// use drawloom::glam::Vec3;
/// use drawloom::scene::{Assets, Material};
///
/// let mut assets = Assets::default();
/// let brick = assets.add(Material { name: "brick".into(), ..Material::default() })?;
/// assets.replace(brick, Material { diffuse: Vec3::new(0.6, 0.2, 0.1), ..Material::default() })?;
/// assets.remove(brick)?;
/// assert!(assets.get(brick).is_err());
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
#[derive(Debug, Default)]
pub struct Assets {
    pub(crate) meshes: Slots<Mesh>,
    pub(crate) materials: Slots<Material>,
    pub(crate) textures: Slots<Texture>,
}

impl Assets {
    /// Adds an asset.
    ///
    /// # Errors
    /// If the asset is invalid, or refers to an asset that is not in this collection.
    pub fn add<T: Asset>(&mut self, asset: T) -> Result<Handle<T>, SceneError> {
        asset.check(self)?;
        Ok(T::slots_mut(self).insert(asset))
    }

    /// Replaces an asset, for every object that refers to it.
    ///
    /// # Errors
    /// If the handle is stale or the new asset is invalid. Nothing changes then.
    pub fn replace<T: Asset>(&mut self, handle: Handle<T>, asset: T) -> Result<(), SceneError> {
        asset.check(self)?;
        *T::slots_mut(self).get_mut(handle)? = asset;
        Ok(())
    }

    /// Removes an asset. The next frame rejects and reports objects that still refer to it.
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn remove<T: Asset>(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        T::slots_mut(self).remove(handle)
    }

    /// Returns an asset.
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn get<T: Asset>(&self, handle: Handle<T>) -> Result<&T, StaleHandle> {
        T::slots(self).get(handle)
    }

    /// All assets of one type, in slot order.
    pub fn iter<T: Asset>(&self) -> impl Iterator<Item = (Handle<T>, &T)> {
        T::slots(self).iter()
    }
}

/// A type that [`Assets`] stores: [`Mesh`], [`Material`] and [`Texture`].
pub trait Asset: Sized + sealed::Sealed + 'static {
    #[doc(hidden)]
    fn slots(assets: &Assets) -> &Slots<Self>;
    #[doc(hidden)]
    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self>;
    #[doc(hidden)]
    fn check(&self, _assets: &Assets) -> Result<(), SceneError> {
        Ok(())
    }
}

impl Asset for Mesh {
    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.meshes
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.meshes
    }
}

impl Asset for Material {
    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.materials
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.materials
    }

    fn check(&self, assets: &Assets) -> Result<(), SceneError> {
        if let Some(texture) = self.texture {
            assets.textures.get(texture)?;
        }
        if self.is_valid() { Ok(()) } else { Err(SceneError::InvalidMaterial { material: self.name.clone() }) }
    }
}

impl Asset for Texture {
    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.textures
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.textures
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Mesh {}
    impl Sealed for super::Material {}
    impl Sealed for super::Texture {}
}
