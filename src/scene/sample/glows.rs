//! Small things that glow, each with a point light of its own: lanterns, candles and glow-worms.

use glam::Vec3;

use super::lamp::{CANDLESTICK, candlesticks};
use super::{PODIUM, Props, ROWS, Site, bays, golden_share};
use crate::handle::Handle;
use crate::scene::{Light, Material, SceneError};

/// What colours lanterns have.
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
    /// Lanterns under the arches, candles on the steps and the candlesticks, and glow-worms over the lawn.
    pub(super) fn glows(&mut self) -> Result<(), SceneError> {
        self.lanterns()?;
        self.candles()?;
        self.glow_worms()
    }

    fn lanterns(&mut self) -> Result<(), SceneError> {
        let Props { block, wood, .. } = self.props;
        let mut glows = Vec::new();
        for (name, color) in LANTERNS {
            glows.push((self.glow(name, color * 0.9)?, color));
        }
        for (row, side) in [-1.0, 1.0].into_iter().enumerate() {
            for (bay, z) in bays().enumerate() {
                let place = Vec3::new(side * ROWS[0], 5.75, z);
                let (glow, color) = glows[(2 * bay + 3 * row) % glows.len()];
                self.scaled(block, wood, place.with_y(6.2), Vec3::new(0.03, 0.7, 0.03))?;
                self.glowing(glow, place, Vec3::splat(0.16), color * 2.4, 4.2)?;
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
        let flame = self.glow("candle flame", CANDLE * 5.0)?;
        // A tread, its depth, and how far to either side candles stand on it; the lowest first.
        let treads = [(0.196, 1.32, 3.9, 6), (0.396, 0.97, 3.5, 5), (PODIUM - 0.004, 0.42, 2.6, 4)];
        let on_steps = treads.into_iter().enumerate().flat_map(|(tread, (height, z, reach, count))| {
            (0..count).map(move |candle| {
                let shift = golden_share(candle + 7 * tread) - 0.5;
                let share = (candle as f32 + 0.5 + 0.6 * shift) / count as f32;
                Vec3::new((2.0 * share - 1.0) * reach, height, z + 0.12 * shift)
            })
        });
        let places = on_steps.chain(candlesticks().map(|foot| foot.with_y(CANDLESTICK)));
        for (candle, place) in places.enumerate() {
            let height = 0.14 + 0.14 * golden_share(candle);
            let shaft = self.props.shaft;
            self.scaled(shaft, wax, place, Vec3::new(0.11, height, 0.11))?;
            let wick = place + Vec3::Y * (height + 0.06);
            self.glowing(flame, wick, Vec3::new(0.024, 0.06, 0.024), CANDLE * 0.30, 2.4)?;
        }
        Ok(())
    }

    fn glow_worms(&mut self) -> Result<(), SceneError> {
        let glow = self.glow("glow-worm", GLOW_WORM * 2.5)?;
        for worm in 0..14_usize {
            let side = if worm % 2 == 0 { -1.0 } else { 1.0 };
            let [across, up, along] = [1, 3, 5].map(|stride| golden_share(stride * worm + stride));
            let place = Vec3::new(side * (12.0 + 2.2 * across), 0.6 * up, 3.0 - 2.0 * worm as f32 - along);
            self.glowing(glow, place, Vec3::splat(0.05), GLOW_WORM * 1.4, 3.6)?;
        }
        Ok(())
    }

    fn glow(&mut self, name: &str, emission: Vec3) -> Result<Handle<Material>, SceneError> {
        self.scene.add(Material { name: name.into(), diffuse: Vec3::ZERO, emission, ..Material::default() })
    }

    /// A ball with a point light in its middle.
    fn glowing(
        &mut self,
        material: Handle<Material>,
        place: Vec3,
        size: Vec3,
        intensity: Vec3,
        range: f32,
    ) -> Result<(), SceneError> {
        self.scaled(self.props.ball, material, place, size)?;
        self.scene.lights.push(Light::Point { position: place.as_dvec3(), intensity, range });
        Ok(())
    }
}
