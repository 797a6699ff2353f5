//! The precision of transforms.

/// How an object's place in a view is worked out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TransformPrecision {
    /// The camera's place is taken from the object's in 64-bit fixed point: off by less than 1e-3 pixels wherever in the world the
    /// camera is, for what is farther from it than it is large, at 1080p and fields of view from 27° to 90°; see
    /// [`GpuView`](crate::view::GpuView) for others.
    #[default]
    CameraRelative,
    /// Places in the world in f32, as most engines have them: off by 0.05 pixels in the mean and 2 at most at 1 km from the world's
    /// origin, by 50 in the mean and anything at most at 1,000 km, and not to be used at 100,000 km. It is here to be compared with.
    Absolute,
}
