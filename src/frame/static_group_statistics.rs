//! Statistics of static groups.

/// What a frame did with the scene's [static groups](crate::scene::StaticGroup), which is the number of static groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaticGroupStatistics {
    /// That were recorded by earlier frames, so that views may execute them.
    pub executable: usize,
    /// That this frame records.
    pub recorded: usize,
    /// With an object that is reported as changed.
    pub changed: usize,
}
