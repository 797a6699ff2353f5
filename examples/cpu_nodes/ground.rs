//! The shape of the land.

use drawloom::glam::Vec3;

/// Each wave: its wave numbers along x and z in radians a metre, and its height in metres.
const WAVES: [([f32; 2], f32); 4] =
    [([0.11, 0.05], 1.6), ([-0.07, 0.17], 1.1), ([0.31, 0.27], 0.35), ([0.53, -0.61], 0.12)];

/// Nothing is higher, or lower than this below zero, in metres.
pub const HIGHEST: f32 = 3.2;

/// The height at a place, in metres.
pub fn height(x: f32, z: f32) -> f32 {
    WAVES.iter().map(|([along_x, along_z], height)| (along_x * x + along_z * z).sin() * height).sum()
}

/// The normal at a place; of unit length.
pub fn normal(x: f32, z: f32) -> Vec3 {
    let (mut slope_x, mut slope_z) = (0.0, 0.0);
    for ([along_x, along_z], height) in WAVES {
        let slope = (along_x * x + along_z * z).cos() * height;
        slope_x += along_x * slope;
        slope_z += along_z * slope;
    }
    Vec3::new(-slope_x, 1.0, -slope_z).normalize()
}

/// The distance at which a ray meets the land, in metres; `None` if it meets none within `reach`.
pub fn cast(origin: Vec3, direction: Vec3, reach: f32) -> Option<f32> {
    let above = |distance: f32| {
        let point = origin + direction * distance;
        point.y - height(point.x, point.z)
    };
    let (mut before, mut distance) = (0.0, 0.0_f32);
    while distance < reach {
        let gap = above(distance);
        if gap < 0.0 {
            // Between the last two steps, halved until it is found to a few centimetres.
            let (mut near, mut far) = (before, distance);
            for _ in 0..6 {
                let middle = (near + far) / 2.0;
                if above(middle) < 0.0 { far = middle } else { near = middle }
            }
            return Some(far);
        }
        let point = origin + direction * distance;
        if point.y > HIGHEST && direction.y >= 0.0 {
            return None;
        }
        before = distance;
        distance += (gap * 0.5).max(0.1);
    }
    None
}
