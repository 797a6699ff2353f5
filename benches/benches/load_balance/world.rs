//! The world of an engine that draws a case.

use drawloom::glam::{DVec3, Quat};
use drawloom::scene::{Camera, SceneRef};

use crate::scenes::{Case, Kind};

/// A case in motion, for one renderer. Its positions are an array of its own, which it lends. It says nothing of
/// changes.
pub struct World<'a> {
    case: &'a Case,
    positions: Vec<DVec3>,
    cameras: Vec<Camera>,
    frame: usize,
}

/// After this many frames everything is where it was, so whole periods of all contenders draw the same.
pub const PERIOD: usize = 8;

/// How far an object moves in a frame, in metres.
const STEP: DVec3 = DVec3::new(1e-3, 5e-4, 0.0);

/// How far cameras are turned at least, and how much farther in each frame, in radians. The border of the picture cuts
/// the clouds, so other objects are seen in each frame.
const MIN_TURN: f32 = 0.2;
const TURN: f32 = 0.003;

impl<'a> World<'a> {
    pub fn new(case: &'a Case) -> Self {
        let scene = case.scene.as_scene_ref();
        Self { case, positions: scene.positions.to_vec(), cameras: scene.cameras.to_vec(), frame: 0 }
    }

    /// Goes on by a frame: back and forth, unless the case is still.
    pub fn step(&mut self) {
        if self.case.kind == Kind::Still {
            return;
        }
        let phase = self.frame % PERIOD;
        let step = if phase < PERIOD / 2 { STEP } else { -STEP };
        self.positions.iter_mut().for_each(|position| *position += step);
        let turn = MIN_TURN + TURN * phase.min(PERIOD - phase) as f32;
        for (camera, at_rest) in self.cameras.iter_mut().zip(&self.case.scene.cameras) {
            camera.orientation = Quat::from_rotation_y(turn) * at_rest.orientation;
        }
        self.frame += 1;
    }

    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef { positions: &self.positions, cameras: &self.cameras, ..self.case.scene.as_scene_ref() }
    }

    /// Whether the views may see these numbers of objects.
    pub fn may_see(&self, visible: impl ExactSizeIterator<Item = usize>) -> bool {
        let at_rest = &self.case.visible;
        visible.len() == at_rest.len()
            && visible.zip(at_rest).all(|(visible, &at_rest)| match self.case.kind {
                Kind::Still => visible == at_rest,
                // A turned camera sees most of its cloud, and a part of the next one if there is one.
                Kind::Moving | Kind::Ordered => 2 * visible >= at_rest,
            })
    }
}
