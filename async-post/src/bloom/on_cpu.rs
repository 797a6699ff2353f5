//! Bloom on the CPU.

use drawloom::backend::Picture;
use drawloom::process::Format;
use drawloom::task::{Scheduler, Worker};
use half::f16;
use half::slice::HalfFloatSliceExt;
use parking_lot::Mutex;

use super::kernel::{Kernel, NAME};
use crate::step::{AsyncStep, StepFrame};

/// Numbers of a pixel.
const CHANNELS: usize = 4;

/// The largest half float.
const MAX_HALF: f32 = 65_504.0;

/// Bloom on the CPU.
pub(super) struct BloomStep {
    kernel: Kernel,
    /// Memory that frames have used, so that pages are not faulted in again for each of them.
    scratch: Mutex<Vec<Scratch>>,
}

#[derive(Default)]
struct Scratch {
    /// The picture, blurred along rows.
    rows: Vec<f32>,
}

impl BloomStep {
    pub(super) fn new(kernel: Kernel) -> Self {
        Self { kernel, scratch: Mutex::default() }
    }
}

impl AsyncStep for BloomStep {
    fn name(&self) -> &str {
        NAME
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        let &Picture { width, height, format, ref bytes } = frame.picture;
        assert_eq!(format, Format::Rgba16Float, "bloom reads half floats");
        let row_length = width as usize * CHANNELS;
        let mut scratch = self.scratch.lock().pop().unwrap_or_default();
        scratch.rows.resize(row_length * height as usize, 0.0);
        let mut blurred = vec![0_u8; bytes.len()];

        let sources = bytes.chunks_exact(row_length * size_of::<f16>());
        for_each_row(frame.scheduler, scratch.rows.chunks_exact_mut(row_length).zip(sources), |(row, source)| {
            blur_row(source, &self.kernel, row);
        });
        let targets = blurred.chunks_exact_mut(row_length * size_of::<f16>()).enumerate();
        for_each_row(frame.scheduler, targets, |(y, target)| {
            blur_column(&scratch.rows, row_length, y, &self.kernel.weights, target);
        });
        self.scratch.lock().push(scratch);
        Picture { width, height, format, bytes: blurred }
    }
}

/// Calls `body` with each row, on all workers that have nothing else to do.
///
/// # Panics
/// If `body` panics.
fn for_each_row<I: ExactSizeIterator + Send>(scheduler: &Scheduler, rows: I, body: impl Fn(I::Item) + Sync) {
    let body = |row, _: &Worker| body(row);
    if let Err(panic) = scheduler.parallel_for_each(rows, body) {
        panic!("{}", panic.message);
    }
}

/// Blurs what is brighter than the threshold along a row of half floats.
fn blur_row(source: &[u8], Kernel { threshold, weights }: &Kernel, target: &mut [f32]) {
    let radius = weights.len() - 1;
    // With the pixels at both ends repeated, so that the loops below have no conditions.
    let mut padded = vec![0.0; target.len() + 2 * radius * CHANNELS];
    let halves: Vec<f16> = source.chunks_exact(2).map(|half| f16::from_le_bytes([half[0], half[1]])).collect();
    let (start, end) = (radius * CHANNELS, radius * CHANNELS + target.len());
    halves.convert_to_f32_slice(&mut padded[start..end]);
    // The threshold is 0 or more, so infinite radiance becomes the largest half float, and NaN 0.
    for value in &mut padded[start..end] {
        let above = *value - *threshold;
        *value = if above > 0.0 { above.min(MAX_HALF) } else { 0.0 };
    }
    for distance in 0..radius {
        padded.copy_within(start..start + CHANNELS, distance * CHANNELS);
        padded.copy_within(end - CHANNELS..end, end + distance * CHANNELS);
    }
    add_weighted(weights, target, |distance| {
        let [before, after] = [radius - distance, radius + distance].map(|pixel| pixel * CHANNELS);
        [&padded[before..], &padded[after..]]
    });
}

/// Blurs rows along the column at a row, and stores half floats.
fn blur_column(rows: &[f32], row_length: usize, y: usize, weights: &[f32], target: &mut [u8]) {
    let last = rows.len() / row_length - 1;
    let mut sums = vec![0.0; row_length];
    add_weighted(weights, &mut sums, |distance| {
        [y.saturating_sub(distance), (y + distance).min(last)].map(|row| &rows[row * row_length..][..row_length])
    });
    let mut halves = vec![f16::ZERO; row_length];
    halves.convert_from_f32_slice(&sums);
    target.chunks_exact_mut(2).zip(&halves).for_each(|(bytes, half)| bytes.copy_from_slice(&half.to_le_bytes()));
}

