//! `light_batches.wgsl` in Rust.

use crate::raster::{Real, Vector3};

/// A sum of light in batches of 32, and in batches of 32 of these: a term is rounded with those of its batch, not with
/// all that follow it.
pub(in crate::process::deferred) struct LightBatches<R> {
    sum: Vector3<R>,
    batches: Vector3<R>,
    batch: Vector3<R>,
    count: usize,
}

impl<R: Real> Default for LightBatches<R> {
    fn default() -> Self {
        Self { sum: Vector3::zero(), batches: Vector3::zero(), batch: Vector3::zero(), count: 0 }
    }
}

impl<R: Real> LightBatches<R> {
    pub(in crate::process::deferred) fn add(&mut self, light: Vector3<R>) {
        self.batch = self.batch + light;
        self.count += 1;
        if self.count.is_multiple_of(32) {
            self.batches = self.batches + self.batch;
            self.batch = Vector3::zero();
        }
        if self.count.is_multiple_of(1024) {
            self.sum = self.sum + self.batches;
            self.batches = Vector3::zero();
        }
    }

    pub(in crate::process::deferred) fn sum(&self) -> Vector3<R> {
        self.sum + (self.batches + self.batch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::cpu_shader::test_inputs::UNIT;

    /// Each term is added with up to 31 others, its batch with up to 31 others, those to n/1024 others, and all is
    /// added twice more. An addition that rounds to nearest loses 2⁻²⁴ of its sum.
    #[test]
    fn rounding_grows_with_batches_and_not_with_terms() {
        for count in [1_usize, 31, 32, 33, 100, 1_023, 1_024, 1_025, 10_000, 1_000_000] {
            // No power of two, so that sums are rounded.
            let terms = (0..count).map(|index| if index % 7 == 0 { 0.7_f32 } else { 1e-5 });
            let (mut batches, mut exact) = (LightBatches::default(), 0.0);
            for term in terms {
                batches.add(Vector3::splat(term));
                exact += f64::from(term);
            }
            let additions = 64.0 + count as f64 / 1024.0;
            let error = (f64::from(batches.sum()[1]) / exact - 1.0).abs();
            assert!(error <= additions * UNIT, "{count} terms: {error}");
        }
    }
}
