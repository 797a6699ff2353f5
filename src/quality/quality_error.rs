//! Errors of invalid quality settings.

/// Why a [`Quality`](super::Quality) is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum QualityError {
    /// A setting is out of range.
    #[error("quality setting {setting} is {value}; valid: {range}")]
    OutOfRange {
        /// The setting's field name, such as `shadows.side`.
        setting: &'static str,
        /// Its value.
        value: String,
        /// The valid range.
        range: &'static str,
    },
    /// Occlusion culling is enabled, and Drawloom was built without it.
    #[error("occlusion needs the feature `occlusion` of drawloom, which is off")]
    OcclusionFeature,
    /// Occlusion culling is enabled without a culling volume.
    #[error("occlusion needs a culling volume: objects without one are never hidden")]
    OcclusionWithoutVolume,
    /// Occlusion culling is enabled with absolute transforms.
    #[error("occlusion needs camera-relative transforms: absolute ones draw objects at inaccurate positions")]
    OcclusionWithAbsoluteTransforms,
}
