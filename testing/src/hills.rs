//! Hills that move: a mesh that CPU nodes make anew in each frame, and the same one made before the frame.

use std::ops::Range;

use drawloom::glam::{DVec3, Vec3};
use drawloom::graph::NodeError;
use drawloom::scene::{
    Camera, GeneratedBuffer, Light, Material, Mesh, RenderObject, Scene, SceneError, Topology, Vertex,
};
use drawloom::task::Worker;
use drawloom::{CpuNode, NodeAccesses, NodeContext};

use crate::scenes::cube;

/// Vertices along a side.
const SIDE: usize = 33;
const INDICES: usize = (SIDE - 1) * (SIDE - 1) * 6;

fn height(x: f32, z: f32, frame: usize) -> f32 {
    (x * 1.7 + frame as f32).sin() * 0.4 + (z * 2.3 - frame as f32 * 0.5).cos() * 0.3
}

/// A vertex of the hills in a frame.
pub fn vertex(frame: usize, index: usize) -> Vertex {
    let [x, z] = [index % SIDE, index / SIDE].map(|step| step as f32 / 4.0 - 4.0);
    let slope = |dx: f32, dz: f32| height(x + dx, z + dz, frame) - height(x - dx, z - dz, frame);
    let normal = Vec3::new(-slope(0.01, 0.0), 0.02, -slope(0.0, 0.01)).normalize();
    Vertex { position: [x, height(x, z, frame), z], normal: normal.to_array(), uv: [0.0; 2] }
}

/// An index of the hills.
pub fn index(index: usize) -> u32 {
    let (square, corner) = (index / 6, index % 6);
    let [row, column] = [square / (SIDE - 1), square % (SIDE - 1)];
    let first = row * SIDE + column;
    [first, first + SIDE, first + 1, first + 1, first + SIDE, first + SIDE + 1][corner] as u32
}

const HOLE: usize = 50;

/// The number of indices in a frame: odd ones lack the last squares.
pub fn index_count(frame: usize) -> usize {
    if frame.is_multiple_of(2) { INDICES } else { INDICES - 6 * HOLE }
}

/// The hills as the engine would make them before the frame.
///
/// # Errors
/// None.
pub fn mesh(frame: usize) -> Result<Mesh, SceneError> {
    let vertices = (0..SIDE * SIDE).map(|index| vertex(frame, index)).collect();
    let indices = (0..index_count(frame)).map(index).collect();
    Mesh::new("hills", Topology::TriangleList, vertices, indices)
}

/// What nodes make the hills of.
#[derive(Clone, Debug)]
pub struct GeneratedHills {
    vertices: GeneratedBuffer<Vertex>,
    indices: GeneratedBuffer<u32>,
}

impl GeneratedHills {
    /// Buffers for the hills.
    #[expect(clippy::new_without_default, reason = "every two differ")]
    pub fn new() -> Self {
        let vertices = GeneratedBuffer::with_chunk("hills", SIDE * SIDE, 100);
        Self { vertices, indices: GeneratedBuffer::with_chunk("triangles of hills", INDICES, 1000) }
    }

    /// The mesh.
    ///
    /// # Errors
    /// None.
    pub fn mesh(&self) -> Result<Mesh, SceneError> {
        let corners = [Vec3::new(-4.0, -0.7, -4.0), Vec3::new(4.0, 0.7, 4.0)];
        Mesh::generated("hills", Topology::TriangleList, corners, &self.vertices, &self.indices)
    }

    /// The nodes that make it.
    pub fn nodes(&self, frame: usize) -> (MakeVertices<'_>, MakeIndices<'_>) {
        (MakeVertices { hills: self, frame }, MakeIndices { hills: self, frame })
    }
}

/// Makes the vertices.
#[derive(Debug)]
pub struct MakeVertices<'a> {
    hills: &'a GeneratedHills,
    frame: usize,
}

impl CpuNode for MakeVertices<'_> {
    fn name(&self) -> &str {
        "vertices"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.hills.vertices);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.hills.vertices.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            let numbers = self.hills.vertices.chunk_range(chunk);
            for (number, made) in numbers.zip(&mut *frame.fill(&self.hills.vertices, chunk)?) {
                *made = vertex(self.frame, number);
            }
        }
        Ok(())
    }
}

/// Makes the indices.
#[derive(Debug)]
pub struct MakeIndices<'a> {
    hills: &'a GeneratedHills,
    frame: usize,
}

impl CpuNode for MakeIndices<'_> {
    fn name(&self) -> &str {
        "indices"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.hills.indices);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.hills.indices.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            let numbers = self.hills.indices.chunk_range(chunk);
            for (number, made) in numbers.zip(&mut *frame.fill(&self.hills.indices, chunk)?) {
                // What is behind the count is not read.
                *made = if number < index_count(self.frame) { index(number) } else { 7 };
            }
            if chunk == 0 {
                frame.set_count(&self.hills.indices, index_count(self.frame))?;
            }
        }
        Ok(())
    }
}

/// A scene of these hills and a cube above them, lit by a lamp that casts shadows.
///
/// # Errors
/// None.
pub fn scene(hills: Mesh) -> Result<Scene, SceneError> {
    let mut scene = Scene::new();
    let ground = scene.add(Material { diffuse: Vec3::new(0.3, 0.7, 0.3), ..Material::default() })?;
    let stone = scene.add(Material { diffuse: Vec3::new(0.7, 0.6, 0.5), ..Material::default() })?;
    let hills = scene.add(hills)?;
    scene.add_object(RenderObject::new(hills, ground, DVec3::ZERO))?;
    let cube = scene.add(cube())?;
    scene.add_object(RenderObject::new(cube, stone, DVec3::new(0.0, 1.2, 0.0)))?;
    scene.ambient = Vec3::splat(0.1);
    scene.lights.push(Light::Directional {
        direction: Vec3::new(0.8, -1.0, 0.3),
        illuminance: Vec3::splat(2.0),
        casts_shadow: true,
    });
    let mut camera = Camera::looking_at("main", DVec3::new(3.0, 4.0, 6.0), DVec3::ZERO);
    camera.size = [160, 120];
    scene.cameras.push(camera);
    Ok(scene)
}
