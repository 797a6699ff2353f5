//! Land around the camera, made by jobs in each frame: nothing of it is kept.

use std::ops::Range;

use drawloom::glam::{DVec3, Vec3};
use drawloom::graph::NodeError;
use drawloom::scene::{GeneratedBuffer, Mesh, SceneError, Topology, Vertex};
use drawloom::task::Worker;
use drawloom::{CpuNode, NodeAccesses, NodeContext};

use crate::ground;

/// Squares along a side.
const SQUARES: usize = 160;

/// The side of a square, in metres.
const STEP: f32 = 0.5;

/// Half the side of the land, in metres.
const HALF: f32 = SQUARES as f32 * STEP / 2.0;

const SIDE: usize = SQUARES + 1;

/// The land and where its middle is.
pub struct Terrain {
    vertices: GeneratedBuffer<Vertex>,
    middle: [f32; 2],
}

impl Terrain {
    pub fn new() -> Self {
        // A row is what a job makes at least.
        Self { vertices: GeneratedBuffer::with_chunk("terrain", SIDE * SIDE, SIDE), middle: [0.0; 2] }
    }

    pub fn mesh(&self) -> Result<Mesh, SceneError> {
        let corners = [Vec3::new(-HALF, -ground::HIGHEST, -HALF), Vec3::new(HALF, ground::HIGHEST, HALF)];
        let square = |square: usize| {
            let first = (square / SQUARES * SIDE + square % SQUARES) as u32;
            let next_row = first + SIDE as u32;
            [first, next_row, first + 1, first + 1, next_row, next_row + 1]
        };
        let indices: Vec<u32> = (0..SQUARES * SQUARES).flat_map(square).collect();
        Mesh::generated("terrain", Topology::TriangleList, corners, &self.vertices, indices)
    }

    /// Puts the middle below the camera, by whole squares so that the land does not crawl. Returns the position of the
    /// object.
    pub fn follow(&mut self, camera: DVec3) -> DVec3 {
        self.middle = [camera.x, camera.z].map(|coordinate| (coordinate as f32 / STEP).round() * STEP);
        DVec3::new(self.middle[0].into(), 0.0, self.middle[1].into())
    }
}

impl CpuNode for Terrain {
    fn name(&self) -> &str {
        "terrain"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.vertices);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.vertices.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, rows: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for row in rows {
            let z = row as f32 * STEP - HALF;
            for (column, vertex) in frame.fill(&self.vertices, row)?.iter_mut().enumerate() {
                let x = column as f32 * STEP - HALF;
                let [world_x, world_z] = [x + self.middle[0], z + self.middle[1]];
                *vertex = Vertex {
                    position: [x, ground::height(world_x, world_z), z],
                    normal: ground::normal(world_x, world_z).to_array(),
                    uv: [0.0; 2],
                };
            }
        }
        Ok(())
    }
}
