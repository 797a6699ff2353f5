//! The columns of a scene, cut into packets: eight objects that are described together, as packets of rays are traced.

use glam::{DVec3, Quat, Vec3};

use crate::handle::Handle;
use crate::scene::{Bounds, Material, Mesh, SceneRef};

/// The number of objects in a packet.
pub(super) const LANES: usize = 8;

/// One number of each object of a packet.
pub(super) type Lanes<T> = [T; LANES];

/// The columns of a scene for a packet of objects: an entry for each.
#[derive(Clone, Copy)]
pub(super) struct PacketColumns<'a> {
    /// The index of the packet's first object.
    pub(super) first: usize,
    pub(super) positions: &'a Lanes<DVec3>,
    pub(super) orientations: &'a Lanes<Quat>,
    pub(super) scales: &'a Lanes<Vec3>,
    pub(super) bounds: &'a Lanes<Bounds>,
    pub(super) meshes: &'a Lanes<Handle<Mesh>>,
    pub(super) materials: &'a Lanes<Handle<Material>>,
}

/// The entries of a partial last packet. Unused lanes repeat its first object.
pub(super) struct PaddedColumns {
    first: usize,
    positions: Lanes<DVec3>,
    orientations: Lanes<Quat>,
    scales: Lanes<Vec3>,
    bounds: Lanes<Bounds>,
    meshes: Lanes<Handle<Mesh>>,
    materials: Lanes<Handle<Material>>,
}

impl<'a> PacketColumns<'a> {
    /// The packet from the object `first` on. If it is not whole, it is in `padded`.
    ///
    /// # Panics
    /// If there is no object `first`.
    #[inline(always)]
    pub(super) fn new(scene: &SceneRef<'a>, first: usize, padded: &'a mut Option<PaddedColumns>) -> Self {
        match Self::whole(scene, first) {
            Some(columns) => columns,
            None => padded.insert(PaddedColumns::new(scene, first)).columns(),
        }
    }

    #[inline(always)]
    fn whole(scene: &SceneRef<'a>, first: usize) -> Option<Self> {
        Some(Self {
            first,
            positions: scene.positions[first..].first_chunk()?,
            orientations: scene.orientations[first..].first_chunk()?,
            scales: scene.scales[first..].first_chunk()?,
            bounds: scene.bounds[first..].first_chunk()?,
            meshes: scene.meshes[first..].first_chunk()?,
            materials: scene.materials[first..].first_chunk()?,
        })
    }
}

impl PaddedColumns {
    #[cold]
    fn new(scene: &SceneRef<'_>, first: usize) -> Self {
        Self {
            first,
            positions: padded(&scene.positions[first..]),
            orientations: padded(&scene.orientations[first..]),
            scales: padded(&scene.scales[first..]),
            bounds: padded(&scene.bounds[first..]),
            meshes: padded(&scene.meshes[first..]),
            materials: padded(&scene.materials[first..]),
        }
    }

    fn columns(&self) -> PacketColumns<'_> {
        let Self { first, positions, orientations, scales, bounds, meshes, materials } = self;
        PacketColumns { first: *first, positions, orientations, scales, bounds, meshes, materials }
    }
}

/// The entries of a column that is shorter than a packet, and its first entry in the other lanes.
fn padded<T: Copy>(column: &[T]) -> Lanes<T> {
    let mut lanes = [column[0]; LANES];
    for (lane, entry) in lanes.iter_mut().zip(column) {
        *lane = *entry;
    }
    lanes
}
