//! The engine's world: waves through a field of cubes.

use std::f64::consts::TAU;
use std::time::Duration;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Assets, Bounds, Camera, Light, Material, Mesh, SceneError, SceneRef};
use drawloom::task::{JobPanic, Scheduler};

/// The engine's own storage: one array per property. Drawloom reads the arrays without copying them first.
pub struct World {
    time: f64,
    /// The cubes of a row and of a column.
    side: usize,
    assets: Assets,
    lights: [Light; 2],
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

impl World {
    /// Metres from cube to cube.
    const SPACING: f64 = 0.8;

    /// A number of cubes over a floor.
    ///
    /// # Errors
    /// If a mesh or a material is refused.
    pub fn new(cubes: usize) -> Result<Self, SceneError> {
        let mut assets = Assets::default();
        let cube = Mesh::cuboid("cube", Vec3::splat(2.0))?;
        let bounds = cube.bounds();
        let cube = assets.add(cube)?;
        let colors = [Vec3::new(0.7, 0.25, 0.15), Vec3::new(0.75, 0.6, 0.35), Vec3::new(0.2, 0.45, 0.55)];
        let colors = colors.into_iter().enumerate().map(|(index, diffuse)| {
            assets.add(Material { name: format!("paint {index}"), diffuse, ..Material::default() })
        });
        let paints = colors.collect::<Result<Vec<_>, _>>()?;
        let side = (cubes as f64).sqrt().ceil().max(1.0) as usize;
        let floor = Vec3::new((side as f64 * Self::SPACING) as f32, 0.1, (side as f64 * Self::SPACING) as f32);
        let stone = Material { name: "stone".into(), diffuse: Vec3::splat(0.5), ..Material::default() };
        let mut materials: Vec<_> = (0..cubes).map(|cube| paints[(cube % side + cube / side) % 3]).collect();
        materials.push(assets.add(stone)?);
        let mut scales = vec![Vec3::splat(0.3); cubes];
        scales.push(floor);
        let poses = (0..cubes).map(|cube| pose([cube % side, cube / side], side, 0.0));
        let (mut positions, mut orientations): (Vec<_>, Vec<_>) = poses.unzip();
        positions.push(DVec3::NEG_Y * 1.5);
        orientations.push(Quat::IDENTITY);
        Ok(Self {
            time: 0.0,
            side,
            assets,
            lights: [
                Light::Directional {
                    direction: Vec3::new(-0.5, -0.8, -0.4).normalize(),
                    illuminance: Vec3::new(2.6, 2.4, 2.1),
                    casts_shadow: true,
                },
                Light::Point {
                    position: DVec3::Y * 3.0,
                    intensity: Vec3::new(20.0, 30.0, 60.0),
                    range: 30.0,
                    casts_shadow: false,
                },
            ],
            orientations,
            scales,
            bounds: vec![bounds; cubes + 1],
            meshes: vec![cube; cubes + 1],
            positions,
            materials,
        })
    }

    /// How far the field reaches from its middle, in metres.
    pub fn radius(&self) -> f64 {
        self.side as f64 * Self::SPACING / 2.0
    }

    /// The data that Drawloom reads until the frame is recorded.
    pub fn as_scene_ref<'a>(&'a self, cameras: &'a [Camera]) -> SceneRef<'a> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            lights: &self.lights,
            cameras,
            ambient: Vec3::splat(0.06),
            background: Vec3::new(0.02, 0.03, 0.05),
            // All but one of the objects move in every frame, so nothing is said of changes.
            ..SceneRef::new(&self.assets)
        }
    }

    /// Moves the waves on by `elapsed`, as jobs on all workers.
    ///
    /// # Errors
    /// If a job panics.
    pub fn update(&mut self, scheduler: &Scheduler, elapsed: Duration) -> Result<(), JobPanic> {
        // The waves repeat, so the time stays precise however long the engine runs.
        self.time = (self.time + elapsed.as_secs_f64()) % TAU;
        let (time, side) = (self.time, self.side);
        let cubes = self.positions.len() - 1;
        let positions = self.positions[..cubes].chunks_mut(side);
        let rows = positions.zip(self.orientations[..cubes].chunks_mut(side)).enumerate();
        scheduler.parallel_for_each(rows, |(row, (positions, orientations)), _| {
            for (column, (position, orientation)) in positions.iter_mut().zip(orientations).enumerate() {
                (*position, *orientation) = pose([column, row], side, time);
            }
        })
    }
}

/// Where a cube of a square of cubes is, and how it is turned.
fn pose(cube: [usize; 2], side: usize, time: f64) -> (DVec3, Quat) {
    let [x, z] = cube.map(|index| index as f64 - (side - 1) as f64 / 2.0);
    let height = (x.hypot(z) * 0.6 - time * 2.0).sin();
    (DVec3::new(x * World::SPACING, height, z * World::SPACING), Quat::from_rotation_y((time + height) as f32))
}
