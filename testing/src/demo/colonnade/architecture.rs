//! What stands on the site: columns, arches, beams, the shrine around the box, and cypresses.

use std::f32::consts::FRAC_PI_2;

use drawloom::glam::{Quat, Vec3};
use drawloom::scene::SceneError;

use super::layout::{BAY, COLUMNS, LAWN, PODIUM, ROWS, bays, columns, rows};
use super::quasirandom::golden_ratio;
use super::shared_assets::SharedAssets;
use super::site::Site;

impl Site {
    /// Adds the lawn and the floor.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn ground(&mut self) -> Result<(), SceneError> {
        let SharedAssets { square, slab, lawn, checker, .. } = self.assets;
        // In squares, so that edges near a lamp are short enough for its paraboloid shadow map. Subdivision for that
        // map multiplies every triangle near a lamp, so each square is one face.
        for (x, z) in (-5..5).flat_map(|x| (-5..5).map(move |z| (x as f32 + 0.5, z as f32 + 0.5))) {
            let position = Vec3::new(x * LAWN, -0.35, z * LAWN - 20.0);
            self.add_upright(square, lawn, position, Vec3::new(LAWN, 1.0, LAWN))?;
        }
        for x in -3..3_i32 {
            for z in -9..4 {
                let position = Vec3::new((x as f32 + 0.5) * BAY, 0.0, (z as f32 + 0.5) * BAY);
                // Quarter turns keep the veins of the repeated texture from lining up.
                let turn = Quat::from_rotation_y((x + 2 * z).rem_euclid(4) as f32 * FRAC_PI_2);
                self.add(slab, checker, position, turn, Vec3::new(BAY, 1.0, BAY))?;
            }
        }
        Ok(())
    }

    /// Adds four rows of columns, each with arches and a cornice.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn rows(&mut self) -> Result<(), SceneError> {
        let SharedAssets { base, shaft, capital, arch, block, stones, .. } = self.assets;
        for (row, x) in rows().enumerate() {
            for (column, z) in columns().enumerate() {
                let stone = stones[(row + 2 * column) % stones.len()];
                self.add_upright(base, stone, Vec3::new(x, 0.0, z), Vec3::ONE)?;
                let turn = Quat::from_rotation_y(0.2 * (row * COLUMNS + column) as f32);
                self.add(shaft, stone, Vec3::new(x, 0.5, z), turn, Vec3::new(1.0, 4.0, 1.0))?;
                self.add_upright(capital, stones[1], Vec3::new(x, 4.5, z), Vec3::ONE)?;
            }
            let along = Quat::from_rotation_y(FRAC_PI_2);
            for z in bays() {
                self.add(arch, stones[0], Vec3::new(x, 5.1, z), along, Vec3::ONE)?;
                self.add_upright(block, stones[2], Vec3::new(x, 7.15, z), Vec3::new(0.95, 0.36, BAY))?;
            }
        }
        Ok(())
    }

    /// Adds roof beams from row to row, and a banner under every second one.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn aisles(&mut self) -> Result<(), SceneError> {
        let SharedAssets { block, banner, wood, banners, .. } = self.assets;
        for side in [-1.0, 1.0] {
            let x = side * (ROWS[0] + ROWS[1]) / 2.0;
            for (bay, z) in bays().enumerate() {
                for third in [-1.0, 0.0, 1.0] {
                    let position = Vec3::new(x, 7.45, z + third * BAY / 3.0);
                    self.add_upright(block, wood, position, Vec3::new(BAY + 1.5, 0.26, 0.2))?;
                }
                let color = banners[(bay + usize::from(side > 0.0)) % banners.len()];
                self.add_upright(banner, color, Vec3::new(x, 7.3, z), Vec3::new(1.3, 1.0, 1.0))?;
            }
        }
        Ok(())
    }

    /// Adds urns on pedestals between the columns, with plants in some.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn nave(&mut self) -> Result<(), SceneError> {
        let SharedAssets { block, urn, plant, stones, bronze, leaves, .. } = self.assets;
        for side in [-1.0, 1.0] {
            for (bay, z) in bays().enumerate() {
                let x = side * ROWS[0];
                self.add_upright(block, stones[2], Vec3::new(x, 0.3, z), Vec3::new(0.7, 0.6, 0.7))?;
                let size = 0.85 + 0.1 * ((bay * 2) % 3) as f32;
                self.add_upright(urn, bronze, Vec3::new(x, 0.6, z), Vec3::splat(size))?;
                if bay % 2 == 0 {
                    let turn = Quat::from_rotation_y(bay as f32);
                    let position = Vec3::new(x, 0.6 + 1.22 * size, z);
                    self.add(plant, leaves, position, turn, Vec3::new(0.48, 0.36, 0.48) * size)?;
                }
            }
        }
        Ok(())
    }

    /// Adds the podium, steps and walls around the box, and buttresses against them.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn shrine(&mut self) -> Result<(), SceneError> {
        let SharedAssets { block, buttress, urn, stones, bronze, .. } = self.assets;
        for (step, reach) in [0.0, 0.35, 0.7].into_iter().enumerate() {
            let height = PODIUM - 0.2 * step as f32 - 0.004;
            let size = Vec3::new(7.2 + 2.0 * reach, height, 7.2 + 2.0 * reach);
            self.add_upright(block, stones[step], Vec3::new(0.0, height / 2.0, -2.8), size)?;
        }
        // Slightly outside the box, whose own walls are single-sided and face inward.
        let [low, high] = [PODIUM - 0.004, PODIUM + 5.5];
        let middle = (low + high) / 2.0;
        for side in [-1.0, 1.0] {
            let position = Vec3::new(side * 2.96, middle, -2.85);
            self.add_upright(block, stones[1], position, Vec3::new(0.32, high - low, 5.9))?;
            for z in [-0.9, -2.85, -4.8] {
                let mirrored = Vec3::new(side, 1.0, 1.0);
                self.add_upright(buttress, stones[0], Vec3::new(side * 3.12, PODIUM - 0.004, z), mirrored)?;
            }
            self.add_upright(urn, bronze, Vec3::new(side * 3.3, PODIUM, 0.45), Vec3::splat(0.8))?;
        }
        self.add_upright(block, stones[1], Vec3::new(0.0, middle, -5.72), Vec3::new(5.7, high - low, 0.2))?;
        self.add_upright(block, stones[1], Vec3::new(0.0, high + 0.14, -2.85), Vec3::new(6.5, 0.28, 6.3))?;
        self.add_upright(block, stones[2], Vec3::new(0.0, high + 0.36, -2.85), Vec3::new(6.0, 0.16, 5.8))
    }

    /// Adds two avenues of cypresses on the lawn beside the colonnade, and a row behind it.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn cypresses(&mut self) -> Result<(), SceneError> {
        let avenue = (0..16).flat_map(|tree| {
            let z = 6.0 - 3.6 * tree as f32;
            [Vec3::new(-15.0, -0.35, z), Vec3::new(15.0, -0.35, z)]
        });
        let behind = (0..13).map(|tree| Vec3::new((tree as f32 - 6.0) * 2.9, -0.35, -48.0));
        for (tree, position) in avenue.chain(behind).enumerate() {
            let share = golden_ratio(tree);
            let offset = Vec3::new(share - 0.5, 0.0, (share * 7.0).fract() - 0.5);
            let size = Vec3::new(0.9 + 0.3 * share, 7.0 + 3.0 * (share * 5.0).fract(), 0.9 + 0.3 * share);
            let SharedAssets { cypress, leaves, .. } = self.assets;
            self.add(cypress, leaves, position + offset, Quat::from_rotation_y(share * 6.0), size)?;
        }
        Ok(())
    }
}
