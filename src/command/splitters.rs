//! Splitters: keys that divide a pass's commands into buckets, which are sorted and merged in parallel.

use drawloom_jobs::internal::ChunkedArray;

use super::{RenderCommand, SortKey};

/// The splitters of a sample sort: keys that divide a pass's commands into buckets of about equal size, one job each
/// (Blelloch et al., "A Comparison of Sorting Algorithms for the Connection Machine CM-2", 1991).
///
/// They decide which job sorts a command, never the result.
#[derive(Clone, Debug, Default)]
pub struct Splitters {
    /// The first key of each bucket but the first, ascending.
    keys: Vec<SortKey>,
    samples: Vec<SortKey>,
}

/// The keys of one bucket: a half-open range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct KeyRange {
    first: SortKey,
    /// The end is not in the range. No command that is drawn has the last key.
    end: SortKey,
}

impl Splitters {
    /// Commands per bucket, on average, at least. Sampling makes some buckets smaller.
    pub const MIN_COMMANDS_PER_BUCKET: usize = 1024;

    /// The most buckets. The job of each reads every key of the pass.
    pub const MAX_BUCKETS: usize = 32;

    /// The most buckets that are worth their cost for a pass with `count` commands, where all passes that are sorted
    /// have about `of_all`: twice its share of the workers, by commands, so that a worker that ends early finds another
    /// bucket. The job of a bucket reads every key of the pass, so more are wasted work.
    pub(crate) fn max_buckets(workers: usize, count: usize, of_all: usize) -> usize {
        let of_all = of_all.max(1);
        // Rounded up, but for less than a quarter of a bucket: passes that are alike never have quite the same count.
        let quarters = (8 * workers).saturating_mul(count) / of_all;
        quarters.div_ceil(4).clamp(1, workers)
    }

    /// Chooses the splitters of `buckets` buckets for the first `count` commands, or of fewer where buckets would be
    /// smaller than [`Splitters::MIN_COMMANDS_PER_BUCKET`].
    pub(crate) fn choose(&mut self, commands: &ChunkedArray<RenderCommand>, count: usize, buckets: usize) {
        self.keys.clear();
        let buckets = buckets.min(count / Self::MIN_COMMANDS_PER_BUCKET).clamp(1, Self::MAX_BUCKETS);
        if buckets == 1 {
            return;
        }
        let samples = buckets * SAMPLES_PER_BUCKET;
        self.samples.clear();
        self.samples.extend((0..samples).filter_map(|sample| {
            let index = sampled_index(sample, samples, count);
            let command = commands.read(index / ChunkedArray::<RenderCommand>::BLOCK_SIZE)
                [index % ChunkedArray::<RenderCommand>::BLOCK_SIZE];
            (command.key != SortKey::LAST).then_some(command.key)
        }));
        self.samples.sort_unstable();
        let length = self.samples.len();
        self.keys.extend((1..buckets).filter_map(|bucket| self.samples.get(bucket * length / buckets).copied()));
        self.keys.dedup();
    }

    /// The number of buckets, at least 1.
    pub(crate) fn bucket_count(&self) -> usize {
        self.keys.len() + 1
    }

    /// The keys of one bucket.
    ///
    /// # Panics
    /// If `bucket` is [`Splitters::bucket_count`] or more.
    pub(crate) fn key_range(&self, bucket: usize) -> KeyRange {
        let first = bucket.checked_sub(1).map_or(SortKey::FIRST, |before| self.keys[before]);
        KeyRange::between(first, self.keys.get(bucket).copied().unwrap_or(SortKey::LAST))
    }
}

/// With this many samples the largest bucket is seldom more than a quarter larger than the mean.
const SAMPLES_PER_BUCKET: usize = 64;

/// The index of the command that one of `samples` samples reads. It lies anywhere within the sample's share of the
/// `count` commands: samples at equal distances would miss meshes that repeat with the same period in the scene.
fn sampled_index(sample: usize, samples: usize, count: usize) -> usize {
    // A bit mixer without a pattern that a scene could share: the last step of Appleby's MurmurHash3.
    let mut mixed = (sample as u32).wrapping_add(1).wrapping_mul(0x9e37_79b9);
    mixed = (mixed ^ mixed >> 16).wrapping_mul(0x85eb_ca6b);
    mixed = (mixed ^ mixed >> 13).wrapping_mul(0xc2b2_ae35);
    let within = u64::from(mixed ^ mixed >> 16);
    let count = count as u64;
    ((sample as u64 * count + ((within * count) >> 32)) / samples as u64) as usize
}

