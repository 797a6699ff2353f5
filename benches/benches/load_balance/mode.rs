//! The modes: M's three designs, and granularities between the first two.

use drawloom::Granularity;

/// How a frame is divided and recorded, and whether on one worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub name: &'static str,
    pub granularity: Granularity,
    /// Whether it runs on one thread.
    pub is_serial: bool,
    /// Whether commands are recorded in parallel, but translated for the device on its own thread, when the frame is
    /// submitted (Scheib's design, M 10.2).
    pub translates_on_submit: bool,
}

impl Mode {
    /// In the order they are shown.
    pub const ALL: [Self; 8] = [
        Self { is_serial: true, ..Self::of("serial", Granularity::PerCamera) },
        Self::of("per-camera", Granularity::PerCamera),
        Self::of("per-draw", Granularity::PerDraw),
        Self::of("chunk-64", Granularity::Chunk(64)),
        Self::of("chunk-256", Granularity::Chunk(256)),
        Self::of("chunk-1024", Granularity::Chunk(1024)),
        Self { translates_on_submit: true, ..Self::of("translate-on-submit", Granularity::Adaptive) },
        Self::of("adaptive", Granularity::Adaptive),
    ];
    pub const SERIAL: usize = 0;
    pub const ADAPTIVE: usize = 7;

    const fn of(name: &'static str, granularity: Granularity) -> Self {
        Self { name, granularity, is_serial: false, translates_on_submit: false }
    }

    /// Whether the granularity is the same for all scenes. The serial mode counts.
    pub fn is_fixed(index: usize) -> bool {
        Self::ALL[index].granularity != Granularity::Adaptive
    }
}
