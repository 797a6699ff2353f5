//! An object as shaders read it.

/// An object as shaders read it. Its position is in fixed point, so that it can be taken relative to any view's camera
/// exactly: one table serves all views, wherever they are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuObject {
    /// The lower halves of the position's three coordinates.
    pub position_low: [u32; 3],
    /// Its material's slot.
    pub material: u32,
    /// The upper halves of the position's three coordinates.
    pub position_high: [i32; 3],
    /// Keeps what follows at a multiple of 16 bytes, as WGSL wants it.
    pub padding: u32,
    /// From object space to the world's axes: x, y, z, w.
    pub orientation: [f32; 4],
    /// Along the object's own axes.
    pub scale: [f32; 3],
    /// Its index.
    pub object: u32,
}
