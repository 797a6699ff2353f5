//! The precision of transforms.

/// How positions are transformed to clip space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TransformPrecision {
    /// The camera's position is subtracted from the object's in 64-bit fixed point. The error is below 1e-3 pixels
    /// wherever in the world the camera is, for objects farther away than they are large, at 1080p and fields of view
    /// from 27° to 90°; see [`GpuView`](crate::view::GpuView) for others.
    #[default]
    CameraRelative,
    /// World-space positions in f32, as in most engines. At 1 km from the world's origin the error is 0.05 pixels on
    /// average and 2 at most; at 1,000 km it is 50 on average and unbounded; at 100,000 km it is unusable. It exists
    /// for comparison.
    Absolute,
}
