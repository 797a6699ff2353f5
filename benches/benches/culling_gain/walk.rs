//! A camera that moves through a scene that stands still.

use std::rc::Rc;

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Changes, Scene, SceneRef};

/// The frames after which the camera turns back.
const FRAMES: u32 = 64;

/// A scene and its camera. The engine says that no object changes.
#[derive(Clone)]
pub struct Walk {
    scene: Rc<Scene>,
    camera: Camera,
    /// What the camera moves in a frame.
    step: DVec3,
    frame: u32,
}

impl Walk {
    /// The camera moves ahead by this many metres a frame, and back again.
    pub fn new(scene: Rc<Scene>, camera: Camera, metres: f64) -> Self {
        let step = (camera.orientation * Vec3::NEG_Z).as_dvec3() * metres;
        Self { scene, camera, step, frame: 0 }
    }

    /// Moves the camera.
    pub fn step(&mut self) {
        let is_forth = (self.frame / FRAMES).is_multiple_of(2);
        self.camera.position += if is_forth { self.step } else { -self.step };
        self.frame += 1;
    }

    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        let cameras = std::slice::from_ref(&self.camera);
        SceneRef { cameras, changes: Changes::Objects(&[]), ..self.scene.as_scene_ref() }
    }
}
