//! How finely a frame is cut into jobs.

/// The job size of everything in a frame that can be cut: of what is done for all views together, and of each view's
/// visibility, fill, sort, instance, triangles and record (M 10.5, "Better Load Balancing"). It decides who does what when, never what
/// is drawn: bundles are cut at fixed places whatever it is, so every granularity gives the same picture to the byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Granularity {
    /// As it pays: every frame is measured, and each stage of each process is cut into as many jobs as its work is worth,
    /// or not at all. It has learnt a scene, or a change of it, within 30 frames.
    #[default]
    Adaptive,
    /// Nothing is cut: a job a view, M's first design.
    PerCamera,
    /// A job a draw: M's "more advanced solution". Of what has larger smallest parts, such as bundles, a job for each of them.
    PerDraw,
    /// A job for this many objects or draws; of what has larger smallest parts, for as many of them as hold these. Not 0.
    Chunk(usize),
}

impl Granularity {
    /// How many parts of so many items each make a job; `None` where that is to be learnt.
    pub(super) fn parts(self, items_per_part: usize) -> Option<usize> {
        match self {
            Self::Adaptive => None,
            Self::PerCamera => Some(usize::MAX),
            Self::PerDraw => Some(1),
            Self::Chunk(items) => Some(items.div_ceil(items_per_part)),
        }
    }
}
