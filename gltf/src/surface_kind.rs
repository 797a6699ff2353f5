//! Kinds of surfaces: each is drawn by processes of its own.

/// Which surfaces a process draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SurfaceKind {
    /// Without holes.
    Opaque,
    /// With holes.
    Masked,
    /// The same, in shadow maps.
    #[cfg_attr(not(feature = "draw"), expect(dead_code, reason = "only drawing needs it"))]
    MaskedCasters,
    /// Blended over what is behind them.
    Blended,
}

#[cfg(feature = "draw")]
impl SurfaceKind {
    /// Whether its surfaces have holes.
    pub(crate) fn has_holes(self) -> bool {
        matches!(self, Self::Masked | Self::MaskedCasters)
    }
}
