//! Errors of backends.

/// An error of a backend or its device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// The device lacks a feature; see the backend's constants for all required ones.
    #[error("the device lacks {missing}, which Drawloom needs")]
    MissingFeature {
        /// The missing features.
        missing: String,
    },
    /// A limit of the device is too low; see the backend's constants for all required ones.
    #[error("the device's {limit} is {allowed}, and {needed} are needed")]
    Limit {
        /// The limit's name.
        limit: &'static str,
        /// What the device allows.
        allowed: u64,
        /// What is needed.
        needed: u64,
    },
    /// The device refused a pass: an error in a render process' shader, targets or parameters.
    #[error("the device refused {label}: {message}")]
    Validation {
        /// The pass or resource.
        label: String,
        /// The device's message.
        message: String,
    },
    /// The device is out of memory.
    #[error("the device is out of memory for {label}")]
    OutOfMemory {
        /// The pass or resource that needed memory.
        label: String,
    },
    /// The device was lost.
    #[error("the device was lost: {message}")]
    DeviceLost {
        /// The device's message.
        message: String,
    },
    /// The view's camera is too far from the world's origin, or its numbers are not finite.
    #[error("view {view:?} is out of reach: its camera is more than 2^32 m from the origin")]
    ViewOutOfReach {
        /// The view's name.
        view: String,
    },
    /// A render process has WGSL but no CPU shader, which the software backend runs instead.
    #[error("process {process:?} has no CPU shader, so the software backend cannot draw it")]
    NoCpuShader {
        /// The render process' name.
        process: String,
    },
    /// The CPU shader of a render process panicked.
    #[error("the CPU shader of process {process:?} panicked: {message}")]
    CpuShaderPanicked {
        /// The render process' name.
        process: String,
        /// The panic's message.
        message: String,
    },
    /// A raw pass reported an error.
    #[error("the raw pass failed: {0}")]
    RawPass(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The view has no target of the requested name.
    #[error("view {view} has no target {target:?}")]
    UnknownTarget {
        /// The view's index.
        view: usize,
        /// The requested name.
        target: String,
    },
    /// Pass times were requested from a backend that does not time passes.
    #[error("passes are not timed: see `WgpuBackend::time_passes`")]
    NotTimed,
    /// Drawloom broke a rule between frame and backend: a bug of Drawloom's.
    #[error("broken rule: {rule}")]
    BrokenRule {
        /// The rule.
        rule: String,
    },
}

/// A broken rule between frame and backend.
#[cfg(feature = "wgpu")]
pub(crate) fn broken_rule(rule: &str) -> BackendError {
    BackendError::BrokenRule { rule: rule.to_owned() }
}
