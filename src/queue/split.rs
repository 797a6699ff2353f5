//! Split: many commands into parts that are sorted and merged at the same time.

use crate::blocks::Blocks;
use crate::command::{RenderCommand, SortKey};

/// Cuts a view's commands into parts by key, so that one part after the other is all of them in order: a sample sort, of
/// which every part is a job (Blelloch et al., "A Comparison of Sorting Algorithms for the Connection Machine CM-2", 1991).
///
/// Where the cuts lie decides who sorts what, never what comes out.
#[derive(Clone, Debug, Default)]
pub struct Split {
    /// Where each part but the first starts, ascending.
    starts: Vec<SortKey>,
    samples: Vec<SortKey>,
}

/// The commands of which one job takes care: those whose keys are in a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    first: SortKey,
    /// Not in it; nothing that is drawn has the last key.
    end: SortKey,
}

impl Split {
    /// Fewer commands are no part of their own.
    pub const FEWEST: usize = 1024;

    /// The most parts. Each looks at every key.
    pub const MOST_PARTS: usize = 32;

    /// Cuts the first `count` commands into about so many parts, or fewer where these would be small.
    pub fn cut(&mut self, commands: &Blocks<RenderCommand>, count: usize, parts: usize) {
        self.starts.clear();
        let parts = parts.min(count / Self::FEWEST).clamp(1, Self::MOST_PARTS);
        if parts == 1 {
            return;
        }
        let samples = parts * SAMPLES_PER_PART;
        self.samples.clear();
        self.samples.extend((0..samples).filter_map(|sample| {
            let place = place_of(sample, samples, count);
            let command = commands.read(place / Blocks::<RenderCommand>::SIZE)[place % Blocks::<RenderCommand>::SIZE];
            (command.key != SortKey::LAST).then_some(command.key)
        }));
        self.samples.sort_unstable();
        let length = self.samples.len();
        self.starts.extend((1..parts).filter_map(|part| self.samples.get(part * length / parts).copied()));
        self.starts.dedup();
    }

    /// How many parts there are; one at least.
    pub fn part_count(&self) -> usize {
        self.starts.len() + 1
    }

    /// One of the parts.
    ///
    /// # Panics
    /// If there is no such part.
    pub fn part(&self, index: usize) -> Part {
        let first = index.checked_sub(1).map_or(SortKey::FIRST, |before| self.starts[before]);
        Part::between(first, self.starts.get(index).copied().unwrap_or(SortKey::LAST))
    }
}

/// With so many the largest part is seldom a quarter larger than it should be.
const SAMPLES_PER_PART: usize = 64;

/// Where to look for one of `samples` among `count` commands: anywhere in its share of them, so that what repeats itself in a
/// scene, such as every third object having the same mesh, is not met in step.
fn place_of(sample: usize, samples: usize, count: usize) -> usize {
    // Bits that are mixed until they have no pattern of their own, which might go with one of the scene's (Appleby's MurmurHash3, whose
    // last step this is).
    let mut mixed = (sample as u32).wrapping_add(1).wrapping_mul(0x9e37_79b9);
    mixed = (mixed ^ mixed >> 16).wrapping_mul(0x85eb_ca6b);
    mixed = (mixed ^ mixed >> 13).wrapping_mul(0xc2b2_ae35);
    let within = u64::from(mixed ^ mixed >> 16);
    let count = count as u64;
    ((sample as u64 * count + ((within * count) >> 32)) / samples as u64) as usize
}

impl Part {
    /// Everything that is drawn.
    pub const ALL: Self = Self { first: SortKey::FIRST, end: SortKey::LAST };

    /// What comes from `first` on and before `end`.
    pub fn between(first: SortKey, end: SortKey) -> Self {
        Self { first, end }
    }

    /// Whether a command with this key is in it.
    #[inline]
    pub fn holds(self, key: SortKey) -> bool {
        // Both at once: what is before the first is far behind the end.
        key.bits().wrapping_sub(self.first.bits()) < self.end.bits().wrapping_sub(self.first.bits())
    }

    /// Whether it is everything.
    #[inline]
    pub fn is_all(self) -> bool {
        self == Self::ALL
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;
    use crate::queue::{SortMemory, sort};

    fn commands_of(depths: &[f32]) -> Blocks<RenderCommand> {
        let mut commands = Blocks::new();
        commands.reserve(depths.len(), RenderCommand::NOTHING);
        for (place, &depth) in depths.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
            let key = SortKey::opaque(DrawState::PLAIN, place as u32 % 3, depth.to_bits() << 1);
            commands.write(place / Blocks::<RenderCommand>::SIZE)[place % Blocks::<RenderCommand>::SIZE] =
                RenderCommand {
                    key,
                    object: place as u32,
                    mesh: place as u32 % 3,
                    material: 0,
                    state: DrawState::PLAIN,
                };
        }
        commands
    }

    #[test]
    fn what_repeats_itself_is_not_met_in_step() {
        // Samples at even distances would all but miss one of the three meshes.
        let count = 23_038;
        let commands = commands_of(&vec![1.0; count]);
        let mut split = Split::default();
        split.cut(&commands, count, 3);
        split.samples.chunk_by(|a, b| a == b).for_each(|alike| {
            assert!((48..=80).contains(&alike.len()), "{} of {}", alike.len(), split.samples.len());
        });
        assert_eq!(split.samples.chunk_by(|a, b| a == b).count(), 3);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10))]

        #[test]
        fn parts_one_after_the_other_are_everything_in_order(
            count in 0_usize..40_000, parts in 1_usize..40, seed in any::<u64>(), few_depths in prop::bool::ANY,
        ) {
            let depth = |place: u64| {
                let random = (place ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
                if few_depths { (random % 3) as f32 } else { (random % 100_000) as f32 }
            };
            let depths: Vec<f32> = (0..count as u64).map(depth).collect();
            let commands = commands_of(&depths);
            let (mut memory, mut split) = (SortMemory::default(), Split::default());
            split.cut(&commands, count, parts);
            let parts = parts.min(count / Split::FEWEST).clamp(1, Split::MOST_PARTS);
            prop_assert!(split.part_count() <= parts);
            let (mut in_parts, mut whole, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
            for index in 0..split.part_count() {
                sort(&commands, count, split.part(index), &mut memory, &mut sorted);
                if !few_depths {
                    prop_assert!(sorted.len() <= 3 * count / parts, "{} of {count} in one of {parts}", sorted.len());
                }
                in_parts.append(&mut sorted);
            }
            sort(&commands, count, Part::ALL, &mut memory, &mut whole);
            prop_assert_eq!(whole.len(), depths.iter().filter(|&&depth| depth > 0.0).count());
            prop_assert!(whole.is_sorted_by_key(|command| (command.key, command.object)));
            prop_assert!(in_parts == whole);
        }
    }
}
