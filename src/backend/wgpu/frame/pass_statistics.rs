//! How passes were recorded.

use crate::backend::wgpu::strategy::{EncodingStrategy, RecordingStrategy};

/// How one pass of the frame that was submitted last was recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WgpuPassStatistics {
    /// The render process's name.
    pub process: String,
    /// The view's index.
    pub view: usize,
    /// How its batches were recorded.
    pub recording: RecordingStrategy,
    /// How it was encoded.
    pub encoding: EncodingStrategy,
    /// The number of encoders that it was split over; 0 if it is in the encoder of the pass before it.
    pub encoders: usize,
    /// The number of batches that it draws.
    pub batches: usize,
    /// The number of bundles recorded for it.
    pub recorded_bundles: usize,
    /// The number of cached bundles that it replays.
    pub replayed_bundles: usize,
}
