//! The project's own scene: the Cornell box in a colonnade at dusk.

mod cornell;
mod fire;
mod glass;
mod glows;
mod lamp;
mod lights;
mod props;
mod shape;

use glam::{DVec3, Quat, Vec3};

use self::props::Props;
use super::{Camera, Projection, RenderObject, Scene, SceneError};
use crate::handle::Handle;
use crate::scene::{Material, Mesh};

/// Between columns, along a row and across an aisle.
const BAY: f32 = 3.8;
/// The rows of columns beside the nave and beyond the aisles; one each to the left and to the right.
const ROWS: [f32; 2] = [5.6, 5.6 + BAY];
/// Columns in a row.
const COLUMNS: usize = 11;
/// The first column stands here, the others at lower z.
const FIRST: f32 = 7.6;
/// The side of a piece of lawn.
const LAWN: f32 = 30.0;
/// The height of the podium that the box stands on.
const PODIUM: f32 = 0.6;

/// A Cornell box on a podium in a colonnade at dusk, some 1,040 objects of 26 meshes: slabs of checkered floor, fluted columns
/// with bases, capitals and arches, roof beams, banners, urns, candlesticks and cypresses. Its camera `main` looks down the
/// nave into the box.
///
/// It has what shows a whole frame:
///
/// - a lamp over the nave ([`Light::Hemispherical`]) that stands in a ring of candlesticks, whose shadows it throws across the
///   floor, and a second one in the box;
/// - some 60 small point lights, none of which reaches further than a few metres: coloured lanterns, candles, fires and
///   glow-worms; 20 spotlights down columns and onto banners; a low sun and the sky;
/// - coloured glass ([`Blend::Alpha`]), panes one behind the other and a window; flames and hundreds of sparks
///   ([`Blend::Additive`]); smoke ([`Blend::Subtractive`]);
/// - instances that are turned, scaled and mirrored, triangle lists and a strip, a texture, single- and double-sided
///   materials.
///
/// It is the same every time.
///
/// [`Light::Hemispherical`]: super::Light::Hemispherical
/// [`Blend::Alpha`]: super::Blend::Alpha
/// [`Blend::Additive`]: super::Blend::Additive
/// [`Blend::Subtractive`]: super::Blend::Subtractive
///
/// ```
/// use drawloom::scene::sample;
///
/// let scene = sample::colonnade()?;
/// assert_eq!(scene.cameras[0].name, "main");
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
///
/// # Errors
/// None that a caller can cause; those of [`Scene::add`] and [`Scene::add_object`] are passed on.
pub fn colonnade() -> Result<Scene, SceneError> {
    let mut scene = Scene::new();
    let props = Props::new(&mut scene)?;
    let mut site = Site { scene, props };
    site.ground()?;
    site.rows()?;
    site.aisles()?;
    site.nave()?;
    site.shrine()?;
    site.cypresses()?;
    cornell::add_cornell_box(&mut site.scene, DVec3::new(0.0, f64::from(PODIUM), 0.0))?;
    site.sky();
    site.lamp()?;
    site.spotlights();
    site.glows()?;
    site.glass()?;
    site.fires()?;
    let mut scene = site.scene;
    let camera = Camera::looking_at("main", DVec3::new(1.5, 3.3, 12.4), DVec3::new(-0.2, 2.0, -3.0));
    scene.cameras.push(Camera { projection: Projection::Perspective { field_of_view: 58_f32.to_radians() }, ..camera });
    Ok(scene)
}

/// A scene being built, and what it is built of.
struct Site {
    scene: Scene,
    props: Props,
}

