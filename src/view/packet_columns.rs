//! The columns of a scene, cut into packets: eight objects that are described together, as packets of rays are traced.

use glam::{DVec3, Quat, Vec3};

use crate::handle::Handle;
use crate::scene::{Bounds, Column, Material, Mesh, SceneRef};

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

/// The entries of up to eight objects that do not lie side by side in the columns. Unused lanes repeat the first
/// object.
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
            positions: packet(scene.position_column(), first),
            orientations: packet(scene.orientation_column(), first),
            scales: packet(scene.scale_column(), first),
            bounds: packet(scene.bounds_column(), first),
            meshes: whole(&scene.meshes[first..]),
            materials: whole(&scene.materials[first..]),
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
            positions: [scene.position_column().get(first); LANES],
            orientations: [scene.orientation_column().get(first); LANES],
            scales: [scene.scale_column().get(first); LANES],
            bounds: [scene.bounds_column().get(first); LANES],
            meshes: [scene.meshes[first]; LANES],
            materials: [scene.materials[first]; LANES],
        };
        for (lane, &object) in objects.iter().enumerate().skip(1) {
            columns.positions[lane] = scene.position_column().get(object);
            columns.orientations[lane] = scene.orientation_column().get(object);
            columns.scales[lane] = scene.scale_column().get(object);
            columns.bounds[lane] = scene.bounds_column().get(object);
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
fn packet<T: Copy>(column: Column<'_, T>, first: usize) -> &Lanes<T> {
    whole(column.from(first))
}

/// The first eight entries of a part of a column.
#[inline(always)]
fn whole<T>(entries: &[T]) -> &Lanes<T> {
    entries.first_chunk().expect("the packet is whole")
}
