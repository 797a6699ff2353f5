//! Small emissive objects, each with a point light of its own: lanterns, candles and glow-worms.

use drawloom::glam::Vec3;
use drawloom::handle::Handle;
use drawloom::scene::{Light, Material, SceneError};

use super::lamp::{CANDLESTICK, candlesticks};
use super::layout::{PODIUM, ROWS, bays};
use super::quasirandom::golden_ratio;
use super::shared_assets::SharedAssets;
use super::site::Site;

/// Material names and colours of lanterns.
const LANTERNS: [(&str, Vec3); 5] = [
    ("amber lantern", Vec3::new(1.0, 0.46, 0.10)),
    ("rose lantern", Vec3::new(1.0, 0.12, 0.26)),
    ("jade lantern", Vec3::new(0.10, 0.85, 0.36)),
    ("azure lantern", Vec3::new(0.08, 0.42, 1.0)),
    ("violet lantern", Vec3::new(0.52, 0.16, 1.0)),
];

const CANDLE: Vec3 = Vec3::new(1.0, 0.52, 0.18);
const GLOW_WORM: Vec3 = Vec3::new(0.55, 1.0, 0.12);

impl Site {
    /// Adds lanterns under the arches, candles on the steps and the candlesticks, and glow-worms over the lawn.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn glows(&mut self) -> Result<(), SceneError> {
        self.lanterns()?;
        self.candles()?;
        self.glow_worms()
    }

    fn lanterns(&mut self) -> Result<(), SceneError> {
        let SharedAssets { block, wood, .. } = self.assets;
        let mut glows = Vec::new();
        for (name, color) in LANTERNS {
            glows.push((self.add_glow_material(name, color * 0.9)?, color));
        }
        for (row, side) in [-1.0, 1.0].into_iter().enumerate() {
            for (bay, z) in bays().enumerate() {
                let position = Vec3::new(side * ROWS[0], 5.75, z);
                let (glow, color) = glows[(2 * bay + 3 * row) % glows.len()];
                self.add_upright(block, wood, position.with_y(6.2), Vec3::new(0.03, 0.7, 0.03))?;
                self.add_glowing_ball(glow, position, Vec3::splat(0.16), color * 2.4, 4.2)?;
            }
        }
        Ok(())
    }

    fn candles(&mut self) -> Result<(), SceneError> {
        let wax = self.scene.add(Material {
            name: "wax".into(),
            diffuse: Vec3::new(0.80, 0.72, 0.56),
            emission: Vec3::new(0.10, 0.05, 0.02),
            ..Material::default()
        })?;
        let flame = self.add_glow_material("candle flame", CANDLE * 5.0)?;
        // For each step, the lowest first: height, z, reach of the candles to either side, and number of candles.
        let treads = [(0.196, 1.32, 3.9, 6), (0.396, 0.97, 3.5, 5), (PODIUM - 0.004, 0.42, 2.6, 4)];
        let on_steps = treads.into_iter().enumerate().flat_map(|(tread, (height, z, reach, count))| {
            (0..count).map(move |candle| {
                let shift = golden_ratio(candle + 7 * tread) - 0.5;
                let share = (candle as f32 + 0.5 + 0.6 * shift) / count as f32;
                Vec3::new((2.0 * share - 1.0) * reach, height, z + 0.12 * shift)
            })
        });
        let positions = on_steps.chain(candlesticks().map(|foot| foot.with_y(CANDLESTICK)));
        for (candle, position) in positions.enumerate() {
            let height = 0.14 + 0.14 * golden_ratio(candle);
            let shaft = self.assets.shaft;
            self.add_upright(shaft, wax, position, Vec3::new(0.11, height, 0.11))?;
            let wick = position + Vec3::Y * (height + 0.06);
            self.add_glowing_ball(flame, wick, Vec3::new(0.024, 0.06, 0.024), CANDLE * 0.30, 2.4)?;
        }
        Ok(())
    }

    fn glow_worms(&mut self) -> Result<(), SceneError> {
        let glow = self.add_glow_material("glow-worm", GLOW_WORM * 2.5)?;
        for worm in 0..14_usize {
            let side = if worm % 2 == 0 { -1.0 } else { 1.0 };
            let [across, up, along] = [1, 3, 5].map(|stride| golden_ratio(stride * worm + stride));
            let position = Vec3::new(side * (12.0 + 2.2 * across), 0.6 * up, 3.0 - 2.0 * worm as f32 - along);
            self.add_glowing_ball(glow, position, Vec3::splat(0.05), GLOW_WORM * 1.4, 3.6)?;
        }
        Ok(())
    }

    fn add_glow_material(&mut self, name: &str, emission: Vec3) -> Result<Handle<Material>, SceneError> {
        self.scene.add(Material { name: name.into(), diffuse: Vec3::ZERO, emission, ..Material::default() })
    }

    /// Adds a ball with a point light in its centre.
    fn add_glowing_ball(
        &mut self,
        material: Handle<Material>,
        position: Vec3,
        size: Vec3,
        intensity: Vec3,
        range: f32,
    ) -> Result<(), SceneError> {
        self.add_upright(self.assets.ball, material, position, size)?;
        self.scene.lights.push(Light::Point { position: position.as_dvec3(), intensity, range, casts_shadow: false });
        Ok(())
    }
}
