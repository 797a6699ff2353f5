//! Tone mapping curves.

/// The tone mapping curve, which maps unbounded radiance to the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneCurve {
    /// The filmic curve that Narkowicz (2015) fitted to ACES.
    #[default]
    Filmic,
    /// Clamps at 1: cheap, and loses all detail in brighter areas.
    Clipped,
}
