//! A scene in which all objects move.

use drawloom::glam::DVec3;
use drawloom::scene::{Scene, SceneRef};

/// An engine's world: its positions are an array of its own, which it lends to the renderer.
pub struct Moving {
    scene: Scene,
    positions: Vec<DVec3>,
    frame: u32,
}

/// The distance that an object moves per frame, in metres, and the number of frames after which it turns around.
const STEP: f64 = 1e-3;
const FRAMES: u32 = 64;

impl Moving {
    pub fn new(scene: Scene) -> Self {
        let positions = scene.as_scene_ref().positions.to_vec();
        Self { scene, positions, frame: 0 }
    }

    /// Moves every object a little, back and forth, so that it stays near its original position.
    pub fn step(&mut self) {
        let forward = (self.frame / FRAMES).is_multiple_of(2);
        let step = DVec3::new(STEP, STEP / 2.0, 0.0) * if forward { 1.0 } else { -1.0 };
        for position in &mut self.positions {
            *position += step;
        }
        self.frame += 1;
    }

    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef { positions: &self.positions, ..self.scene.as_scene_ref() }
    }
}
