//! What a frame can hold of a scene's objects.

use super::GpuObject;
use crate::scene::Mesh;

/// What a frame can hold of a scene's objects, and which meshes and materials they may have.
pub(crate) struct TableLimits<'a> {
    /// Objects from this index on are left out.
    pub(crate) objects: usize,
    /// The bytes of an array of materials, or of their values, that a shader can read.
    pub(crate) material_bytes: u64,
    /// Whether a mesh can be drawn.
    pub(crate) can_draw: &'a dyn Fn(&Mesh) -> bool,
    /// Another one after `material_bytes` or `can_draw` changed.
    pub(crate) revision: u64,
}

impl TableLimits<'_> {
    /// The most objects that commands can name.
    pub(crate) const MAX_OBJECTS: usize = u32::MAX as usize;

    /// Without limits but that.
    pub(crate) const NONE: TableLimits<'static> =
        TableLimits { objects: Self::MAX_OBJECTS, material_bytes: u64::MAX, can_draw: &|_| true, revision: 0 };

    /// Whether arrays reach to the material in a slot, which has `value_bytes` bytes of the engine's own values. In
    /// every backend a material takes at most as much as an object.
    pub(crate) fn reach_material(&self, slot: usize, value_bytes: usize) -> bool {
        let stride = value_bytes.max(size_of::<GpuObject>()) as u64;
        (slot as u64 + 1).checked_mul(stride).is_some_and(|end| end <= self.material_bytes)
    }
}
