//! Tone mapping curves.

/// How radiance, which has no upper end, becomes a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneCurve {
    /// The filmic curve that Narkowicz (2015) fitted to ACES.
    #[default]
    Filmic,
    /// Cut off at 1: cheap, and without any drawing in what is brighter.
    Clipped,
}
