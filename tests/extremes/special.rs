//! Numbers that are none, or hardly.

/// Numbers at the ends of f32, and those that lie between nothing and something.
pub const SPECIAL: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    // The least subnormal.
    f32::from_bits(1),
    -f32::from_bits(1),
    0.0,
    -0.0,
    1e-20,
];

/// The same for places in the world.
pub const SPECIAL_PLACES: [f64; 14] = [
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
