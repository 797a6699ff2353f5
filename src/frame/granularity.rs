//! How finely a frame is divided into jobs.

use crate::command::DrawList;

/// How finely a frame is divided into jobs, from the first command of a pass to its last (M 10.5, "Better Load
/// Balancing"): the stages *fill*, *bin*, *sort*, *instance*, *triangles* and *record*. It decides which worker does
/// what, never the picture.
///
/// Before that there are no draws. Updating objects and uploading them, which all cameras share, and culling them for a
/// view are cut by measured cost in every mode; with [`PerCamera`](Self::PerCamera), culling is one job a view.
///
/// Frames of all but [`Adaptive`](Self::Adaptive) are executed in parallel even where one worker alone would be faster.
/// Two things are not divided: [static groups](crate::scene::StaticGroup) keep their bundles of
/// [`BATCHES_PER_BUNDLE`](DrawList::BATCHES_PER_BUNDLE) draws, and a backend whose recording strategy an engine has
/// fixed records by that strategy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Granularity {
    /// By measured cost: each stage of each process is divided into as many jobs as its work is worth. It adapts to a
    /// scene, or to a change of it, within 30 frames.
    #[default]
    Adaptive,
    /// One job for each stage of a camera's processes: M's first design.
    PerCamera,
    /// One job for each draw, which is recorded as a bundle of its own: M's "more advanced solution". To divide
    /// commands into parts of one, one job sorts them all.
    PerDraw,
    /// One job for this many draws. Not 0. A job that records divides them into bundles of equal size, at most
    /// [`BATCHES_PER_BUNDLE`](DrawList::BATCHES_PER_BUNDLE) draws each, and rounds up to whole bundles.
    Chunk(usize),
}

impl Granularity {
    /// The number of draws in a job; `None` where something else decides.
    pub(super) fn draws_per_job(self) -> Option<usize> {
        match self {
            Self::Adaptive | Self::PerCamera => None,
            Self::PerDraw => Some(1),
            Self::Chunk(draws) => Some(draws),
        }
    }

    /// The number of items in a job that divides draws, where an item has up to `draws_per_item`; `None` where the
    /// cost model decides.
    pub(super) fn items_per_job_by_draws(self, draws_per_item: usize) -> Option<usize> {
        match self {
            Self::Adaptive => None,
            Self::PerCamera => Some(usize::MAX),
            Self::PerDraw | Self::Chunk(_) => self.draws_per_job().map(|draws| draws.div_ceil(draws_per_item)),
        }
    }

    /// The number of batches in a bundle: a job records whole bundles.
    pub(super) fn batches_per_bundle(self) -> usize {
        let max = DrawList::BATCHES_PER_BUNDLE;
        self.draws_per_job().map_or(max, |draws| draws.div_ceil(draws.div_ceil(max)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_records_whole_bundles() {
        for draws in (1..2_000).chain([usize::MAX - 1, usize::MAX]) {
            let granularity = Granularity::Chunk(draws);
            let (bundle, bundles) = (
                granularity.batches_per_bundle() as u128,
                granularity.items_per_job_by_draws(DrawList::BATCHES_PER_BUNDLE).unwrap() as u128,
            );
            assert!((1..=DrawList::BATCHES_PER_BUNDLE as u128).contains(&bundle));
            // Rounded up to bundles of equal size.
            assert!(
                (draws as u128..draws as u128 + bundles).contains(&(bundle * bundles)),
                "{draws}: {bundles} × {bundle}"
            );
        }
        assert_eq!(Granularity::PerDraw.batches_per_bundle(), 1);
        assert_eq!(Granularity::PerCamera.batches_per_bundle(), DrawList::BATCHES_PER_BUNDLE);
    }
}
