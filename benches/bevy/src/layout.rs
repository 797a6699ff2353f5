//! The scenes: what both renderers draw, without a type of either.

use std::f64::consts::TAU;

/// Width and height of each picture, in pixels.
pub const PICTURE: u32 = 256;
/// Cube meshes. They are equal, but are assets of their own.
pub const MESHES: usize = 4;
/// The linear diffuse reflectance of each material.
pub const MATERIALS: [[f32; 3]; 4] = [[0.8, 0.2, 0.1], [0.2, 0.7, 0.2], [0.1, 0.3, 0.8], [0.7, 0.7, 0.6]];
/// The direction of the light's rays, not normalized.
pub const LIGHT: [f32; 3] = [-0.5, -1.0, -0.7];
/// The vertical field of view, in radians.
pub const FIELD_OF_VIEW: f32 = 60.0 * std::f32::consts::PI / 180.0;
/// The near plane, in metres.
pub const NEAR: f32 = 0.1;

/// Between the centres of neighbouring cubes, in metres.
const SPACING: f64 = 2.0;
/// How far a cube moves per frame, in metres, and after how many frames it turns around.
const STEP: f64 = 1e-3;
const TURN: u32 = 64;

/// A scene of unit cubes in a grid, every one of which each camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The name in tables.
    pub name: &'static str,
    pub objects: usize,
    pub cameras: usize,
    /// Whether Drawloom's objects are entities of a `bevy_ecs` world, rather than arrays.
    pub has_entities: bool,
}

impl Layout {
    pub const fn objects(objects: usize) -> Self {
        Self { name: "objects", objects, cameras: 1, has_entities: false }
    }

    pub const fn record(objects: usize) -> Self {
        Self { name: "record", objects, cameras: 4, has_entities: false }
    }

    pub const fn ecs(objects: usize) -> Self {
        Self { name: "ecs", objects, cameras: 1, has_entities: true }
    }

    /// Objects drawn in a frame, over all cameras.
    pub fn object_views(&self) -> usize {
        self.objects * self.cameras
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

    /// The mesh of an object.
    pub fn mesh(object: usize) -> usize {
        object % MESHES
    }

    /// The material of an object.
    pub fn material(object: usize) -> usize {
        object / MESHES % MATERIALS.len()
    }

    /// The position of each camera. All look at the origin, upright.
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

/// By what every object moves in a frame, in metres: back and forth along a diagonal.
pub fn step(frame: u32) -> [f64; 3] {
    let forward = (frame / TURN).is_multiple_of(2);
    let along = if forward { STEP } else { -STEP };
    [along, along / 2.0, 0.0]
}
