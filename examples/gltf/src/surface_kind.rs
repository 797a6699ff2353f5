//! Kinds of surfaces: each is drawn by processes of its own.

/// Which surfaces a process draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SurfaceKind {
    /// Without holes.
    Opaque,
    /// With holes.
    Masked,
    /// Blended over what is behind them.
    Blended,
}
