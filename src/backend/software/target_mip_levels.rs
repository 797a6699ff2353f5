//! The mip levels of targets.

use parking_lot::Mutex;

use super::executor::Executor;
use super::pixel_formats::stored;
use super::precision::Precision;
use super::tiles::{Tile, Tiling};
use crate::backend::mip_generation::mip_level_count;
use crate::process::Format;
use crate::raster::Real;
use crate::task::JobPanic;

/// A mip level of a target, from level 1 on. No pass draws into it, so it has no tiles.
#[derive(Clone)]
pub(super) struct MipLevel<R> {
    size: [usize; 2],
    /// Of each pixel the channels of the format, rows from top to bottom.
    numbers: Box<[R]>,
}

impl<R: Precision> MipLevel<R> {
    /// All levels but level 0 of a target of this size in pixels, all 0; `None` if out of memory.
    pub(super) fn chain(size: [u32; 2], channels: usize) -> Option<Vec<Self>> {
        let level = |level: u32| {
            let size = size.map(|pixels| (pixels >> level).max(1) as usize);
            let mut numbers = Vec::new();
            numbers.try_reserve_exact(size[0] * size[1] * channels).ok()?;
            numbers.resize(size[0] * size[1] * channels, R::zero());
            Some(Self { size, numbers: numbers.into_boxed_slice() })
        };
        (1..mip_level_count(size)).map(level).collect()
    }

    /// The numbers of a pixel of the level.
    #[inline]
    pub(super) fn pixel(&self, [x, y]: [usize; 2], channels: usize) -> &[R] {
        &self.numbers[(y * self.size[0] + x) * channels..][..channels]
    }

    /// Makes each pixel the mean of those of the finer level that it covers, weighted by area, and rounded to the
    /// format.
    fn update<'a>(
        &mut self,
        executor: &Executor,
        format: Format,
        finer_size: [usize; 2],
        finer: impl Fn([usize; 2]) -> &'a [R] + Sync,
    ) -> Result<(), JobPanic> {
        let channels = format.channels();
        let column_weights: Vec<_> = (0..self.size[0]).map(|x| weights::<R>(x, finer_size[0])).collect();
        let rows: Vec<_> = self.numbers.chunks_exact_mut(self.size[0] * channels).map(Mutex::new).collect();
        executor.for_each(rows.len(), |y| {
            let row_weights = weights::<R>(y, finer_size[1]);
            for ((x, pixel), column_weights) in
                rows[y].lock().chunks_exact_mut(channels).enumerate().zip(&column_weights)
            {
                let mut mean = [R::zero(); 4];
                for (row, row_weight) in row_weights.iter().enumerate() {
                    for (column, column_weight) in column_weights.iter().enumerate() {
                        let weight = *column_weight * *row_weight;
                        // Pixels without weight may not exist.
                        if weight > R::zero() {
                            let values = finer([2 * x + column, 2 * y + row]);
                            mean.iter_mut().zip(values).for_each(|(mean, value)| *mean += *value * weight);
                        }
                    }
                }
                pixel.iter_mut().zip(stored(format, mean)).for_each(|(number, mean)| *number = mean);
            }
        })
    }
}

/// Generates all levels of a target from level 0, each from the one before.
///
/// # Errors
/// If a job panics. This is a bug in Drawloom.
pub(super) fn generate<R: Precision>(
    executor: &Executor,
    format: Format,
    (tiling, tiles): (Tiling, &[Tile<R>]),
    levels: &mut [MipLevel<R>],
) -> Result<(), JobPanic> {
    let channels = format.channels();
    for index in 0..levels.len() {
        let (finer, coarser) = levels.split_at_mut(index);
        match finer.last() {
            Some(finer) => {
                coarser[0].update(executor, format, finer.size, |pixel| finer.pixel(pixel, channels))?;
            }
            None => coarser[0].update(executor, format, tiling.size(), |pixel| {
                let (tile, index) = tiling.find(pixel);
                tiles[tile].pixel(index, channels)
            })?,
        }
    }
    Ok(())
}

