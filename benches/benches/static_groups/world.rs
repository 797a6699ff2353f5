//! Blocks of boxes that stand still, boxes that move, and cameras.

use std::f32::consts::FRAC_PI_2;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Camera, Changes, Material, Mesh, Projection, RenderObject, Scene, SceneError, SceneRef, StaticGroup,
};

/// How the scene is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cameras {
    /// From above, all of it. Nothing is out of sight, and the camera stands still.
    Still,
    /// The same by a camera that moves a little in each frame.
    All,
    /// A camera that flies over a quarter of it, so that it sees some blocks in part.
    Quarter,
    /// A camera that sees one corner: where four blocks meet.
    Corner,
    /// Four cameras that fly over a quarter each.
    Four,
}

impl Cameras {
    pub const ALL: [Self; 5] = [Self::Still, Self::All, Self::Quarter, Self::Corner, Self::Four];

    pub fn name(self) -> &'static str {
        match self {
            Self::Still => "one, still, sees all",
            Self::All => "one, moving, sees all",
            Self::Quarter => "one, moving, sees a quarter",
            Self::Corner => "one, moving, sees where four blocks meet",
            Self::Four => "four, moving, a quarter each",
        }
    }
}

/// Blocks, each a static group, with boxes that move between them.
pub struct World {
    pub scene: Scene,
    positions: Vec<DVec3>,
    /// Those that move in this frame.
    moving: Vec<u32>,
    cameras: Cameras,
    frame: u32,
    has_stepped_with_more: bool,
    pub blocks: usize,
    pub in_block: usize,
    /// The side of the plain, in metres.
    pub side: f64,
}

impl World {
    pub const MOVING: usize = 1_000;
    pub const MESHES: usize = 16;
    /// Between boxes, in metres.
    const STEP: f64 = 2.0;

    /// Blocks of this number of boxes.
    pub fn new(cameras: Cameras, blocks: usize, in_block: usize) -> Result<Self, SceneError> {
        let mut scene = Scene::new();
        let mut meshes: Vec<Handle<Mesh>> = Vec::new();
        for mesh in 0..Self::MESHES {
            meshes.push(scene.add(Mesh::cuboid(format!("box {mesh}"), Vec3::splat(0.5 + mesh as f32 * 0.05))?)?);
        }
        let material = scene.add(Material::default())?;
        let per_side = (blocks as f64).sqrt().ceil() as usize;
        let in_row = (in_block as f64).sqrt().ceil() as usize;
        let width = in_row as f64 * Self::STEP;
        let side = per_side as f64 * width;
        for block in 0..blocks {
            let [x, z] = [block % per_side, block / per_side].map(|place| place as f64 * width);
            for index in 0..in_block {
                let [across, along] = [index % in_row, index / in_row].map(|place| place as f64 * Self::STEP);
                let position = DVec3::new(x + across, 0.0, z + along);
                scene.add_object(RenderObject::new(meshes[index % Self::MESHES], material, position))?;
            }
            let first = (block * in_block) as u32;
            scene
                .static_groups
                .push(StaticGroup::new(format!("block {block}"), (first..first + in_block as u32).collect()));
        }
        for index in 0..Self::MOVING {
            let share = index as f64 / Self::MOVING as f64;
            let position = DVec3::new(side * share, 2.0, side * (share * 31.0).fract());
            scene.add_object(RenderObject::new(meshes[index % Self::MESHES], material, position))?;
        }
        let first = (blocks * in_block) as u32;
        let moving = (first..first + Self::MOVING as u32).collect();
        let positions = scene.as_scene_ref().positions.to_vec();
        let mut world =
            Self { scene, positions, moving, cameras, frame: 0, has_stepped_with_more: false, blocks, in_block, side };
        world.scene.cameras = world.new_cameras(per_side, width);
        Ok(world)
    }

    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    fn new_cameras(&self, per_side: usize, width: f64) -> Vec<Camera> {
        let side = self.side;
        let over = |name: &str, x: f64, z: f64, across: f64| {
            // A field of view of 90°.
            let position = DVec3::new(x, across / 2.0, z);
            let orientation = Quat::from_rotation_x(-FRAC_PI_2);
            let projection = Projection::Perspective { field_of_view: FRAC_PI_2 };
            Camera { orientation, projection, size: [64, 64], ..Camera::looking_at(name, position, DVec3::ZERO) }
        };
        match self.cameras {
            Cameras::Still | Cameras::All => vec![over("main", side / 2.0, side / 2.0, side * 1.1)],
            Cameras::Quarter => vec![over("main", side / 2.0, side / 2.0, side / 2.0)],
            Cameras::Corner => {
                let crossing = (per_side / 2) as f64 * width;
                vec![over("main", crossing, crossing, width / 2.0)]
            }
            Cameras::Four => (0..4)
                .map(|index| {
                    let [x, z] = [index % 2, index / 2].map(|place| side * (0.25 + 0.5 * f64::from(place)));
                    over(&format!("camera {index}"), x, z, side / 2.0)
                })
                .collect(),
        }
    }

    /// Has a box that stands still move as well, in the next frame alone.
    pub fn change_next(&mut self, object: usize) {
        self.moving.push(object as u32);
    }

    /// Moves what moves.
    pub fn step(&mut self) {
        if self.has_stepped_with_more {
            self.moving.truncate(Self::MOVING);
        }
        self.has_stepped_with_more = self.moving.len() > Self::MOVING;
        self.frame += 1;
        let back_and_forth = f64::from((self.frame % 128).abs_diff(64)) - 32.0;
        let by = if self.frame % 128 < 64 { -0.05 } else { 0.05 };
        for &object in &self.moving {
            self.positions[object as usize].x += by;
        }
        if self.cameras != Cameras::Still {
            for (index, camera) in self.scene.cameras.iter_mut().enumerate() {
                camera.position.x += by;
                camera.position.z += by * (0.5 + index as f64 * 0.1) * (1.0 + back_and_forth * 1e-3);
            }
        }
    }

    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        let changes = if self.frame <= 1 { Changes::Unknown } else { Changes::Objects(&self.moving) };
        SceneRef { positions: &self.positions, changes, ..self.scene.as_scene_ref() }
    }

    /// The positions of the boxes that move.
    pub fn moving_positions(&self) -> &[DVec3] {
        &self.positions[self.blocks * self.in_block..]
    }
}