impl Site {
    fn ground(&mut self) -> Result<(), SceneError> {
        let Props { block, slab, lawn, checker, .. } = self.props;
        // In pieces, so that a lamp's paraboloid can show those near to it without bending their edges too far.
        for (x, z) in (-5..5).flat_map(|x| (-5..5).map(move |z| (x as f32 + 0.5, z as f32 + 0.5))) {
            let place = Vec3::new(x * LAWN, -0.5, z * LAWN - 20.0);
            self.scaled(block, lawn, place, Vec3::new(LAWN, 0.3, LAWN))?;
        }
        for x in -3..3_i32 {
            for z in -9..4 {
                let place = Vec3::new((x as f32 + 0.5) * BAY, 0.0, (z as f32 + 0.5) * BAY);
                // Turned by quarters, the veins of one texture do not line up.
                let turn = Quat::from_rotation_y((x + 2 * z).rem_euclid(4) as f32 * std::f32::consts::FRAC_PI_2);
                self.turned(slab, checker, place, turn, Vec3::new(BAY, 1.0, BAY))?;
            }
        }
        Ok(())
    }

    /// Four rows of columns, each with arches and a cornice.
    fn rows(&mut self) -> Result<(), SceneError> {
        let Props { base, shaft, capital, arch, block, stones, .. } = self.props;
        for (row, x) in rows().enumerate() {
            for (column, z) in columns().enumerate() {
                let stone = stones[(row + 2 * column) % stones.len()];
                self.scaled(base, stone, Vec3::new(x, 0.0, z), Vec3::ONE)?;
                let turn = Quat::from_rotation_y(0.2 * (row * COLUMNS + column) as f32);
                self.turned(shaft, stone, Vec3::new(x, 0.5, z), turn, Vec3::new(1.0, 4.0, 1.0))?;
                self.scaled(capital, stones[1], Vec3::new(x, 4.5, z), Vec3::ONE)?;
            }
            let along = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
            for z in bays() {
                self.turned(arch, stones[0], Vec3::new(x, 5.1, z), along, Vec3::ONE)?;
                self.scaled(block, stones[2], Vec3::new(x, 7.15, z), Vec3::new(0.95, 0.36, BAY))?;
            }
        }
        Ok(())
    }

    /// Roof beams from row to row, and a banner under every second one.
    fn aisles(&mut self) -> Result<(), SceneError> {
        let Props { block, banner, wood, banners, .. } = self.props;
        for side in [-1.0, 1.0] {
            let x = side * (ROWS[0] + ROWS[1]) / 2.0;
            for (bay, z) in bays().enumerate() {
                for third in [-1.0, 0.0, 1.0] {
                    let place = Vec3::new(x, 7.45, z + third * BAY / 3.0);
                    self.scaled(block, wood, place, Vec3::new(BAY + 1.5, 0.26, 0.2))?;
                }
                let color = banners[(bay + usize::from(side > 0.0)) % banners.len()];
                self.scaled(banner, color, Vec3::new(x, 7.3, z), Vec3::new(1.3, 1.0, 1.0))?;
            }
        }
        Ok(())
    }

    /// Urns on pedestals between the columns, with plants in some.
    fn nave(&mut self) -> Result<(), SceneError> {
        let Props { block, urn, plant, stones, bronze, leaves, .. } = self.props;
        for side in [-1.0, 1.0] {
            for (bay, z) in bays().enumerate() {
                let x = side * ROWS[0];
                self.scaled(block, stones[2], Vec3::new(x, 0.3, z), Vec3::new(0.7, 0.6, 0.7))?;
                let size = 0.85 + 0.1 * ((bay * 2) % 3) as f32;
                self.scaled(urn, bronze, Vec3::new(x, 0.6, z), Vec3::splat(size))?;
                if bay % 2 == 0 {
                    let turn = Quat::from_rotation_y(bay as f32);
                    let place = Vec3::new(x, 0.6 + 1.22 * size, z);
                    self.turned(plant, leaves, place, turn, Vec3::new(0.48, 0.36, 0.48) * size)?;
                }
            }
        }
        Ok(())
    }

