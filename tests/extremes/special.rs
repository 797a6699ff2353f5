//! Special floating-point numbers.

/// NaN, infinities, the limits of f32, subnormals and zeros.
pub const SPECIAL: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    // The smallest subnormal.
    f32::from_bits(1),
    -f32::from_bits(1),
    0.0,
    -0.0,
    1e-20,
];

/// The same for positions in the world.
pub const SPECIAL_POSITIONS: [f64; 14] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    f64::from_bits(1),
    -f64::from_bits(1),
    0.0,
    -0.0,
    f32::MAX as f64,
    1e10,
    -4_294_967_296.0,
    1e-12,
];
