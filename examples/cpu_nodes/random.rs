//! Numbers that look random, and are the same in every frame.

/// From 0 to 1, without 1. The same for the same number and salt.
pub fn random(number: u32, salt: u32) -> f32 {
    let mut mixed = number.wrapping_mul(0x9E37_79B9) ^ salt.wrapping_mul(0x85EB_CA6B);
    mixed = (mixed ^ mixed >> 16).wrapping_mul(0x7FEB_352D);
    mixed = (mixed ^ mixed >> 15).wrapping_mul(0x846C_A68B);
    ((mixed ^ mixed >> 16) >> 8) as f32 / (1 << 24) as f32
}
