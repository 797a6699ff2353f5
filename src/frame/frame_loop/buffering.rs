//! How many frames are in flight.

/// How far the engine may run ahead of the device: a trade of throughput against latency and memory (S 9.0).
///
/// With `cpu` as the time of updating and recording a frame, and `device` as that of drawing it, a frame takes about
/// this long, and its picture shows the input of about that long ago when it is drawn:
///
/// | | a frame every | latency | buffers of |
/// | --- | --- | --- | --- |
/// | `SameFrame` | `cpu + device` | `cpu + device` | 1 frame |
/// | `Double` | the longer of both | up to twice the longer | 2 frames |
/// | `Triple` | the longer of both, also where single frames take longer | up to three times the longer | 3 frames |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Buffering {
    /// The device draws a frame before the engine begins the next one (S figure 9.2): the least latency and memory.
    /// While one works the other waits.
    SameFrame,
    /// The engine makes a frame while the device draws the one before (S figure 9.1).
    #[default]
    Double,
    /// A frame more, so that neither waits where single frames of the other take longer.
    Triple,
}

impl Buffering {
    /// All of them, from the least latency to the most.
    pub const ALL: [Self; 3] = [Self::SameFrame, Self::Double, Self::Triple];

    /// The most frames from [`FrameLoop::begin`](super::FrameLoop::begin) until the device has drawn them.
    pub fn frames_in_flight(self) -> usize {
        match self {
            Self::SameFrame => 1,
            Self::Double => 2,
            Self::Triple => 3,
        }
    }
}
