//! How finely a frame is divided into jobs.

/// The job size of every stage that can be divided: of the objects' stages, and of each view's and pass's visibility,
/// coarse depth, occlusion, fill, sort, instance, triangles and record (M 10.5, "Better Load Balancing"). It decides
/// which worker does what, never the picture: bundles end at fixed batches, so every granularity draws the same bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Granularity {
    /// By measured cost: each stage of each process is divided into as many jobs as its work is worth. It adapts to a
    /// scene, or to a change of it, within 30 frames.
    #[default]
    Adaptive,
    /// One job per stage and camera, and one per stage for what all cameras share: M's first design.
    PerCamera,
    /// One job per draw: M's "more advanced solution". Where the smallest item holds several draws, as a bundle does,
    /// one job per item.
    PerDraw,
    /// One job for this many objects or draws, rounded up to whole items. Not 0.
    Chunk(usize),
}

impl Granularity {
    /// The number of items in a job, where an item has `units_per_item` objects or draws; `None` where the cost model
    /// decides.
    pub(super) fn items_per_job(self, units_per_item: usize) -> Option<usize> {
        match self {
            Self::Adaptive => None,
            Self::PerCamera => Some(usize::MAX),
            Self::PerDraw => Some(1),
            Self::Chunk(units) => Some(units.div_ceil(units_per_item)),
        }
    }
}