/// Makes `sums` the weighted sums of the numbers at each distance, which `at` returns for both sides.
#[multiversion::multiversion(targets("x86_64+avx2"))]
fn add_weighted<'a>(weights: &[f32], sums: &mut [f32], at: impl Fn(usize) -> [&'a [f32]; 2]) {
    let [middle, _] = at(0);
    sums.iter_mut().zip(middle).for_each(|(sum, value)| *sum = weights[0] * value);
    for (distance, &weight) in weights.iter().enumerate().skip(1) {
        let [before, after] = at(distance);
        for ((sum, before), after) in sums.iter_mut().zip(before).zip(after) {
            *sum += weight * (before + after);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use drawloom::scene::Camera;

    /// Each pixel of the blur as a double sum, in f64.
    fn oracle(
        (threshold, radius): (f32, u32),
        width: usize,
        height: usize,
        source: &[[f64; 4]],
        [x, y]: [usize; 2],
    ) -> [f64; 3] {
        let radius = i64::from(radius.clamp(1, 31));
        let weight = |distance: i64| (-2.0 * (distance as f64 / radius as f64).powi(2)).exp();
        let all: f64 = (-radius..=radius).map(weight).sum();
        let mut sums = [0.0; 3];
        for down in -radius..=radius {
            for across in -radius..=radius {
                let column = (x as i64 + across).clamp(0, width as i64 - 1) as usize;
                let row = (y as i64 + down).clamp(0, height as i64 - 1) as usize;
                for (channel, sum) in sums.iter_mut().enumerate() {
                    let bright = (source[row * width + column][channel] - f64::from(threshold)).max(0.0);
                    *sum += bright.min(65_504.0) * weight(across) * weight(down) / (all * all);
                }
            }
        }
        sums
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// All terms are 0 or more. Each of two sums has up to 63 terms, a product, and a weight that is rounded: 66
        /// roundings of 2⁻²⁴; the subtraction of the threshold is another one, of the larger number. Then the half
        /// float is rounded, by 2⁻¹¹, or 2⁻²⁵ if it is denormal.
        #[test]
        fn it_is_the_naive_blur_up_to_rounding(
            (width, height) in (1..40_usize, 1..24_usize),
            radius in 0..40_u32,
            threshold in prop_oneof![Just(0.0_f32), 0.0..3.0_f32],
            seed in any::<u64>(),
            workers in 1..4_usize,
        ) {
            let mut state = seed;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                match state >> 60 {
                    0 => f16::MAX,
                    1 => f16::INFINITY,
                    2 => f16::from_bits((state >> 33) as u16 & 0x3ff),
                    3 => f16::from_f64(-1.0),
                    _ => f16::from_f64((state >> 40) as f64 / f64::from(1 << 22)),
                }
            };
            let halves: Vec<f16> = (0..width * height * CHANNELS).map(|_| next()).collect();
            let bytes = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
            let picture = Picture { width: width as u32, height: height as u32, format: Format::Rgba16Float, bytes };
            let source: Vec<[f64; 4]> =
                halves.chunks_exact(4).map(|pixel| std::array::from_fn(|channel| pixel[channel].to_f64())).collect();
            let scheduler = Scheduler::new(workers).unwrap();
            let camera = Camera::looking_at("main", drawloom::glam::DVec3::Z, drawloom::glam::DVec3::ZERO);
            let frame = StepFrame { picture: &picture, camera: &camera, number: 1, scheduler: &scheduler };
            let step = BloomStep::new(Kernel::new(threshold, radius));
            let blurred = step.compute(&frame);
            prop_assert_eq!(&step.compute(&frame), &blurred, "the memory of the frame before changes nothing");
            // The threshold is subtracted from numbers of up to 2¹⁶, in f32.
            let of_roundings = 133.0 * f64::from(f32::EPSILON) * 0.5;
            for y in 0..height {
                for x in 0..width {
                    let expected = oracle((threshold, radius), width, height, &source, [x, y]);
                    let start = (y * width + x) * 8;
                    for (channel, expected) in expected.into_iter().enumerate() {
                        let found = [0, 1].map(|byte| blurred.bytes[start + channel * 2 + byte]);
                        let found = f16::from_le_bytes(found).to_f64();
                        let bound = expected * (of_roundings + 2_f64.powi(-11)) * (1.0 + 2_f64.powi(-10))
                            + f64::from(threshold) * 2_f64.powi(-24)
                            + 2_f64.powi(-25);
                        prop_assert!((found - expected).abs() <= bound, "{x} {y} {channel}: {found} {expected} {bound}");
                    }
                }
            }
        }
    }
}
