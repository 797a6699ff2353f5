//! Lights without a visible lamp: the sun, the sky, and spotlights between the columns.

use drawloom::glam::Vec3;
use drawloom::scene::Light;

use super::layout::{BAY, ROWS, bays, columns};
use super::site::Site;

/// The number of bays from the front, on either side, with spotlights.
const LIT_BAYS: usize = 5;

/// The number of bays from the front, on either side, whose spotlights on columns cast shadows.
const BAYS_WITH_SHADOWS: usize = 2;

/// The colours of the spotlights on columns, from the front.
const COLUMN_COLORS: [Vec3; LIT_BAYS] = [
    Vec3::new(1.0, 0.42, 0.12),
    Vec3::new(0.75, 0.14, 0.55),
    Vec3::new(0.10, 0.55, 0.75),
    Vec3::new(1.0, 0.30, 0.10),
    Vec3::new(0.35, 0.20, 0.95),
];

/// The colours of the spotlights on banners, from the front.
const BANNER_COLORS: [Vec3; LIT_BAYS] = [
    Vec3::new(1.0, 0.75, 0.50),
    Vec3::new(0.55, 0.65, 1.0),
    Vec3::new(1.0, 0.80, 0.45),
    Vec3::new(0.70, 1.0, 0.85),
    Vec3::new(1.0, 0.60, 0.55),
];

impl Site {
    /// Adds the setting sun and the sky, and sets ambient light and background.
    pub(super) fn sky(&mut self) {
        self.scene.ambient = Vec3::new(0.026, 0.031, 0.055);
        self.scene.background = Vec3::new(0.055, 0.085, 0.20);
        let sun = Light::Directional {
            direction: Vec3::new(0.62, -0.42, -0.66).normalize(),
            illuminance: Vec3::new(0.60, 0.27, 0.14),
            casts_shadow: true,
        };
        let sky = Light::Directional {
            direction: Vec3::new(-0.5, -0.8, -0.15).normalize(),
            illuminance: Vec3::new(0.07, 0.12, 0.26),
            casts_shadow: false,
        };
        self.scene.lights.extend([sun, sky]);
    }

    /// Adds spotlights from the arches down along the columns, and from the beams onto the banners.
    pub(super) fn spotlights(&mut self) {
        for side in [-1.0, 1.0] {
            for (bay, (column, middle)) in columns().zip(bays()).enumerate().take(LIT_BAYS) {
                // The two rows differ: warm colours on one side face cold ones on the other.
                let color = if side > 0.0 { bay } else { (bay + 2) % LIT_BAYS };
                self.scene.lights.push(Light::Spot {
                    position: Vec3::new(side * (ROWS[0] - 1.0), 5.2, column + 0.35).as_dvec3(),
                    direction: Vec3::new(side * 0.19, -1.0, -0.07).normalize(),
                    intensity: COLUMN_COLORS[color] * 14.0,
                    range: 7.0,
                    inner_angle: 0.12,
                    outer_angle: 0.42,
                    casts_shadow: bay < BAYS_WITH_SHADOWS,
                });
                let banner = Vec3::new(side * (ROWS[0] + BAY / 2.0), 5.9, middle);
                let position = banner + Vec3::new(-side * 0.3, 1.3, 1.5);
                self.scene.lights.push(Light::Spot {
                    position: position.as_dvec3(),
                    direction: (banner - position).normalize(),
                    intensity: BANNER_COLORS[bay] * 7.0,
                    range: 4.5,
                    inner_angle: 0.25,
                    outer_angle: 0.6,
                    casts_shadow: false,
                });
            }
        }
    }
}
