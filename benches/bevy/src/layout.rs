//! The scenes: what both renderers draw, without a type of either.

use std::f64::consts::TAU;

/// Objects of the largest scenes. Bevy has 176 bytes for each object of each camera in one buffer, and four cameras.
pub const MAX_OBJECTS: u32 = 1_000_000;
/// Width and height of pictures that nobody asked for in another size, in pixels.
pub const PICTURE: u32 = 256;
/// Cube meshes. They are equal, but are assets of their own.
pub const MESHES: usize = 4;
/// The linear diffuse reflectance of each material. Each has a channel that is clearly the brightest, so that pictures
/// tell them apart.
pub const MATERIALS: [[f32; 3]; 4] = [[0.8, 0.2, 0.1], [0.2, 0.7, 0.2], [0.1, 0.3, 0.8], [0.7, 0.4, 0.1]];
/// The direction of the light's rays, not normalized.
pub const LIGHT: [f32; 3] = [-0.5, -1.0, -0.7];
/// The vertical field of view, in radians.
pub const FIELD_OF_VIEW: f32 = 60.0 * std::f32::consts::PI / 180.0;
/// The near plane, in metres.
pub const NEAR: f32 = 0.1;

/// Between the centres of neighbouring cubes, in metres.
const SPACING: f64 = 2.0;
/// How far a cube moves per frame, in metres.
const STEP: f64 = 1e-3;
/// How far a camera turns per frame, in radians. The margin of the pictures is 3°.
const ANGLE: f64 = 2e-4;
/// After how many frames motion goes back.
const TURN: u32 = 64;

/// What moves in each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    AllObjects,
    /// Neither objects nor cameras.
    Nothing,
    /// Every hundredth object.
    FewObjects,
    /// The cameras turn, and no object moves.
    Cameras,
}

/// A scene of unit cubes in a grid, every one of which each camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The name in tables.
    pub name: &'static str,
    pub objects: usize,
    pub cameras: usize,
    /// Width and height of each camera's picture, in pixels.
    pub picture: u32,
    pub motion: Motion,
    /// Whether Drawloom's objects are entities of a `bevy_ecs` world, rather than arrays.
    pub has_entities: bool,
}

impl Layout {
    /// All objects move, before one camera.
    pub const fn objects(objects: usize) -> Self {
        Self { name: "objects", objects, cameras: 1, picture: PICTURE, motion: Motion::AllObjects, has_entities: false }
    }

    /// One object of a hundred moves.
    pub const fn few(objects: usize) -> Self {
        Self { name: "few", motion: Motion::FewObjects, ..Self::objects(objects) }
    }

    /// Nothing moves.
    pub const fn still(objects: usize) -> Self {
        Self { name: "still", motion: Motion::Nothing, ..Self::objects(objects) }
    }

    /// The camera turns.
    pub const fn turn(objects: usize) -> Self {
        Self { name: "turn", motion: Motion::Cameras, ..Self::objects(objects) }
    }

    /// Four cameras.
    pub const fn record(objects: usize) -> Self {
        Self { name: "record", cameras: 4, ..Self::objects(objects) }
    }

    /// Entities for Drawloom too.
    pub const fn ecs(objects: usize) -> Self {
        Self { name: "ecs", has_entities: true, ..Self::objects(objects) }
    }

    /// Cubes on each edge of the grid.
    fn side(&self) -> usize {
        (self.objects as f64).cbrt().ceil() as usize
    }

    /// The position of each cube's centre at frame 0, in metres.
    pub fn positions(&self) -> impl Iterator<Item = [f64; 3]> + use<> {
        let side = self.side();
        let offset = (side - 1) as f64 / 2.0;
        let along = move |index: usize| (index as f64 - offset) * SPACING;
        (0..self.objects)
            .map(move |object| [along(object % side), along(object / side % side), along(object / (side * side))])
    }

    /// Whether an object moves.
    pub fn moves(&self, object: usize) -> bool {
        match self.motion {
            Motion::AllObjects => true,
            Motion::FewObjects => object.is_multiple_of(100),
            Motion::Nothing | Motion::Cameras => false,
        }
    }

    /// The mesh of an object.
    pub fn mesh(object: usize) -> usize {
        object % MESHES
    }

    /// The material of an object.
    pub fn material(object: usize) -> usize {
        object / MESHES % MATERIALS.len()
    }

    /// The position of each camera. At frame 0 all look at the origin, upright.
    pub fn cameras(&self) -> impl Iterator<Item = [f64; 3]> + use<> {
        // The grid's nearest face fills the picture at 1 + 1 ÷ tan 30° times half its side.
        let distance = 3.0 * (self.side() as f64 * SPACING / 2.0 + 1.0);
        let cameras = self.cameras;
        (0..cameras).map(move |camera| {
            let (sine, cosine) = (TAU * camera as f64 / cameras as f64).sin_cos();
            [distance * sine, 0.0, distance * cosine]
        })
    }
}

/// By what a moving object moves in a frame, in metres: back and forth along a diagonal.
pub fn step(frame: u32) -> [f64; 3] {
    let along = STEP * direction(frame);
    [along, along / 2.0, 0.0]
}

/// By what a turning camera turns about the vertical axis in a frame, in radians.
pub fn angle(frame: u32) -> f32 {
    (ANGLE * direction(frame)) as f32
}

fn direction(frame: u32) -> f64 {
    if (frame / TURN).is_multiple_of(2) { 1.0 } else { -1.0 }
}
