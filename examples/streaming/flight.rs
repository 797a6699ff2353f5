//! The path of the camera.

use drawloom::glam::DVec3;
use drawloom::scene::Camera;

use crate::land::{WATER, height};

/// A flight along a winding path, over the land and not through it.
pub struct Flight {
    size: [u32; 2],
}

impl Flight {
    /// In metres a second.
    const SPEED: f64 = 110.0;

    /// With pictures of this size.
    pub fn new(size: [u32; 2]) -> Self {
        Self { size }
    }

    /// The camera at a time in seconds. It looks ahead, and a little down.
    pub fn camera(&self, time: f64) -> Camera {
        let (position, ahead) = (Self::position(time), Self::position(time + 1.6));
        let target = DVec3::new(ahead.x, position.y + (ahead.y - position.y) * 0.6 - 26.0, ahead.z);
        Camera { size: self.size, near: 1.0, ..Camera::looking_at("main", position, target) }
    }

    /// Where the camera will be: what tiles are near it decides which are needed soon.
    pub fn position(time: f64) -> DVec3 {
        let [x, z] = Self::place(time);
        // As high above what is around and ahead, so that it rises before a mountain.
        let around = (-3..=9).map(|step: i32| {
            let [x, z] = Self::place(time + f64::from(step) * 0.25);
            let above = f64::from(height(x, z).max(WATER));
            // What is farther counts less.
            let distance = f64::from((step - 2).abs());
            (above, 1.0 / (1.0 + distance * distance * 0.06))
        });
        let (sum, weights) =
            around.fold((0.0, 0.0), |(sum, weights), (above, weight)| (sum + above * above * weight, weights + weight));
        DVec3::new(x, (sum / weights).sqrt() + 34.0, z)
    }

    fn place(time: f64) -> [f64; 2] {
        let along = time * Self::SPEED;
        [(along / 610.0).sin() * 240.0 + (along / 1730.0).sin() * 500.0, -along]
    }
}
