//! Drives controllers in tests, with costs as a machine would measure them.

use std::fmt::Debug;

use fastrand::Rng;

/// Measures costs with noise and outliers.
pub struct Signal {
    random: Rng,
    noise: f32,
    /// One sample in this many is an outlier; 0 for none.
    outlier_interval: u32,
    outlier_factor: f32,
}

impl Signal {
    /// A signal without noise and outliers.
    pub fn new(seed: u64) -> Self {
        Self { random: Rng::with_seed(seed), noise: 0.0, outlier_interval: 0, outlier_factor: 1.0 }
    }

    /// Samples are greater than the cost by up to this part of it, evenly distributed.
    pub fn with_noise(self, noise: f32) -> Self {
        Self { noise, ..self }
    }

    /// One sample in `interval` is greater by `factor`: a worker was preempted.
    pub fn with_outliers(self, interval: u32, factor: f32) -> Self {
        Self { outlier_interval: interval, outlier_factor: factor, ..self }
    }

    /// A sample of a cost.
    pub fn sample(&mut self, cost: f32) -> f32 {
        let is_outlier = self.outlier_interval > 0 && self.random.u32(..self.outlier_interval) == 0;
        cost * (1.0 + self.noise * self.random.f32()) * if is_outlier { self.outlier_factor } else { 1.0 }
    }
}

/// How good the choices of a controller must be under any signal.
pub struct ControllerBounds {
    /// Within how many frames its choice is right: at first, after a step, and after the step back.
    pub settles_within: [usize; 3],
    /// How many of the thousand frames after that may be wrong: trials, and what outliers cause.
    pub max_wrong: usize,
    /// How often the choice may change in these frames.
    pub max_changes: usize,
}

/// Drives a controller through a step of its costs and back, each without noise, with noise, with outliers, and with
/// both.
///
/// `frame` runs one frame, in which costs are those after the step if the flag is set, measured by the signal, and
/// returns the choice that the frame was run with. `is_right` says whether a choice is right before or after the step.
pub fn check_controller<C, T: PartialEq + Debug>(
    bounds: &ControllerBounds,
    controller: impl Fn() -> C,
    mut frame: impl FnMut(&mut C, bool, &mut Signal) -> T,
    is_right: impl Fn(&T, bool) -> bool,
) {
    let quiet = || Signal::new(7);
    let signals = [
        ("quiet", quiet()),
        ("noise", quiet().with_noise(0.2)),
        ("outliers", quiet().with_outliers(40, 40.0)),
        ("noise and outliers", quiet().with_noise(0.2).with_outliers(40, 40.0)),
    ];
    for (name, mut signal) in signals {
        let mut controller = controller();
        let phases = [("at first", false), ("after the step", true), ("after the step back", false)];
        for ((phase, is_after), settles_within) in phases.into_iter().zip(bounds.settles_within) {
            (0..settles_within).for_each(|_| drop(frame(&mut controller, is_after, &mut signal)));
            let chosen: Vec<_> = (0..1000).map(|_| frame(&mut controller, is_after, &mut signal)).collect();
            let wrong: Vec<_> = chosen.iter().filter(|choice| !is_right(choice, is_after)).collect();
            let first = wrong.first();
            assert!(wrong.len() <= bounds.max_wrong, "{name}, {phase}: {} wrong choices: {first:?}", wrong.len());
            let changes = chosen.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(changes <= bounds.max_changes, "{name}, {phase}: {changes} changes");
        }
    }
}
