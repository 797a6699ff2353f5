//! Fires in urns: flames and sparks add to the light from behind them, and smoke subtracts from it.

use std::f32::consts::{FRAC_PI_2, TAU};

use drawloom::glam::{Quat, Vec2, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Blend, Light, Material, Mesh, SceneError};

use super::layout::{PODIUM, ROWS, bays};
use super::mesh_builder::{MeshBuilder, Revolution};
use super::quasirandom::{golden_ratio, r3};
use super::site::Site;

/// The number of flames of one fire.
const FLAMES: usize = 9;
/// The number of sparks of one fire.
const SPARKS: usize = 84;
/// The number of puffs of smoke.
const PUFFS: usize = 24;

/// The meshes and materials of fires. The materials emit and reflect nothing, and they are opaque so that their full
/// emission is blended.
struct FireAssets {
    flame: Handle<Mesh>,
    spark: Handle<Mesh>,
    puff: Handle<Mesh>,
    flames: [Handle<Material>; 2],
    sparks: [Handle<Material>; 2],
    smoke: Handle<Material>,
}

impl Site {
    /// Fires in three urns, and a censer on the podium.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn fires(&mut self) -> Result<(), SceneError> {
        let assets = self.fire_assets()?;
        let bay = bays().nth(1).unwrap_or_default();
        let urns = [
            Vec3::new(-3.3, PODIUM + 0.8, 0.45),
            Vec3::new(3.3, PODIUM + 0.8, 0.45),
            Vec3::new(ROWS[0], 0.6 + 1.05, bay),
        ];
        for (number, mouth) in urns.into_iter().enumerate() {
            self.flame(&assets, mouth)?;
            self.sparks(&assets, mouth, number * SPARKS)?;
            self.scene.lights.push(Light::Point {
                position: (mouth + Vec3::Y * 0.45).as_dvec3(),
                intensity: Vec3::new(2.6, 1.05, 0.28),
                range: 5.0,
                casts_shadow: false,
            });
        }
        // In front of the box's back wall, which is bright enough that subtraction is visible.
        let censer = Vec3::new(0.95, PODIUM - 0.004, 0.35);
        self.add_upright(self.assets.urn, self.assets.bronze, censer, Vec3::splat(0.5))?;
        self.smoke(&assets, censer + Vec3::Y * 0.5)
    }

    /// Quads that stand around one axis: more of them overlap in the middle, which is brighter.
    fn flame(&mut self, assets: &FireAssets, mouth: Vec3) -> Result<(), SceneError> {
        for number in 0..FLAMES {
            let share = golden_ratio(number);
            let turn = Quat::from_rotation_y(TAU * share) * Quat::from_rotation_z(0.35 * (share - 0.5));
            let position = mouth + turn * Vec3::new(0.10 * (share - 0.5), -0.08, 0.0);
            let size = Vec3::new(0.30 + 0.25 * share, 0.95 - 0.06 * number as f32, 1.0);
            self.add(assets.flame, assets.flames[number % 2], position, turn, size)?;
        }
        Ok(())
    }

    /// Adds sparks, which rise, drift in the wind, and cool.
    fn sparks(&mut self, assets: &FireAssets, mouth: Vec3, first: usize) -> Result<(), SceneError> {
        for number in first..first + SPARKS {
            let [share, size, around] = r3(number);
            let height = 0.3 + 3.0 * share * share;
            let reach = (0.10 + 0.16 * height) * (0.3 + 0.7 * size);
            let (sine, cosine) = (TAU * around).sin_cos();
            let wind = Vec3::new(-0.05, 0.0, 0.03) * height * height;
            let position = mouth + Vec3::new(reach * cosine, height, reach * sine) + wind;
            let material = assets.sparks[usize::from(share > 0.55)];
            let turn = Quat::from_rotation_y(TAU * size);
            self.add(assets.spark, material, position, turn, Vec3::splat(0.011 + 0.013 * size))?;
        }
        Ok(())
    }

    /// Adds flat clouds one above the other, so faint that their edges blur.
    fn smoke(&mut self, assets: &FireAssets, mouth: Vec3) -> Result<(), SceneError> {
        for number in 0..PUFFS {
            let share = number as f32 / PUFFS as f32;
            let sway = golden_ratio(number) - 0.5;
            let position = mouth + Vec3::new(0.35 * share * share + 0.4 * sway * share, 2.8 * share, 0.15 * sway);
            let size = 0.10 + 0.40 * share + 0.1 * sway * share;
            // Upright, each with a rotation of its own.
            let turn = Quat::from_rotation_x(FRAC_PI_2) * Quat::from_rotation_y(TAU * sway);
            self.add(assets.puff, assets.smoke, position, turn, Vec3::new(size, 1.0, size))?;
        }
        Ok(())
    }

    fn fire_assets(&mut self) -> Result<FireAssets, SceneError> {
        let scene = &mut self.scene;
        let mut material = |name: &str, blend: Blend, emission: [f32; 3]| {
            scene.add(Material {
                name: name.into(),
                diffuse: Vec3::ZERO,
                emission: emission.into(),
                blend,
                double_sided: true,
                ..Material::default()
            })
        };
        let flames = [
            material("flame", Blend::Additive, [0.40, 0.11, 0.015])?,
            material("inner flame", Blend::Additive, [0.45, 0.22, 0.05])?,
        ];
        let sparks = [
            material("spark", Blend::Additive, [2.4, 0.95, 0.22])?,
            material("ember", Blend::Additive, [1.3, 0.26, 0.04])?,
        ];
        let smoke = material("smoke", Blend::Subtractive, [0.013, 0.011, 0.008])?;
        Ok(FireAssets {
            flame: kite().add_to(scene, "flame")?,
            spark: octahedron().add_to(scene, "spark")?,
            puff: cloud().add_to(scene, "puff")?,
            flames,
            sparks,
            smoke,
        })
    }
}

/// A quad of height 1 on its tip, widest below its middle. It faces +Z.
fn kite() -> MeshBuilder {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    MeshBuilder::default().quad([corner(0.0, 0.0), corner(0.5, 0.3), corner(0.0, 1.0), corner(-0.5, 0.3)])
}

/// An octahedron of radius 1.
fn octahedron() -> MeshBuilder {
    let profile = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]].map(Vec2::from);
    MeshBuilder::default().revolved(&profile, &Revolution { segments: 4, grooves: None, smooth: false })
}

/// A flat cloud of radius 1, which faces +Y.
fn cloud() -> MeshBuilder {
    let profile = [[1.0, 0.0], [0.0, 0.0]].map(Vec2::from);
    MeshBuilder::default().revolved(&profile, &Revolution { segments: 25, grooves: Some((5, 0.15)), smooth: false })
}
