//! Numbers to draw with.

use std::fmt::Debug;

use num_traits::{Float, NumAssign};

/// A number to draw with: f32, or f64.
pub trait Real: Float + NumAssign + Default + Debug + Send + Sync + 'static {
    /// The nearest to `value`.
    fn of(value: f64) -> Self;

    /// The nearest to `value`.
    fn of_integer(value: i64) -> Self;

    /// The same, or the nearest f64.
    fn as_f64(self) -> f64;
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }

    fn of_integer(value: i64) -> Self {
        value as Self
    }

    fn as_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn of_integer(value: i64) -> Self {
        value as Self
    }

    fn as_f64(self) -> f64 {
        self
    }
}
