//! The collection of meshes, materials and textures.

use sealed::Stored;

use super::{Material, Mesh, SceneError, Texture};
use crate::handle::{Handle, SlotReserver, Slots, StaleHandle};

/// Owns meshes, materials and textures. An engine with its own storage for objects keeps its assets here too, so that a
/// frame uploads an asset only when it is new or has changed; and a mesh not before the first frame in which an object
/// has it.
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
    priorities: Priorities,
}

/// By slot; 0 beyond the ends.
#[derive(Debug, Default)]
struct Priorities {
    meshes: Vec<i32>,
    textures: Vec<i32>,
}

impl Assets {
    /// Adds an asset.
    ///
    /// # Errors
    /// If the asset is invalid, or refers to an asset that is not in this collection.
    pub fn add<T: Asset>(&mut self, asset: T) -> Result<Handle<T>, SceneError> {
        asset.check(self)?;
        let handle = T::slots_mut(self).insert(asset);
        self.store_priority(handle, 0);
        Ok(handle)
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
    /// If the handle is stale, or the asset has not [arrived](Self::receive) yet: see [`Assets::unload`].
    pub fn remove<T: Asset>(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        T::slots_mut(self).remove(handle)
    }

    /// Whether a handle is that of an asset that has not [arrived](Self::receive) yet.
    pub fn is_pending<T: Asset>(&self, handle: Handle<T>) -> bool {
        T::slots(self).is_reserved(handle)
    }

    /// Removes an asset, whether it has arrived or not. Returns it if it has; otherwise it is dropped when it is
    /// loaded.
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn unload<T: Asset>(&mut self, handle: Handle<T>) -> Result<Option<T>, StaleHandle> {
        if self.is_pending(handle) {
            return self.release(handle).map(|()| None);
        }
        self.remove(handle).map(Some)
    }

    /// Adds the asset of a handle that is pending.
    ///
    /// # Errors
    /// If it is not pending.
    pub(super) fn fill<T: Asset>(&mut self, handle: Handle<T>, priority: i32, asset: T) -> Result<(), StaleHandle> {
        T::slots_mut(self).fill(handle, asset)?;
        self.store_priority(handle, priority);
        Ok(())
    }

    /// Makes a pending handle stale.
    ///
    /// # Errors
    /// If it is not pending.
    pub(super) fn release<T: Asset>(&mut self, handle: Handle<T>) -> Result<(), StaleHandle> {
        T::slots_mut(self).release(handle)
    }

    /// Returns an asset.
    ///
    /// # Errors
    /// If the handle is stale, or the asset has not [arrived](Self::receive) yet.
    pub fn get<T: Asset>(&self, handle: Handle<T>) -> Result<&T, StaleHandle> {
        T::slots(self).get(handle)
    }

    /// Sets in which order a backend that streams brings meshes and textures to the device: those with a higher
    /// priority first, once those that are in sight are there. It may change at any time. If not everything in sight
    /// fits into the streaming budget, it also decides what is left out. It is 0 where nothing is set; materials have
    /// none.
    ///
    /// # Errors
    /// If the handle is stale, or the asset has not [arrived](Self::receive) yet.
    pub fn set_priority<T: Asset>(&mut self, handle: Handle<T>, priority: i32) -> Result<(), StaleHandle> {
        T::slots(self).get(handle)?;
        self.store_priority(handle, priority);
        Ok(())
    }

    /// The priority of an asset.
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn priority<T: Asset>(&self, handle: Handle<T>) -> Result<i32, StaleHandle> {
        T::slots(self).get(handle)?;
        Ok(self.priority_of_slot::<T>(handle.index()))
    }

    /// The priority of the asset in a slot.
    pub(crate) fn priority_of_slot<T: Asset>(&self, slot: u32) -> i32 {
        T::priorities(self).and_then(|priorities| priorities.get(slot as usize)).copied().unwrap_or(0)
    }

    fn store_priority<T: Asset>(&mut self, handle: Handle<T>, priority: i32) {
        let Some(priorities) = T::priorities_mut(self) else { return };
        let slot = handle.index() as usize;
        if slot >= priorities.len() {
            if priority == 0 {
                return;
            }
            priorities.resize(slot + 1, 0);
        }
        priorities[slot] = priority;
    }

    /// All assets of one type, in slot order.
    pub fn iter<T: Asset>(&self) -> impl Iterator<Item = (Handle<T>, &T)> {
        T::slots(self).iter()
    }
}

/// Makes handles of assets on any thread, before the assets are there.
#[derive(Debug)]
pub struct AssetReservers {
    meshes: SlotReserver<Mesh>,
    materials: SlotReserver<Material>,
    textures: SlotReserver<Texture>,
}

impl AssetReservers {
    pub(super) fn new(assets: &Assets) -> Self {
        let Assets { meshes, materials, textures, .. } = assets;
        Self { meshes: meshes.reserver(), materials: materials.reserver(), textures: textures.reserver() }
    }
}

/// A type that [`Assets`] stores: [`Mesh`], [`Material`] and [`Texture`].
pub trait Asset: sealed::Stored {}

impl Asset for Mesh {}
impl Asset for Material {}
impl Asset for Texture {}

impl Stored for Mesh {
    fn reserve(slots: &AssetReservers) -> Handle<Self> {
        slots.meshes.reserve()
    }

