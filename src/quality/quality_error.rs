//! What quality cannot be.

/// Why there can be no frames of a quality.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum QualityError {
    /// A knob is out of its range.
    #[error("quality: {knob} is {value}, and can be {range}")]
    OutOfRange {
        /// The knob's name: of the field, and of its field.
        knob: &'static str,
        /// What it is.
        value: String,
        /// What it can be.
        range: &'static str,
    },
    /// Occlusion is asked for, and nothing stands for an object that could be hidden.
    #[error("occlusion needs a culling volume: what has none is never hidden")]
    OcclusionWithoutVolume,
    /// Occlusion is asked for, and objects are not drawn where they are.
    #[error("occlusion needs camera-relative transforms: absolute ones draw objects elsewhere than they are")]
    OcclusionWithAbsoluteTransforms,
}
