//! Versions of what is kept from frame to frame.

/// The version of something that is kept from frame to frame: equal versions have equal contents, so what is derived
/// from one need not be derived again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Version {
    /// The renderer's frame that made it, counted from 1; 0 for what no frame has made.
    pub frame: u64,
    /// Its index among what that frame made of the same kind.
    pub index: usize,
}