    /// The podium, steps and walls around the box, and buttresses against them.
    fn shrine(&mut self) -> Result<(), SceneError> {
        let Props { block, buttress, urn, stones, bronze, .. } = self.props;
        for (step, reach) in [0.0, 0.35, 0.7].into_iter().enumerate() {
            let height = PODIUM - 0.2 * step as f32 - 0.004;
            let size = Vec3::new(7.2 + 2.0 * reach, height, 7.2 + 2.0 * reach);
            self.scaled(block, stones[step], Vec3::new(0.0, height / 2.0, -2.8), size)?;
        }
        // A hand's breadth outside the box, whose own walls look inward and are nothing from behind.
        let [low, high] = [PODIUM - 0.004, PODIUM + 5.5];
        let middle = (low + high) / 2.0;
        for side in [-1.0, 1.0] {
            let place = Vec3::new(side * 2.96, middle, -2.85);
            self.scaled(block, stones[1], place, Vec3::new(0.32, high - low, 5.9))?;
            for z in [-0.9, -2.85, -4.8] {
                let mirrored = Vec3::new(side, 1.0, 1.0);
                self.scaled(buttress, stones[0], Vec3::new(side * 3.12, PODIUM - 0.004, z), mirrored)?;
            }
            self.scaled(urn, bronze, Vec3::new(side * 3.3, PODIUM, 0.45), Vec3::splat(0.8))?;
        }
        self.scaled(block, stones[1], Vec3::new(0.0, middle, -5.72), Vec3::new(5.7, high - low, 0.2))?;
        self.scaled(block, stones[1], Vec3::new(0.0, high + 0.14, -2.85), Vec3::new(6.5, 0.28, 6.3))?;
        self.scaled(block, stones[2], Vec3::new(0.0, high + 0.36, -2.85), Vec3::new(6.0, 0.16, 5.8))
    }

    /// Two avenues on the lawn beside the colonnade, and a row behind it.
    fn cypresses(&mut self) -> Result<(), SceneError> {
        let avenue = (0..16).flat_map(|tree| {
            let z = 6.0 - 3.6 * tree as f32;
            [Vec3::new(-15.0, -0.35, z), Vec3::new(15.0, -0.35, z)]
        });
        let behind = (0..13).map(|tree| Vec3::new((tree as f32 - 6.0) * 2.9, -0.35, -48.0));
        for (tree, place) in avenue.chain(behind).enumerate() {
            let share = golden_share(tree);
            let offset = Vec3::new(share - 0.5, 0.0, (share * 7.0).fract() - 0.5);
            let size = Vec3::new(0.9 + 0.3 * share, 7.0 + 3.0 * (share * 5.0).fract(), 0.9 + 0.3 * share);
            let Props { cypress, leaves, .. } = self.props;
            self.turned(cypress, leaves, place + offset, Quat::from_rotation_y(share * 6.0), size)?;
        }
        Ok(())
    }

    fn scaled(
        &mut self,
        mesh: Handle<Mesh>,
        material: Handle<Material>,
        place: Vec3,
        scale: Vec3,
    ) -> Result<(), SceneError> {
        self.turned(mesh, material, place, Quat::IDENTITY, scale)
    }

    fn turned(
        &mut self,
        mesh: Handle<Mesh>,
        material: Handle<Material>,
        place: Vec3,
        orientation: Quat,
        scale: Vec3,
    ) -> Result<(), SceneError> {
        let object = RenderObject { orientation, scale, ..RenderObject::new(mesh, material, place.as_dvec3()) };
        self.scene.add_object(object)?;
        Ok(())
    }
}

/// A share from 0 to 1: steps of the golden ratio are spread evenly without repeating.
fn golden_share(step: usize) -> f32 {
    (step as f32 * 0.618_034).fract()
}

/// Where the rows are, from left to right.
fn rows() -> impl Iterator<Item = f32> {
    [-ROWS[1], -ROWS[0], ROWS[0], ROWS[1]].into_iter()
}

/// Where the columns of a row are, from the front.
fn columns() -> impl Iterator<Item = f32> {
    (0..COLUMNS).map(|column| FIRST - BAY * column as f32)
}

/// The middle between one column and the next, from the front.
fn bays() -> impl Iterator<Item = f32> {
    columns().take(COLUMNS - 1).map(|z| z - BAY / 2.0)
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests;
