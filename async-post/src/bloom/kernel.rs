//! What bloom on the CPU and on the device have in common.

/// The name of the step.
pub(super) const NAME: &str = "bloom";

/// The largest radius of a blur, in pixels.
pub(super) const MAX_RADIUS: u32 = 31;

/// A blur of what is brighter than a threshold.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    /// 0 or more.
    pub(super) threshold: f32,
    /// The weights of pixels at the distances 0, 1, ... from a pixel. All but the first count twice, and their sum is
    /// 1.
    pub(super) weights: Vec<f32>,
}

impl Kernel {
    /// A Gaussian. Numbers out of range count as the nearest in it, and NaN as 0.
    pub(super) fn new(threshold: f32, radius: u32) -> Self {
        let radius = radius.clamp(1, MAX_RADIUS);
        let deviation = f64::from(radius) * 0.5;
        let of = |distance: u32| (-0.5 * (f64::from(distance) / deviation).powi(2)).exp();
        let sum = of(0) + 2.0 * (1..=radius).map(of).sum::<f64>();
        let weights = (0..=radius).map(|distance| (of(distance) / sum) as f32).collect();
        Self { threshold: threshold.max(0.0), weights }
    }
}
