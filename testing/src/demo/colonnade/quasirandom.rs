//! Low-discrepancy sequences: numbers from 0 to 1 that are evenly distributed and do not repeat.

/// Element `step` of the golden ratio sequence.
pub(super) fn golden_ratio(step: usize) -> f32 {
    (step as f32 * 0.618_034).fract()
}

/// Element `step` of the R₃ sequence, which covers a cube as the golden ratio sequence covers a line (Roberts 2018,
/// "The Unreasonable Effectiveness of Quasirandom Sequences").
pub(super) fn r3(step: usize) -> [f32; 3] {
    [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|stride: f32| (stride * step as f32).fract())
}