impl KeyRange {
    /// The keys of every command that is drawn.
    pub(crate) const ALL: Self = Self { first: SortKey::FIRST, end: SortKey::LAST };

    /// The keys from `first` up to and without `end`.
    pub(crate) fn between(first: SortKey, end: SortKey) -> Self {
        Self { first, end }
    }

    /// Whether a key is in the range.
    #[inline]
    pub(crate) fn contains(self, key: SortKey) -> bool {
        // One comparison for both ends: the difference of a key before `first` wraps around to a large number.
        key.bits().wrapping_sub(self.first.bits()) < self.end.bits().wrapping_sub(self.first.bits())
    }

    /// Whether it is [`KeyRange::ALL`].
    #[inline]
    pub(crate) fn is_all(self) -> bool {
        self == Self::ALL
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::sort::tests::blocks_of;
    use crate::command::{DrawState, SortScratch, sort};

    fn commands_of(depths: &[f32]) -> ChunkedArray<RenderCommand> {
        let command = |(index, &depth): (usize, &f32)| match index as u32 {
            object if depth > 0.0 => RenderCommand {
                key: SortKey::opaque(DrawState::PLAIN, object % 3, depth.to_bits() << 1),
                object,
                mesh: object % 3,
                material: 0,
                state: DrawState::PLAIN,
            },
            _ => RenderCommand::EMPTY,
        };
        blocks_of(&depths.iter().enumerate().map(command).collect::<Vec<_>>())
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Depths {
        Few,
        Many,
        /// So that a sample of the first commands would not be one of all.
        Ascending,
    }

    #[test]
    fn passes_share_the_workers_by_their_commands() {
        // Four alike on two workers are a job each, and on sixteen eight jobs each.
        for count in [99, 100, 101] {
            assert_eq!([1, 2, 4, 16].map(|workers| Splitters::max_buckets(workers, count, 400)), [1, 1, 2, 8]);
        }
        // One that has nearly all of them gets all workers, the others one each.
        assert_eq!([20, 1].map(|count| Splitters::max_buckets(8, count, 23)), [8, 1]);
        // In a first frame nothing is known of the others.
        assert_eq!([0, 5, usize::MAX].map(|count| Splitters::max_buckets(2, count, 0)), [1, 2, 2]);
    }

    #[test]
    fn samples_do_not_follow_a_period_of_the_scene() {
        // Samples at even distances would all but miss one of the three meshes.
        let count = 23_038;
        let commands = commands_of(&vec![1.0; count]);
        let mut splitters = Splitters::default();
        splitters.choose(&commands, count, 3);
        splitters.samples.chunk_by(|a, b| a == b).for_each(|alike| {
            assert!((48..=80).contains(&alike.len()), "{} of {}", alike.len(), splitters.samples.len());
        });
        assert_eq!(splitters.samples.chunk_by(|a, b| a == b).count(), 3);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10))]

        #[test]
        fn buckets_in_sequence_are_all_commands_in_order(
            count in 0_usize..40_000, buckets in 1_usize..40, seed in any::<u64>(),
            order in prop::sample::select(vec![Depths::Few, Depths::Many, Depths::Ascending]),
        ) {
            let depth = |index: u64| {
                let random = (index ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
                match order {
                    Depths::Few => (random % 3) as f32,
                    Depths::Many => (random % 100_000) as f32,
                    Depths::Ascending => (index / 3 + 1) as f32,
                }
            };
            let depths: Vec<f32> = (0..count as u64).map(depth).collect();
            let commands = commands_of(&depths);
            let (mut scratch, mut splitters) = (SortScratch::default(), Splitters::default());
            splitters.choose(&commands, count, buckets);
            let buckets = buckets.min(count / Splitters::MIN_COMMANDS_PER_BUCKET).clamp(1, Splitters::MAX_BUCKETS);
            prop_assert!(splitters.bucket_count() <= buckets);
            let (mut in_buckets, mut whole, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
            for index in 0..splitters.bucket_count() {
                sort(&commands, count, splitters.key_range(index), &mut scratch, &mut sorted);
                if order != Depths::Few {
                    prop_assert!(sorted.len() <= 3 * count / buckets, "{} of {count} in one of {buckets}", sorted.len());
                }
                in_buckets.append(&mut sorted);
            }
            sort(&commands, count, KeyRange::ALL, &mut scratch, &mut whole);
            prop_assert_eq!(whole.len(), depths.iter().filter(|&&depth| depth > 0.0).count());
            prop_assert!(whole.is_sorted_by_key(|command| (command.key, command.object)));
            prop_assert!(in_buckets == whole);
        }
    }
}
