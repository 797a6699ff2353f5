//! Which segment of a pass an encoder records.

/// The segment of a pass that one encoder records: the first one clears the targets, and the first and the last one
/// write timestamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PassSegment {
    pub(crate) is_first: bool,
    pub(crate) is_last: bool,
}

impl PassSegment {
    /// The whole pass.
    pub(crate) const WHOLE: Self = Self { is_first: true, is_last: true };
}
