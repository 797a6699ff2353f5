//! The lamp over the nave, and the candlesticks that stand around it to throw shadows.

use glam::{Vec2, Vec3};

use super::shape::{Shape, Turning};
use super::{Props, ROWS, Site};
use crate::scene::{Light, Material, SceneError};

/// The height of a candlestick.
pub(super) const CANDLESTICK: f32 = 1.4;

/// The middle of the lamp's underside.
const LAMP: Vec3 = Vec3::new(-0.2, 3.75, 4.1);

/// What it gives off along its axis at 1 m.
const INTENSITY: Vec3 = Vec3::new(64.0, 48.0, 30.0);

impl Site {
    /// A shade that hangs from a beam across the nave, lit below, and candlesticks on the floor around it.
    pub(super) fn lamp(&mut self) -> Result<(), SceneError> {
        let shade = shade().add_to(&mut self.scene, "lamp shade")?;
        let candlestick = candlestick().add_to(&mut self.scene, "candlestick")?;
        let glow = Material { name: "lamp".into(), emission: Vec3::new(7.0, 5.3, 3.3), ..Material::default() };
        let glow = self.scene.add(glow)?;
        let Props { block, ball, bronze, wood, .. } = self.props;
        let beam = 7.45;
        let top = LAMP.y + 0.42;
        self.scaled(block, wood, LAMP.with_y(beam).with_x(0.0), Vec3::new(2.0 * ROWS[0] + 1.5, 0.26, 0.2))?;
        self.scaled(block, wood, LAMP.with_y((top + beam) / 2.0), Vec3::new(0.03, beam - top, 0.03))?;
        self.scaled(shade, bronze, LAMP, Vec3::ONE)?;
        self.scaled(ball, glow, LAMP, Vec3::new(0.36, 0.05, 0.36))?;
        // Below all of the lamp, so that none of it is in its own light.
        self.scene.lights.push(Light::Hemispherical {
            position: (LAMP - Vec3::Y * 0.1).as_dvec3(),
            direction: Vec3::NEG_Y,
            intensity: INTENSITY,
            range: 14.0,
            casts_shadow: true,
        });
        for place in candlesticks() {
            self.scaled(candlestick, bronze, place, Vec3::ONE)?;
        }
        Ok(())
    }
}

/// Where candlesticks stand: on either side of the nave, the lamp in their middle.
pub(super) fn candlesticks() -> impl Iterator<Item = Vec3> {
    [-1.75, 1.75].into_iter().flat_map(|z| [-1.9, 0.1, 2.0].map(|x| (LAMP + Vec3::new(x, 0.0, z)).with_y(0.0)))
}

/// Wide below, where it is closed, so that nobody sees its inside.
fn shade() -> Shape {
    let profile = [[0.0, 0.0], [0.44, 0.0], [0.44, 0.04], [0.30, 0.16], [0.10, 0.32], [0.05, 0.42], [0.0, 0.42]];
    Shape::default().turned(&profile.map(Vec2::from), &Turning::EDGES)
}

fn candlestick() -> Shape {
    let profile = [
        [0.24, 0.00],
        [0.23, 0.05],
        [0.10, 0.10],
        [0.05, 0.20],
        [0.06, 0.55],
        [0.11, 0.62],
        [0.06, 0.70],
        [0.05, 1.22],
        [0.09, 1.30],
        [0.19, 1.36],
        [0.19, CANDLESTICK],
        [0.0, CANDLESTICK],
    ];
    Shape::default().turned(&profile.map(Vec2::from), &Turning::EDGES)
}
