//! The numbers that the rasteriser is generic over.

use std::fmt::Debug;

use num_traits::{Float, NumAssign};

/// A floating-point number: f32 or f64.
pub trait Real: Float + NumAssign + Default + Debug + Send + Sync + 'static {
    /// Rounds an f64 to the nearest value.
    fn of(value: f64) -> Self;

    /// Rounds an integer to the nearest value.
    fn of_integer(value: i64) -> Self;

    /// Converts to f64, without loss.
    fn as_f64(self) -> f64;
}

impl Real for f32 {
    #[inline]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline]
    fn of_integer(value: i64) -> Self {
        value as Self
    }

    #[inline]
    fn as_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    #[inline]
    fn of(value: f64) -> Self {
        value
    }

    #[inline]
    fn of_integer(value: i64) -> Self {
        value as Self
    }

    #[inline]
    fn as_f64(self) -> f64 {
        self
    }
}
