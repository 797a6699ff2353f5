//! Light that comes from no lamp one can see: the sky's, and spotlights between the columns.

use glam::Vec3;

use super::{BAY, ROWS, Site, bays, columns};
use crate::scene::Light;

/// Bays from the front, on either side, that have spotlights.
const LIT_BAYS: usize = 5;

/// Bays from the front, on either side, whose columns throw shadows in their spotlight.
const BAYS_WITH_SHADOWS: usize = 2;

/// What the spotlights on the columns throw, from the front.
const COLUMN_COLORS: [Vec3; LIT_BAYS] = [
    Vec3::new(1.0, 0.42, 0.12),
    Vec3::new(0.75, 0.14, 0.55),
    Vec3::new(0.10, 0.55, 0.75),
    Vec3::new(1.0, 0.30, 0.10),
    Vec3::new(0.35, 0.20, 0.95),
];

/// What the spotlights on the banners throw, from the front.
const BANNER_COLORS: [Vec3; LIT_BAYS] = [
    Vec3::new(1.0, 0.75, 0.50),
    Vec3::new(0.55, 0.65, 1.0),
    Vec3::new(1.0, 0.80, 0.45),
    Vec3::new(0.70, 1.0, 0.85),
    Vec3::new(1.0, 0.60, 0.55),
];

impl Site {
    /// The sun's last light, the sky's, and what of it is everywhere.
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

    /// From the arches down along the columns, and from the beams onto the banners.
    pub(super) fn spotlights(&mut self) {
        for side in [-1.0, 1.0] {
            for (bay, (column, middle)) in columns().zip(bays()).enumerate().take(LIT_BAYS) {
                // The two rows differ: what is lit warmly on one side is lit coldly on the other.
                let turned = if side > 0.0 { bay } else { (bay + 2) % LIT_BAYS };
                self.scene.lights.push(Light::Spot {
                    position: Vec3::new(side * (ROWS[0] - 1.0), 5.2, column + 0.35).as_dvec3(),
                    direction: Vec3::new(side * 0.19, -1.0, -0.07).normalize(),
                    intensity: COLUMN_COLORS[turned] * 14.0,
                    range: 7.0,
                    inner_angle: 0.12,
                    outer_angle: 0.42,
                    casts_shadow: bay < BAYS_WITH_SHADOWS,
                });
                let banner = Vec3::new(side * (ROWS[0] + BAY / 2.0), 5.9, middle);
                let place = banner + Vec3::new(-side * 0.3, 1.3, 1.5);
                self.scene.lights.push(Light::Spot {
                    position: place.as_dvec3(),
                    direction: (banner - place).normalize(),
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
