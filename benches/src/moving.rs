//! A scene in which objects or cameras move.

use std::hint;
use std::time::{Duration, Instant};

use drawloom::glam::{DVec3, Quat};
use drawloom::scene::{Camera, Changes, Scene, SceneRef};
use drawloom_testing::random::Random;

/// An engine's world: its positions are an array of its own, which it lends to the renderer.
pub struct Moving {
    scene: Scene,
    motion: Motion,
    positions: Vec<DVec3>,
    cameras: Vec<Camera>,
    /// Which objects moved in the latest step, if the world says so.
    moved: Vec<u32>,
    frame: u32,
    random: Random,
}

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// All objects. The engine says nothing about it.
    Everything,
    /// One object in a hundred, another one in each frame. The engine says which.
    OnePercent,
    /// Nothing, and the engine says so.
    Nothing,
    /// The cameras alone, and the engine says that no object does.
    Cameras,
    /// All objects, and all cameras turn a little in each frame, so that other objects are seen. The engine says
    /// nothing about it.
    EverythingInTurningViews,
}

/// The distance that an object moves per frame, in metres, and the number of frames after which it turns around.
const STEP: f64 = 1e-3;
const FRAMES: u32 = 64;

/// How far cameras are turned at least, and how much farther they turn per frame, in radians. At the least, the border
/// of the picture cuts a cloud of [`clouds`](crate::clouds).
const MIN_TURN: f32 = 0.2;
const TURN: f32 = 0.003;

impl Motion {
    pub const ALL: [Self; 5] =
        [Self::Everything, Self::OnePercent, Self::Nothing, Self::Cameras, Self::EverythingInTurningViews];

    pub fn name(self) -> &'static str {
        match self {
            Self::Everything => "moving",
            Self::OnePercent => "one percent moving",
            Self::Nothing => "still",
            Self::Cameras => "still, cameras moving",
            Self::EverythingInTurningViews => "moving, cameras turning",
        }
    }
}

impl Moving {
    pub fn new(scene: Scene, motion: Motion) -> Self {
        let positions = scene.as_scene_ref().positions.to_vec();
        let cameras = scene.cameras.clone();
        Self { scene, motion, positions, cameras, moved: Vec::new(), frame: 0, random: Random::new() }
    }

    /// A [step](Self::step) of an engine whose update takes this long: computes until then.
    pub fn step_for(&mut self, update: Duration) {
        let start = Instant::now();
        self.step();
        while start.elapsed() < update {
            hint::spin_loop();
        }
    }

    /// Moves what moves a little, back and forth, so that it stays near its original position.
    pub fn step(&mut self) {
        let forward = (self.frame / FRAMES).is_multiple_of(2);
        let step = DVec3::new(STEP, STEP / 2.0, 0.0) * if forward { 1.0 } else { -1.0 };
        self.moved.clear();
        match self.motion {
            Motion::Everything | Motion::EverythingInTurningViews => {
                self.positions.iter_mut().for_each(|position| *position += step);
            }
            Motion::OnePercent => {
                for _ in 0..self.positions.len().div_ceil(100) {
                    let object = self.random.below(self.positions.len());
                    self.positions[object] += step;
                    self.moved.push(object as u32);
                }
            }
            Motion::Nothing => {}
            Motion::Cameras => self.cameras.iter_mut().for_each(|camera| camera.position += step),
        }
        if self.motion == Motion::EverythingInTurningViews {
            let frame = self.frame % (2 * FRAMES);
            let turn = MIN_TURN + TURN * frame.min(2 * FRAMES - frame) as f32;
            for (camera, original) in self.cameras.iter_mut().zip(&self.scene.cameras) {
                camera.orientation = Quat::from_rotation_y(turn) * original.orientation;
            }
        }
        self.frame += 1;
    }

    /// The scene. Only one renderer may draw it, because it tells what changed since the step before.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        let changes = match self.motion {
            Motion::Everything | Motion::EverythingInTurningViews => Changes::Unknown,
            Motion::OnePercent | Motion::Nothing | Motion::Cameras => Changes::Objects(&self.moved),
        };
        SceneRef { positions: &self.positions, cameras: &self.cameras, changes, ..self.scene.as_scene_ref() }
    }
}
