//! The world of an engine with draws of its own.

use drawloom::glam::{DVec3, Mat4, Quat};
use drawloom::scene::{Camera, Projection, Scene, SceneRef};
use drawloom::view::BoundingSphere;
use drawloom_benches::clouds::around_one;
use drawloom_testing::random::Random;

use crate::CAMERAS;
use crate::objects::{GpuObject, Sphere};
use crate::technique::Failure;

/// The kinds of state that items are drawn with. A material is of one pipeline, and has a bind group.
pub const PIPELINES: u32 = 16;
pub const MATERIALS: u32 = 256;

/// What moves, and what cameras see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnScene {
    /// All items, and each camera sees all of them.
    Moving,
    /// All items, and all cameras turn a little in each frame, so that other items are seen.
    Turning,
    /// Nothing.
    AtRest,
    /// The cameras, which stand among the items and turn slowly. Each sees a tenth of them.
    TenthInView,
}

/// Items and cameras. An item is one indexed draw with a transform of its own.
pub struct World {
    kind: OwnScene,
    /// The meshes, and the cameras of the first frame.
    scene: Scene,
    cameras: Vec<Camera>,
    pub bounds: Vec<BoundingSphere>,
    pub transforms: Vec<Mat4>,
    /// The mesh of each item, by slot.
    pub meshes: Vec<u32>,
    /// Pipeline and material of each item.
    pub keys: Vec<u64>,
    /// All equal: a transform changes what a buffer contains, and no command.
    pub versions: Vec<u64>,
    frame: u32,
}

/// How far an item moves in a frame, in metres, and after how many frames it turns around.
const STEP: f64 = 1e-3;
const FRAMES: u32 = 64;

/// How far cameras are turned at least where all items move, and how much farther they turn in a frame, in radians.
const MIN_TURN: f32 = 0.2;
const TURN: f32 = 0.003;

/// In each direction, in radians: a picture as wide as this shows a tenth of what surrounds the camera.
const FIELD_OF_VIEW_OF_TENTH: f32 = 1.178;

impl OwnScene {
    pub const ALL: [Self; 4] = [Self::Moving, Self::Turning, Self::AtRest, Self::TenthInView];

    pub fn name(self) -> &'static str {
        match self {
            Self::Moving => "moving",
            Self::Turning => "moving, cameras turning",
            Self::AtRest => "at rest",
            Self::TenthInView => "a tenth in view",
        }
    }

    /// Whether items move.
    pub fn moves_items(self) -> bool {
        matches!(self, Self::Moving | Self::Turning)
    }

    /// Whether cameras move.
    pub fn moves_cameras(self) -> bool {
        matches!(self, Self::Turning | Self::TenthInView)
    }
}

impl World {
    /// # Errors
    /// Returns an error if the meshes or items are invalid.
    pub fn new(kind: OwnScene, items: usize) -> Result<Self, Failure> {
        let objects = around_one(CAMERAS, items)?;
        let (objects, mut random) = (objects.as_scene_ref(), Random::new());
        let mut scene = Scene::new();
        scene.cameras = objects.cameras.to_vec();
        if kind == OwnScene::TenthInView {
            for camera in &mut scene.cameras {
                camera.position = DVec3::ZERO;
                camera.projection = Projection::Perspective { field_of_view: FIELD_OF_VIEW_OF_TENTH };
            }
        }
        let bounds = |object| {
            let Sphere { center, radius } = Sphere::new(&objects, object);
            BoundingSphere { center, radius }
        };
        let key = |_| {
            let material = random.below(MATERIALS as usize) as u32;
            u64::from(pipeline_of(material)) << 32 | u64::from(material)
        };
        Ok(Self {
            kind,
            cameras: scene.cameras.clone(),
            scene,
            bounds: (0..items).map(bounds).collect(),
            transforms: (0..items).map(|object| GpuObject::new(&objects, object).world_from_object).collect(),
            meshes: objects.meshes.iter().map(|mesh| mesh.index()).collect(),
            keys: (0..items).map(key).collect(),
            versions: vec![0; items],
            frame: 0,
        })
    }

    pub fn kind(&self) -> OwnScene {
        self.kind
    }

    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// The cameras, without any objects.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef { cameras: &self.cameras, ..self.scene.as_scene_ref() }
    }

    /// Moves what moves a little.
    pub fn step(&mut self) {
        if self.kind.moves_items() {
            let forward = (self.frame / FRAMES).is_multiple_of(2);
            let step = DVec3::new(STEP, STEP / 2.0, 0.0) * if forward { 1.0 } else { -1.0 };
            self.bounds.iter_mut().for_each(|sphere| sphere.center += step);
            self.transforms.iter_mut().for_each(|transform| transform.w_axis += step.as_vec3().extend(0.0));
        }
        let frame = self.frame % (2 * FRAMES);
        let turn = match self.kind {
            OwnScene::Turning => MIN_TURN + TURN * frame.min(2 * FRAMES - frame) as f32,
            OwnScene::TenthInView => TURN * self.frame as f32,
            OwnScene::Moving | OwnScene::AtRest => 0.0,
        };
        for (camera, original) in self.cameras.iter_mut().zip(&self.scene.cameras) {
            camera.orientation = Quat::from_rotation_y(turn) * original.orientation;
        }
        self.frame += 1;
    }
}

/// The pipeline of a material.
pub fn pipeline_of(material: u32) -> u32 {
    material % PIPELINES
}

/// The material in an item's key.
pub fn material_of(key: u64) -> u32 {
    key as u32
}
