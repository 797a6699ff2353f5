//! How wrong a choice must be before it changes.

/// How wrong a choice must be before it changes: a factor greater than 1.
#[derive(Clone, Copy, Debug)]
pub struct Hysteresis(f32);

impl Hysteresis {
    /// Keeps choices that are wrong by less than this factor, which is greater than 1.
    pub const fn new(factor: f32) -> Self {
        Self(factor)
    }

    /// The factor.
    pub fn factor(self) -> f32 {
        self.0
    }

    /// Whether an alternative that costs `other` replaces the current choice, which costs `current`. One of equal cost
    /// never does.
    pub fn replaces(self, other: f32, current: f32) -> bool {
        other < current && current >= other * self.0
    }

    /// Whether a size is kept, if another one would be best now.
    pub fn keeps(self, size: f32, best: f32) -> bool {
        !self.replaces(best, size) && !self.replaces(size, best)
    }

    /// Whether a value counts as above a threshold: it rises above at the threshold times the factor, and falls below
    /// at the threshold.
    pub fn is_above(self, value: f32, threshold: f32, was_above: bool) -> bool {
        value >= if was_above { threshold } else { threshold * self.0 }
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use super::*;

    const HYSTERESIS: Hysteresis = Hysteresis::new(1.5);

    #[test]
    fn the_current_choice_stays_until_it_is_wrong_by_the_factor() {
        assert!(!HYSTERESIS.replaces(100.0, 149.0) && HYSTERESIS.replaces(100.0, 151.0));
        assert!(!HYSTERESIS.replaces(0.0, 0.0) && HYSTERESIS.replaces(0.0, 1.0));
        assert!(HYSTERESIS.keeps(100.0, 149.0) && HYSTERESIS.keeps(149.0, 100.0));
        assert!(!HYSTERESIS.keeps(100.0, 151.0) && !HYSTERESIS.keeps(151.0, 100.0));
    }

    #[test]
    fn a_value_between_the_two_thresholds_changes_nothing() {
        for was_above in [false, true] {
            assert_eq!(HYSTERESIS.is_above(120.0, 100.0, was_above), was_above);
            assert!(HYSTERESIS.is_above(150.0, 100.0, was_above) && !HYSTERESIS.is_above(99.0, 100.0, was_above));
        }
    }
}
