//! What a step computes from.

use drawloom::process::Format;

/// The target that a step computes from, in each main view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepSource {
    /// The target: an output of the frame, or any other that is not
    /// [transient](drawloom::backend::WgpuBackend::transient_targets).
    pub target: String,
    /// If the target is to be made smaller first, what width and height are divided by, rounded up, and the format of
    /// the smaller one: see [`AsyncPost::downsample`](crate::AsyncPost::downsample).
    pub downsampled: Option<(u32, Format)>,
}

impl StepSource {
    /// A target as it is, such as `picture`.
    pub fn whole(target: impl AsRef<str>) -> Self {
        Self { target: target.as_ref().to_owned(), downsampled: None }
    }

    /// A target with so much less width and height, in [`Format::Rgba16Float`]: each pixel is the mean of `divisor` ×
    /// `divisor`.
    pub fn downsampled(target: impl AsRef<str>, divisor: u32) -> Self {
        Self { downsampled: Some((divisor, Format::Rgba16Float)), ..Self::whole(target) }
    }
}
