//! A creature whose skin is a subdivision surface over a cage that moves: jobs compute its vertices in each frame.

use std::ops::Range;

use drawloom::glam::{DVec3, Vec3};
use drawloom::graph::NodeError;
use drawloom::scene::{GeneratedBuffer, Mesh, SceneError, Topology, Vertex};
use drawloom::task::Worker;
use drawloom::{CpuNode, NodeAccesses, NodeContext};

use crate::subdivision::{POINTS, Surface, Weights};

/// Where it floats.
pub const POSITION: DVec3 = DVec3::new(-2.6, 4.4, 5.0);

/// How far its arms reach at most, in metres.
const REACH: f32 = 3.2;

const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

pub struct Creature {
    pub vertices: GeneratedBuffer<Vertex>,
    surface: Surface,
    seconds: f32,
}

/// The corners of a face of a cube with sides of 2, counter-clockwise seen from outside.
fn face(axis: Vec3) -> [Vec3; 4] {
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| axis + right * x + up * y)
}

/// The number of a cube's corner.
fn corner(position: Vec3) -> u32 {
    (0..3).map(|axis| u32::from(position[axis] > 0.0) << axis).sum()
}

/// A cube with an arm on each side: the cube's corners, then the ends of the arms.
fn cage() -> Vec<[u32; 4]> {
    let mut quads = Vec::new();
    for (arm, axis) in AXES.into_iter().enumerate() {
        let inner = face(axis).map(corner);
        let outer = [0, 1, 2, 3].map(|index| (8 + arm * 4 + index) as u32);
        quads.extend([0, 1, 2, 3].map(|side| {
            let next = (side + 1) % 4;
            [inner[side], inner[next], outer[next], outer[side]]
        }));
        quads.push(outer);
    }
    quads
}

/// Where the points of the cage are at a time.
fn points(seconds: f32) -> [Vec3; POINTS] {
    let body = 0.8 + 0.05 * (seconds * 3.0).sin();
    let mut points = [Vec3::ZERO; POINTS];
    for (arm, axis) in AXES.into_iter().enumerate() {
        let phase = seconds * 1.7 + arm as f32;
        let sway = (axis.any_orthonormal_vector() * phase.sin() + Vec3::Y * (phase * 1.3).cos()) * 0.5;
        let length = 2.1 + 0.4 * (phase * 0.7).sin();
        for (index, position) in face(axis).into_iter().enumerate() {
            points[corner(position) as usize] = position * body;
            points[8 + arm * 4 + index] = axis * length + sway + (position - axis) * 0.35;
        }
    }
    points
}

impl Creature {
    pub fn new() -> Self {
        let surface = Surface::new(&cage(), 3);
        let vertices = GeneratedBuffer::with_chunk("creature", surface.positions.len(), 128);
        Self { vertices, surface, seconds: 0.0 }
    }

    pub fn mesh(&self) -> Result<Mesh, SceneError> {
        let corners = [Vec3::splat(-REACH), Vec3::splat(REACH)];
        Mesh::generated("creature", Topology::TriangleList, corners, &self.vertices, self.surface.indices())
    }

    /// The corners of its triangles, by index.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.surface.quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
    }

    pub fn set_time(&mut self, seconds: f32) {
        self.seconds = seconds;
    }
}

impl CpuNode for Creature {
    fn name(&self) -> &str {
        "creature"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.vertices);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.vertices.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        let points = points(self.seconds);
        let at = |weights: &Weights| {
            points.iter().zip(weights).fold(Vec3::ZERO, |sum, (point, weight)| sum + *point * *weight)
        };
        for chunk in chunks {
            for (index, vertex) in self.vertices.chunk_range(chunk).zip(&mut *frame.fill(&self.vertices, chunk)?) {
                let [along, across] = self.surface.tangents[index].each_ref().map(at);
                *vertex = Vertex {
                    position: at(&self.surface.positions[index]).to_array(),
                    normal: along.cross(across).normalize_or_zero().to_array(),
                    uv: [0.0; 2],
                };
            }
        }
        Ok(())
    }
}
