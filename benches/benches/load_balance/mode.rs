//! The granularity modes.

use drawloom::Granularity;

/// How finely a frame is cut, and on how many workers it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub name: &'static str,
    pub granularity: Granularity,
    /// Whether it runs on one thread.
    pub is_serial: bool,
}

impl Mode {
    /// In the order they are shown.
    pub const ALL: [Self; 7] = [
        Self { is_serial: true, ..Self::of("serial", Granularity::PerCamera) },
        Self::of("per-camera", Granularity::PerCamera),
        Self::of("per-draw", Granularity::PerDraw),
        Self::of("chunk-64", Granularity::Chunk(64)),
        Self::of("chunk-256", Granularity::Chunk(256)),
        Self::of("chunk-1024", Granularity::Chunk(1024)),
        Self::of("adaptive", Granularity::Adaptive),
    ];
    pub const SERIAL: usize = 0;
    pub const PER_CAMERA: usize = 1;
    pub const ADAPTIVE: usize = 6;

    const fn of(name: &'static str, granularity: Granularity) -> Self {
        Self { name, granularity, is_serial: false }
    }

    /// Whether the granularity is the same for all scenes. The serial mode counts.
    pub fn is_fixed(index: usize) -> bool {
        index != Self::ADAPTIVE
    }
}
