//! The shape and the colours of the land: functions of a place, the same on every thread.

use drawloom::glam::Vec3;

/// The height of lakes, in metres.
pub const WATER: f32 = 0.0;

/// The height of the land in metres.
pub fn height(x: f64, z: f64) -> f32 {
    let hills = octaves(x / 420.0, z / 420.0, 5, 1) * 70.0;
    let mountains = ridges(x / 1300.0, z / 1300.0, 5);
    // Mountains stand in ranges, with plains between them.
    let range = smooth(-0.15, 0.45, octaves(x / 1900.0, z / 1900.0, 2, 77));
    (hills + mountains * mountains * 190.0 * range + 12.0) as f32
}

/// The colour of the ground at a place of this height, whose normal points up as far as `up`. Linear.
pub fn ground(x: f64, z: f64, height: f32, up: f32) -> Vec3 {
    let coarse = octaves(x / 23.0, z / 23.0, 3, 5) as f32;
    let fine = octaves(x / 1.7, z / 1.7, 2, 9) as f32;
    let meadow = Vec3::new(0.10, 0.19, 0.05).lerp(Vec3::new(0.24, 0.26, 0.08), share(-0.4, 0.5, coarse));
    let stone = Vec3::new(0.25, 0.23, 0.21).lerp(Vec3::new(0.37, 0.35, 0.32), share(-0.5, 0.5, coarse + fine * 0.6));
    let sand = Vec3::new(0.55, 0.48, 0.33);
    let snow = Vec3::new(0.86, 0.89, 0.95);
    let steep = 1.0 - share(0.72, 0.86, up + coarse * 0.08);
    let grown = sand.lerp(meadow, share(1.0, 5.0, height - WATER + coarse * 3.0));
    let is_snow = share(96.0, 128.0, height + coarse * 26.0) * share(0.6, 0.78, up);
    let color = grown.lerp(stone, steep).lerp(snow, is_snow);
    color * (1.0 + fine * 0.28)
}

/// A number from 0 to 1 that belongs to a place and a purpose.
pub fn chance(x: i64, z: i64, purpose: u32) -> f64 {
    f64::from(hash(x, z, purpose)) / f64::from(u32::MAX)
}

/// From 0 at `low` to 1 at `high`, smoothly.
fn share(low: f32, high: f32, value: f32) -> f32 {
    smooth(f64::from(low), f64::from(high), f64::from(value)) as f32
}

fn smooth(low: f64, high: f64, value: f64) -> f64 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// Noise of several scales, from about -1 to 1.
fn octaves(x: f64, z: f64, count: u32, seed: u32) -> f64 {
    let (mut sum, mut amplitude, mut scale) = (0.0, 0.5, 1.0);
    for octave in 0..count {
        sum += noise(x * scale, z * scale, seed + octave) * amplitude;
        amplitude *= 0.48;
        scale *= 2.03;
    }
    sum * 1.6
}

/// Noise with sharp ridges, from 0 to about 1.
fn ridges(x: f64, z: f64, count: u32) -> f64 {
    let (mut sum, mut amplitude, mut scale, mut before) = (0.0, 0.6, 1.0, 1.0);
    for octave in 0..count {
        let ridge = 1.0 - noise(x * scale, z * scale, 40 + octave).abs() * 1.7;
        let ridge = ridge * ridge * before;
        sum += ridge * amplitude;
        before = ridge.clamp(0.0, 1.0);
        amplitude *= 0.45;
        scale *= 2.1;
    }
    sum
}

/// Gradient noise (Perlin 2002), from -1 to 1.
fn noise(x: f64, z: f64, seed: u32) -> f64 {
    let (column, row) = (x.floor(), z.floor());
    let (dx, dz) = (x - column, z - row);
    let corner = |right: i64, down: i64| {
        let angle = hash(column as i64 + right, row as i64 + down, seed);
        // Eight directions.
        const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
        const DIRECTIONS: [[f64; 2]; 8] = [
            [1.0, 0.0],
            [DIAGONAL, DIAGONAL],
            [0.0, 1.0],
            [-DIAGONAL, DIAGONAL],
            [-1.0, 0.0],
            [-DIAGONAL, -DIAGONAL],
            [0.0, -1.0],
            [DIAGONAL, -DIAGONAL],
        ];
        let [along_x, along_z] = DIRECTIONS[(angle >> 29) as usize];
        along_x * (dx - right as f64) + along_z * (dz - down as f64)
    };
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let between = |one: f64, other: f64, share: f64| one + (other - one) * share;
    let (u, v) = (fade(dx), fade(dz));
    between(between(corner(0, 0), corner(1, 0), u), between(corner(0, 1), corner(1, 1), u), v) * 1.4
}

/// Mixes the bits of a place and a seed.
fn hash(x: i64, z: i64, seed: u32) -> u32 {
    let mut bits =
        (x as u32).wrapping_mul(0x9e37_79b1) ^ (z as u32).wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
    bits = (bits ^ (bits >> 12)).wrapping_mul(0x297a_2d39);
    bits ^ (bits >> 15)
}