/// The weights, along one axis, of the finer level's pixels 2i, 2i + 1 and 2i + 2 in pixel i.
fn weights<R: Real>(index: usize, finer_size: usize) -> [R; 3] {
    let (zero, half) = (R::zero(), R::of(0.5));
    if finer_size == 1 {
        return [R::one(), zero, zero];
    }
    if finer_size.is_multiple_of(2) {
        return [half, half, zero];
    }
    // Each pixel covers finer_size / size of them.
    let size = finer_size / 2;
    [size - index, size, index + 1].map(|part| R::of_integer(part as i64) / R::of_integer(finer_size as i64))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The mean of all pixels of the finer level, each weighted by the area of it that lies within a pixel of the
    /// coarser one.
    fn mean(pixel: [usize; 2], size: [usize; 2], finer_size: [usize; 2], finer: impl Fn([usize; 2]) -> f64) -> f64 {
        let extent = [0, 1].map(|axis| finer_size[axis] as f64 / size[axis] as f64);
        let within = |axis: usize, index: usize| {
            let (start, end) = (pixel[axis] as f64 * extent[axis], (pixel[axis] + 1) as f64 * extent[axis]);
            (end.min((index + 1) as f64) - start.max(index as f64)).max(0.0)
        };
        // Most of the pixels of a large level are elsewhere.
        let weighted = |axis: usize| {
            (0..finer_size[axis]).map(move |index| (index, within(axis, index))).filter(|&(_, weight)| weight > 0.0)
        };
        let columns: Vec<_> = weighted(0).collect();
        let sum: f64 = weighted(1)
            .map(|(y, height)| columns.iter().map(|&(x, width)| width * height * finer([x, y])).sum::<f64>())
            .sum();
        sum / (extent[0] * extent[1])
    }

    fn check<R: Precision>(size: [usize; 2], numbers: &[f64], error: f64) -> Result<(), TestCaseError> {
        let tiling = Tiling::new(size);
        let mut tiles: Vec<_> = (0..tiling.count()).map(|_| Tile::<R>::new(1).unwrap()).collect();
        for (number, index) in numbers.iter().zip(0..size[0] * size[1]) {
            let (tile, pixel) = tiling.find([index % size[0], index / size[0]]);
            tiles[tile].numbers_mut()[pixel] = R::of(*number);
        }
        let mut levels = MipLevel::chain(size.map(|pixels| pixels as u32), 1).unwrap();
        generate(&Executor::CallingThread, Format::R32Float, (tiling, &tiles), &mut levels).unwrap();
        let mut finer = (size, numbers.to_vec());
        for level in &levels {
            let (finer_size, values) = finer;
            prop_assert_eq!(level.size, finer_size.map(|pixels| (pixels / 2).max(1)));
            for (index, found) in level.numbers.iter().enumerate() {
                let pixel = [index % level.size[0], index / level.size[0]];
                let expected = mean(pixel, level.size, finer_size, |[x, y]| values[y * finer_size[0] + x]);
                prop_assert!((found.as_f64() - expected).abs() <= error, "{:?}: {:?} {}", pixel, found, expected);
            }
            finer = (level.size, level.numbers.iter().map(|number| number.as_f64()).collect());
        }
        prop_assert_eq!(finer.0, [1, 1]);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// In f32 each of 9 products and sums of numbers up to 1 is off by 2⁻²⁴ at most, and so are weights.
        #[test]
        fn levels_are_means_weighted_by_area(
            size in prop::array::uniform2(prop_oneof![1..10_usize, 60..70_usize]),
            seed in any::<u64>(),
        ) {
            let mut random = fastrand::Rng::with_seed(seed);
            let numbers: Vec<_> = (0..size[0] * size[1]).map(|_| f64::from(random.f32())).collect();
            check::<f64>(size, &numbers, 1e-12)?;
            check::<f32>(size, &numbers, 36.0 / 16_777_216.0)?;
        }
    }

    #[test]
    fn levels_of_small_sizes_are_means() {
        for size in [[1, 1], [1, 2], [9, 1], [2, 2], [3, 3], [3, 5], [7, 4], [5, 8]] {
            let numbers: Vec<_> = (0..size[0] * size[1]).map(|index| ((index * 37) % 11) as f64).collect();
            check::<f64>(size, &numbers, 1e-12).unwrap();
        }
    }
}
