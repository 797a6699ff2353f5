//! Coloured glass: panes that stand in the nave one behind the other, and a window under an arch.

use std::f32::consts::FRAC_PI_2;

use glam::{Quat, Vec3};

use super::shape::Shape;
use super::{Props, ROWS, Site, bays};
use crate::handle::Handle;
use crate::scene::{Blend, Material, Mesh, SceneError};

/// How much of what is behind it a pane hides.
const OPACITY: f32 = 0.35;

const COLORS: [(&str, Vec3); 5] = [
    ("ruby glass", Vec3::new(0.85, 0.04, 0.06)),
    ("amber glass", Vec3::new(0.95, 0.48, 0.05)),
    ("emerald glass", Vec3::new(0.04, 0.65, 0.18)),
    ("azure glass", Vec3::new(0.05, 0.30, 0.95)),
    ("violet glass", Vec3::new(0.45, 0.08, 0.80)),
];

/// The standing panes: where, turned how far, of which colour. None passes through another, so that an order by their
/// middles is right.
const STANDING: [([f32; 2], f32, usize); 5] = [
    ([2.75, 5.5], 0.25, 0),
    ([3.35, 4.5], -0.20, 1),
    ([2.75, 3.4], 0.10, 3),
    ([-2.7, 4.9], 0.55, 2),
    ([-2.9, 3.6], 0.30, 4),
];

impl Site {
    /// All that is made of glass, and what holds it.
    pub(super) fn glass(&mut self) -> Result<(), SceneError> {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let corners = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
        let pane = Shape::default().quad(corners).add_to(&mut self.scene, "pane")?;
        let mut glasses = Vec::new();
        for (name, color) in COLORS {
            glasses.push(self.scene.add(Material {
                name: name.into(),
                diffuse: color,
                // Light from behind shines through; nothing else here would show that.
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
        let Props { block, bronze, .. } = self.props;
        let size = Vec3::new(1.15, 2.4, 1.0);
        for ([x, z], angle, color) in STANDING {
            let turn = Quat::from_rotation_y(angle);
            let foot = Vec3::new(x, 0.0, z);
            let middle = foot + Vec3::Y * (0.1 + size.y / 2.0);
            self.turned(pane, glasses[color], middle, turn, size)?;
            self.turned(block, bronze, foot + Vec3::Y * 0.05, turn, Vec3::new(size.x + 0.1, 0.1, 0.22))?;
            let lintel = middle + Vec3::Y * (size.y / 2.0 + 0.02);
            self.turned(block, bronze, lintel, turn, Vec3::new(size.x + 0.1, 0.04, 0.05))?;
            for side in [-0.5, 0.5] {
                let post = middle + turn * Vec3::X * (side * (size.x + 0.05));
                self.turned(block, bronze, post, turn, Vec3::new(0.05, size.y, 0.05))?;
            }
        }
        Ok(())
    }

    /// A dozen small panes between bronze bars, under the second arch to the left.
    fn window(&mut self, pane: Handle<Mesh>, glasses: &[Handle<Material>]) -> Result<(), SceneError> {
        let Props { block, bronze, .. } = self.props;
        let [columns, rows] = [3, 4];
        // Of a pane.
        let [width, height] = [0.78, 0.66];
        let [all_width, all_height] = [width * columns as f32, height * rows as f32];
        let low = Vec3::new(-ROWS[0], 2.4, bays().nth(1).unwrap_or_default() - all_width / 2.0);
        let at = |along: f32, up: f32| low + Vec3::new(0.0, up, along);
        let turn = Quat::from_rotation_y(FRAC_PI_2);
        for row in 0..rows {
            for column in 0..columns {
                let place = at(width * (column as f32 + 0.5), height * (row as f32 + 0.5));
                let glass = glasses[(2 * row + 3 * column) % glasses.len()];
                self.turned(pane, glass, place, turn, Vec3::new(width, height, 1.0))?;
            }
        }
        for line in 0..=rows {
            let place = at(all_width / 2.0, height * line as f32);
            self.scaled(block, bronze, place, Vec3::new(0.06, 0.05, all_width + 0.05))?;
        }
        for line in 0..=columns {
            let place = at(width * line as f32, all_height / 2.0);
            self.scaled(block, bronze, place, Vec3::new(0.06, all_height, 0.05))?;
        }
        Ok(())
    }
}
