//! Pictures brought back from where they were drawn.

use crate::process::Format;

/// A target's pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// What a pixel is.
    pub format: Format,
    /// Rows from top to bottom, without padding.
    pub bytes: Vec<u8>,
}
