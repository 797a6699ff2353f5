//! The ways to cut a frame.

use drawloom::Granularity;

/// A way to cut a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub name: &'static str,
    pub granularity: Granularity,
    /// Whether it is one thread's.
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

    /// Whether it is the same whatever the scene. One thread is too.
    pub fn is_fixed(index: usize) -> bool {
        index != Self::ADAPTIVE
    }
}
