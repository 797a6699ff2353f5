//! Pictures read back from a device.

use crate::process::Format;

/// The pixels of a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// The format of a pixel.
    pub format: Format,
    /// Rows from top to bottom, without padding.
    pub bytes: Vec<u8>,
}
