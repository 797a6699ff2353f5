//! Which images share a texture array.

use std::collections::BTreeMap;

use crate::mip_levels::byte_count;

/// The number of arrays that the shader has.
pub(crate) const ARRAYS: usize = 4;

/// The size of the layers of an array, and of the images in it.
#[derive(Clone, Debug)]
pub(crate) struct ArraySize {
    pub(crate) size: [u32; 2],
    pub(crate) sizes: Vec<[u32; 2]>,
    /// The number of images.
    count: u64,
}

impl ArraySize {
    /// The bytes of the array, with mip levels.
    pub(crate) fn bytes(&self) -> u64 {
        self.count.saturating_mul(byte_count(self.size))
    }

    fn joined(&self, other: &Self) -> Self {
        let size = [0, 1].map(|axis| self.size[axis].max(other.size[axis]));
        let sizes = self.sizes.iter().chain(&other.sizes).copied().collect();
        Self { size, sizes, count: self.count + other.count }
    }
}

/// How many arrays are compared with each other.
const MAX_COMPARED: usize = 64;

/// The sizes of up to [`ARRAYS`] arrays for images of some sizes: each size has one of its own, as long as there are
/// enough. Then those share one that waste the least.
pub(crate) fn array_sizes(of_images: impl Iterator<Item = [u32; 2]>) -> Vec<ArraySize> {
    let mut of_sizes = BTreeMap::new();
    for size in of_images {
        of_sizes.entry(size).or_insert(ArraySize { size, sizes: vec![size], count: 0 }).count += 1;
    }
    let mut arrays: Vec<_> = of_sizes.into_values().collect();
    if arrays.len() > MAX_COMPARED {
        // Those of the same powers of two share one at first.
        let mut of_powers: BTreeMap<_, ArraySize> = BTreeMap::new();
        for array in arrays {
            let power = array.size.map(u32::next_power_of_two);
            let joined = of_powers.get(&power).map_or(array.clone(), |other| other.joined(&array));
            of_powers.insert(power, joined);
        }
        arrays = of_powers.into_values().collect();
    }
    while arrays.len() > ARRAYS {
        let pairs = (0..arrays.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        let waste = |(one, other): &(usize, usize)| {
            let (one, other) = (&arrays[*one], &arrays[*other]);
            one.joined(other).bytes().saturating_sub(one.bytes() + other.bytes())
        };
        let Some((one, other)) = pairs.min_by_key(waste) else { break };
        let joined = arrays[one].joined(&arrays[other]);
        arrays.swap_remove(one);
        arrays[other] = joined;
    }
    arrays
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_size_is_in_one_array_that_is_large_enough() {
        let mut state = 1_u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below + 1
        };
        for count in [0, 1, 4, 5, 30, 300] {
            let sizes: Vec<[u32; 2]> = (0..count).map(|_| [next(8192), next(90)]).collect();
            let arrays = array_sizes(sizes.iter().copied());
            assert!(arrays.len() <= ARRAYS && arrays.iter().map(|array| array.count).sum::<u64>() == count);
            for size in sizes {
                let of_size: Vec<_> = arrays.iter().filter(|array| array.sizes.contains(&size)).collect();
                assert_eq!(of_size.len(), 1);
                assert!(size[0] <= of_size[0].size[0] && size[1] <= of_size[0].size[1]);
            }
        }
    }

    #[test]
    fn those_share_an_array_that_waste_the_least() {
        let arrays = array_sizes([[8192, 1], [1, 8192], [64, 64], [60, 64], [7, 7]].into_iter());
        let mut shared: Vec<_> = arrays.iter().map(|array| array.size).collect();
        shared.sort();
        assert_eq!(shared, [[1, 8192], [7, 7], [64, 64], [8192, 1]]);
    }
}
