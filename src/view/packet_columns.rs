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
    pub(super) positions: &'a Lanes<DVec3>,
    pub(super) orientations: &'a Lanes<Quat>,
    pub(super) scales: &'a Lanes<Vec3>,
    pub(super) bounds: &'a Lanes<Bounds>,
    pub(super) meshes: &'a Lanes<Handle<Mesh>>,
    pub(super) materials: &'a Lanes<Handle<Material>>,
}

/// The entries of up to eight objects that do not lie side by side in the columns. Unused lanes repeat the first object.
pub(super) struct GatheredColumns {
    positions: Lanes<DVec3>,
    orientations: Lanes<Quat>,
    scales: Lanes<Vec3>,
    bounds: Lanes<Bounds>,
    meshes: Lanes<Handle<Mesh>>,
    materials: Lanes<Handle<Material>>,
}

impl<'a> PacketColumns<'a> {
    /// The packet of eight objects from `first` on.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub(super) fn new(scene: &SceneRef<'a>, first: usize) -> Self {
        Self {
            positions: packet(scene.positions, first),
            orientations: packet(scene.orientations, first),
            scales: packet(scene.scales, first),
            bounds: packet(scene.bounds, first),
            meshes: packet(scene.meshes, first),
            materials: packet(scene.materials, first),
        }
    }
}

impl GatheredColumns {
    /// The packet of these objects: one to eight.
    ///
    /// # Panics
    /// If there are more or none, or if one does not exist.
    #[inline(always)]
    pub(super) fn new(scene: &SceneRef<'_>, objects: &[usize]) -> Self {
        let first = objects[0];
        let mut columns = Self {
            positions: [scene.positions[first]; LANES],
            orientations: [scene.orientations[first]; LANES],
            scales: [scene.scales[first]; LANES],
            bounds: [scene.bounds[first]; LANES],
            meshes: [scene.meshes[first]; LANES],
            materials: [scene.materials[first]; LANES],
        };
        for (lane, &object) in objects.iter().enumerate().skip(1) {
            columns.positions[lane] = scene.positions[object];
            columns.orientations[lane] = scene.orientations[object];
            columns.scales[lane] = scene.scales[object];
            columns.bounds[lane] = scene.bounds[object];
            columns.meshes[lane] = scene.meshes[object];
            columns.materials[lane] = scene.materials[object];
        }
        columns
    }

    #[inline(always)]
    pub(super) fn columns(&self) -> PacketColumns<'_> {
        let Self { positions, orientations, scales, bounds, meshes, materials } = self;
        PacketColumns { positions, orientations, scales, bounds, meshes, materials }
    }
}

/// The eight entries of a column from `first` on.
#[inline(always)]
fn packet<T>(column: &[T], first: usize) -> &Lanes<T> {
    column[first..].first_chunk().expect("the packet is whole")
}
