//! The lamp over the nave, and the candlesticks around it that cast shadows.

use drawloom::glam::{Vec2, Vec3};
use drawloom::scene::{Light, Material, SceneError};

use super::layout::ROWS;
use super::mesh_builder::{MeshBuilder, Revolution};
use super::shared_assets::SharedAssets;
use super::site::Site;

/// The height of a candlestick.
pub(super) const CANDLESTICK: f32 = 1.4;

/// The centre of the lamp's underside.
const LAMP: Vec3 = Vec3::new(-0.2, 3.75, 4.1);

/// The intensity of the lamp along its axis.
const INTENSITY: Vec3 = Vec3::new(64.0, 48.0, 30.0);

impl Site {
    /// Adds a lampshade that hangs from a beam across the nave, lit from below, and candlesticks on the floor around
    /// it.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn lamp(&mut self) -> Result<(), SceneError> {
        let shade = shade().add_to(&mut self.scene, "lamp shade")?;
        let candlestick = candlestick().add_to(&mut self.scene, "candlestick")?;
        let glow = Material { name: "lamp".into(), emission: Vec3::new(7.0, 5.3, 3.3), ..Material::default() };
        let glow = self.scene.add(glow)?;
        let SharedAssets { block, ball, bronze, wood, .. } = self.assets;
        let beam = 7.45;
        let top = LAMP.y + 0.42;
        self.add_upright(block, wood, LAMP.with_y(beam).with_x(0.0), Vec3::new(2.0 * ROWS[0] + 1.5, 0.26, 0.2))?;
        self.add_upright(block, wood, LAMP.with_y((top + beam) / 2.0), Vec3::new(0.03, beam - top, 0.03))?;
        self.add_upright(shade, bronze, LAMP, Vec3::ONE)?;
        self.add_upright(ball, glow, LAMP, Vec3::new(0.36, 0.05, 0.36))?;
        // Below the whole lamp, so that the lamp casts no shadow of its own.
        self.scene.lights.push(Light::Hemispherical {
            position: (LAMP - Vec3::Y * 0.1).as_dvec3(),
            direction: Vec3::NEG_Y,
            intensity: INTENSITY,
            range: 14.0,
            casts_shadow: true,
        });
        for position in candlesticks() {
            self.add_upright(candlestick, bronze, position, Vec3::ONE)?;
        }
        Ok(())
    }
}

/// The positions of candlesticks: on either side of the nave, with the lamp in the middle.
pub(super) fn candlesticks() -> impl Iterator<Item = Vec3> {
    [-1.75, 1.75].into_iter().flat_map(|z| [-1.9, 0.1, 2.0].map(|x| (LAMP + Vec3::new(x, 0.0, z)).with_y(0.0)))
}

/// A lampshade that is closed at its wide lower end, so that its inside is not visible.
fn shade() -> MeshBuilder {
    let profile = [[0.0, 0.0], [0.44, 0.0], [0.44, 0.04], [0.30, 0.16], [0.10, 0.32], [0.05, 0.42], [0.0, 0.42]];
    MeshBuilder::default().revolved(&profile.map(Vec2::from), &Revolution::EDGES)
}

fn candlestick() -> MeshBuilder {
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
    MeshBuilder::default().revolved(&profile.map(Vec2::from), &Revolution::EDGES)
}
