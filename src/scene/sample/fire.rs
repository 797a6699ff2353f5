//! Fires in urns: flames and sparks that add light to what is behind them, and smoke that takes some away.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec2, Vec3};

use super::shape::{Shape, Turning};
use super::{PODIUM, ROWS, Site, bays, golden_share};
use crate::handle::Handle;
use crate::scene::{Blend, Light, Material, Mesh, SceneError};

/// Of one fire.
const FLAMES: usize = 9;
/// Of one fire.
const SPARKS: usize = 84;
/// Of the smoke.
const PUFFS: usize = 24;

/// Steps that spread points evenly in a cube, as those of the golden ratio do on a line (Roberts 2018, "The Unreasonable
/// Effectiveness of Quasirandom Sequences").
const SPREAD: [f32; 3] = [0.819_172_5, 0.671_043_6, 0.549_700_5];

/// What fires are made of. Their light does not depend on what shines on them, so they reflect nothing; and all of it
/// counts, so they are wholly opaque.
struct Kindling {
    flame: Handle<Mesh>,
    spark: Handle<Mesh>,
    puff: Handle<Mesh>,
    flames: [Handle<Material>; 2],
    sparks: [Handle<Material>; 2],
    smoke: Handle<Material>,
}

impl Site {
    /// Fires in three urns, and a censer on the podium.
    pub(super) fn fires(&mut self) -> Result<(), SceneError> {
        let kindling = self.kindling()?;
        let bay = bays().nth(1).unwrap_or_default();
        let urns = [
            Vec3::new(-3.3, PODIUM + 0.8, 0.45),
            Vec3::new(3.3, PODIUM + 0.8, 0.45),
            Vec3::new(ROWS[0], 0.6 + 1.05, bay),
        ];
        for (number, mouth) in urns.into_iter().enumerate() {
            self.flame(&kindling, mouth)?;
            self.sparks(&kindling, mouth, number * SPARKS)?;
            self.scene.lights.push(Light::Point {
                position: (mouth + Vec3::Y * 0.45).as_dvec3(),
                intensity: Vec3::new(2.6, 1.05, 0.28),
                range: 5.0,
            });
        }
        // In front of the box's back wall, which is bright enough to take light from.
        let censer = Vec3::new(0.95, PODIUM - 0.004, 0.35);
        self.scaled(self.props.urn, self.props.bronze, censer, Vec3::splat(0.5))?;
        self.smoke(&kindling, censer + Vec3::Y * 0.5)
    }

    /// Quads that stand around one axis: where more of them overlap it is brighter.
    fn flame(&mut self, kindling: &Kindling, mouth: Vec3) -> Result<(), SceneError> {
        for number in 0..FLAMES {
            let share = golden_share(number);
            let turn = Quat::from_rotation_y(TAU * share) * Quat::from_rotation_z(0.35 * (share - 0.5));
            let place = mouth + turn * Vec3::new(0.10 * (share - 0.5), -0.08, 0.0);
            let size = Vec3::new(0.30 + 0.25 * share, 0.95 - 0.06 * number as f32, 1.0);
            self.turned(kindling.flame, kindling.flames[number % 2], place, turn, size)?;
        }
        Ok(())
    }

    /// They rise, are blown aside, and cool.
    fn sparks(&mut self, kindling: &Kindling, mouth: Vec3, first: usize) -> Result<(), SceneError> {
        for number in first..first + SPARKS {
            let [share, size, around] = SPREAD.map(|step| (step * number as f32).fract());
            let height = 0.3 + 3.0 * share * share;
            let reach = (0.10 + 0.16 * height) * (0.3 + 0.7 * size);
            let (sine, cosine) = (TAU * around).sin_cos();
            let wind = Vec3::new(-0.05, 0.0, 0.03) * height * height;
            let place = mouth + Vec3::new(reach * cosine, height, reach * sine) + wind;
            let material = kindling.sparks[usize::from(share > 0.55)];
            let turn = Quat::from_rotation_y(TAU * size);
            self.turned(kindling.spark, material, place, turn, Vec3::splat(0.011 + 0.013 * size))?;
        }
        Ok(())
    }

    /// Flat clouds one above the other, so thin that their edges melt into each other.
    fn smoke(&mut self, kindling: &Kindling, mouth: Vec3) -> Result<(), SceneError> {
        for number in 0..PUFFS {
            let share = number as f32 / PUFFS as f32;
            let sway = golden_share(number) - 0.5;
            let place = mouth + Vec3::new(0.35 * share * share + 0.4 * sway * share, 2.8 * share, 0.15 * sway);
            let size = 0.10 + 0.40 * share + 0.1 * sway * share;
            // Upright, and each turned another way.
            let turn = Quat::from_rotation_x(FRAC_PI_2) * Quat::from_rotation_y(TAU * sway);
            self.turned(kindling.puff, kindling.smoke, place, turn, Vec3::new(size, 1.0, size))?;
        }
        Ok(())
    }

    fn kindling(&mut self) -> Result<Kindling, SceneError> {
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
        Ok(Kindling {
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
fn kite() -> Shape {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    Shape::default().quad([corner(0.0, 0.0), corner(0.5, 0.3), corner(0.0, 1.0), corner(-0.5, 0.3)])
}

/// A ball of radius 1 with four corners around.
fn octahedron() -> Shape {
    let profile = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]].map(Vec2::from);
    Shape::default().turned(&profile, &Turning { steps: 4, grooves: None, smooth: false })
}

/// A flat cloud of radius 1, which faces +Y.
fn cloud() -> Shape {
    let profile = [[1.0, 0.0], [0.0, 0.0]].map(Vec2::from);
    Shape::default().turned(&profile, &Turning { steps: 25, grooves: Some((5, 0.15)), smooth: false })
}
