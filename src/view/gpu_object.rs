//! The GPU layout of an object.

use crate::scene::PREVIOUS_OBJECTS;

/// The GPU layout of an object: `Object` in `drawloom.wgsl`. The position is in fixed point, so its difference from any
/// view's camera is exact, and one table serves all views.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuObject {
    /// The lower halves of the position's coordinates.
    pub position_low: [u32; 3],
    /// The material's slot.
    pub material: u32,
    /// The upper halves of the position's coordinates.
    pub position_high: [i32; 3],
    /// Aligns the next field to 16 bytes, as WGSL requires.
    pub padding: u32,
    /// The quaternion from object to world axes: x, y, z, w.
    pub orientation: [f32; 4],
    /// The scale along the object's axes.
    pub scale: [f32; 3],
    /// The object's index in the scene.
    pub object: u32,
}

// The column has them as they are.
const _: () = assert!(PREVIOUS_OBJECTS.layout().stride == size_of::<GpuObject>());
