//! Coloured glass: panes one behind the other in the nave, and a window under an arch.

use std::f32::consts::FRAC_PI_2;

use drawloom::glam::{Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Blend, Material, Mesh, SceneError};

use super::layout::{ROWS, bays};
use super::mesh_builder::MeshBuilder;
use super::shared_assets::SharedAssets;
use super::site::Site;

/// The opacity of a pane.
const OPACITY: f32 = 0.35;

const COLORS: [(&str, Vec3); 5] = [
    ("ruby glass", Vec3::new(0.85, 0.04, 0.06)),
    ("amber glass", Vec3::new(0.95, 0.48, 0.05)),
    ("emerald glass", Vec3::new(0.04, 0.65, 0.18)),
    ("azure glass", Vec3::new(0.05, 0.30, 0.95)),
    ("violet glass", Vec3::new(0.45, 0.08, 0.80)),
];

/// The standing panes: x and z, rotation around +Y in radians, index into [`COLORS`]. No two intersect, so sorting them
/// by their centres is correct.
const STANDING: [([f32; 2], f32, usize); 5] = [
    ([2.75, 5.5], 0.25, 0),
    ([3.35, 4.5], -0.20, 1),
    ([2.75, 3.4], 0.10, 3),
    ([-2.7, 4.9], 0.55, 2),
    ([-2.9, 3.6], 0.30, 4),
];

impl Site {
    /// Adds all panes and their frames.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn glass(&mut self) -> Result<(), SceneError> {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let corners = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
        let pane = MeshBuilder::default().quad(corners).add_to(&mut self.scene, "pane")?;
        let mut glasses = Vec::new();
        for (name, color) in COLORS {
            glasses.push(self.scene.add(Material {
                name: name.into(),
                diffuse: color,
                // Stands in for light that shines through from behind.
                emission: color * 0.22,
                opacity: OPACITY,
                blend: Blend::Alpha,
                double_sided: true,
                ..Material::default()
            })?);
        }
        self.standing_panes(pane, &glasses)?;
        self.window(pane, &glasses)
    }

    fn standing_panes(&mut self, pane: Handle<Mesh>, glasses: &[Handle<Material>]) -> Result<(), SceneError> {
        let SharedAssets { block, bronze, .. } = self.assets;
        let size = Vec3::new(1.15, 2.4, 1.0);
        for ([x, z], angle, color) in STANDING {
            let turn = Quat::from_rotation_y(angle);
            let foot = Vec3::new(x, 0.0, z);
            let middle = foot + Vec3::Y * (0.1 + size.y / 2.0);
            self.add(pane, glasses[color], middle, turn, size)?;
            self.add(block, bronze, foot + Vec3::Y * 0.05, turn, Vec3::new(size.x + 0.1, 0.1, 0.22))?;
            let lintel = middle + Vec3::Y * (size.y / 2.0 + 0.02);
            self.add(block, bronze, lintel, turn, Vec3::new(size.x + 0.1, 0.04, 0.05))?;
            for side in [-0.5, 0.5] {
                let post = middle + turn * Vec3::X * (side * (size.x + 0.05));
                self.add(block, bronze, post, turn, Vec3::new(0.05, size.y, 0.05))?;
            }
        }
        Ok(())
    }

    /// Adds a dozen small panes between bronze bars, under the second arch to the left.
    fn window(&mut self, pane: Handle<Mesh>, glasses: &[Handle<Material>]) -> Result<(), SceneError> {
        let SharedAssets { block, bronze, .. } = self.assets;
        let [columns, rows] = [3, 4];
        // The size of a pane.
        let [width, height] = [0.78, 0.66];
        let [all_width, all_height] = [width * columns as f32, height * rows as f32];
        let low = Vec3::new(-ROWS[0], 2.4, bays().nth(1).unwrap_or_default() - all_width / 2.0);
        let at = |along: f32, up: f32| low + Vec3::new(0.0, up, along);
        let turn = Quat::from_rotation_y(FRAC_PI_2);
        for row in 0..rows {
            for column in 0..columns {
                let position = at(width * (column as f32 + 0.5), height * (row as f32 + 0.5));
                let glass = glasses[(2 * row + 3 * column) % glasses.len()];
                self.add(pane, glass, position, turn, Vec3::new(width, height, 1.0))?;
            }
        }
        for line in 0..=rows {
            let position = at(all_width / 2.0, height * line as f32);
            self.add_upright(block, bronze, position, Vec3::new(0.06, 0.05, all_width + 0.05))?;
        }
        for line in 0..=columns {
            let position = at(width * line as f32, all_height / 2.0);
            self.add_upright(block, bronze, position, Vec3::new(0.06, all_height, 0.05))?;
        }
        Ok(())
    }
}
