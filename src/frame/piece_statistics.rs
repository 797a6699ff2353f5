//! Statistics of pieces.

/// What a frame did with the scene's [pieces](crate::scene::Piece), which is the number of pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PieceStatistics {
    /// That were recorded by earlier frames, so that views may execute them.
    pub executable: usize,
    /// That this frame records.
    pub recorded: usize,
    /// With an object that is reported as changed.
    pub changed: usize,
}