    fn as_mesh(handle: Handle<Self>) -> Option<Handle<Mesh>> {
        Some(handle)
    }

    fn priorities(assets: &Assets) -> Option<&Vec<i32>> {
        Some(&assets.priorities.meshes)
    }

    fn priorities_mut(assets: &mut Assets) -> Option<&mut Vec<i32>> {
        Some(&mut assets.priorities.meshes)
    }

    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.meshes
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.meshes
    }
}

impl Stored for Material {
    fn reserve(slots: &AssetReservers) -> Handle<Self> {
        slots.materials.reserve()
    }

    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.materials
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.materials
    }

    fn check(&self, assets: &Assets) -> Result<(), SceneError> {
        if let Some(texture) = self.texture.filter(|texture| !assets.is_pending(*texture)) {
            assets.textures.get(texture)?;
        }
        if self.is_valid() { Ok(()) } else { Err(SceneError::InvalidMaterial { material: self.name.clone() }) }
    }
}

impl Stored for Texture {
    fn reserve(slots: &AssetReservers) -> Handle<Self> {
        slots.textures.reserve()
    }

    fn priorities(assets: &Assets) -> Option<&Vec<i32>> {
        Some(&assets.priorities.textures)
    }

    fn priorities_mut(assets: &mut Assets) -> Option<&mut Vec<i32>> {
        Some(&mut assets.priorities.textures)
    }

    fn slots(assets: &Assets) -> &Slots<Self> {
        &assets.textures
    }

    fn slots_mut(assets: &mut Assets) -> &mut Slots<Self> {
        &mut assets.textures
    }
}

mod sealed {
    use super::{AssetReservers, Assets, Handle, Mesh, SceneError, Slots};

    /// Only the crate knows how assets are stored.
    pub trait Stored: Sized + Send + 'static {
        fn slots(assets: &Assets) -> &Slots<Self>;
        fn slots_mut(assets: &mut Assets) -> &mut Slots<Self>;
        /// A handle of an asset that is to be loaded.
        fn reserve(slots: &AssetReservers) -> Handle<Self>;
        fn as_mesh(_handle: Handle<Self>) -> Option<Handle<Mesh>> {
            None
        }
        /// The priorities by slot; `None` for a type without.
        fn priorities(_assets: &Assets) -> Option<&Vec<i32>> {
            None
        }
        fn priorities_mut(_assets: &mut Assets) -> Option<&mut Vec<i32>> {
            None
        }
        fn check(&self, _assets: &Assets) -> Result<(), SceneError> {
            Ok(())
        }
    }
}
