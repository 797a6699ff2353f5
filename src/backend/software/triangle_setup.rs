//! Triangle setup: a pass's triangles are shaded, set up and binned into tiles, a chunk a job, before tiles are drawn.

use std::ops::Range;
use std::sync::Arc;

use super::commands::SoftwareCommands;
use super::precision::Precision;
use super::tiles::Tiling;
use crate::command::{Batch, Cull};
use crate::process::{
    DeclaredAttribute, FaceCulling, MAX_ATTRIBUTES, ObjectCpuShader, PassInputs, ShaderObject, VertexInput,
    VertexOutput,
};
use crate::raster::{NearPlane, PixelBounds, Real, Triangle, Vector, Vector4, Winding};
use crate::scene::{Blend, Mesh, VERTEX_COLOR, VERTEX_INDEX};

/// A range of one object's triangles.
pub(super) struct TriangleRange {
    mesh: Arc<Mesh>,
    batch: Batch,
    object: u32,
    /// Among the mesh's triangles, or among the remaining ones.
    triangles: Range<usize>,
    /// The indices of the remaining triangles, if the mesh is not drawn whole.
    remaining: Option<Arc<[u32]>>,
}

impl TriangleRange {
    /// Whether the object's material is a mask.
    pub(super) fn is_masked(&self) -> bool {
        self.batch.state.is_masked()
    }

    /// The level of detail of the mesh that is drawn.
    fn level(&self) -> u32 {
        self.batch.state.level_of_detail()
    }

    /// Calls `visit` with the vertex indices of each triangle.
    fn each_triangle(&self, mut visit: impl FnMut([u32; 3])) {
        match &self.remaining {
            Some(indices) => indices.as_chunks().0[self.triangles.clone()].iter().copied().for_each(visit),
            None => self.mesh.triangles_in(self.level(), self.triangles.clone()).for_each(&mut visit),
        }
    }
}

/// A triangle that may touch more tiles is not binned.
const MAX_BINS: usize = 16;

/// Chunks have the same size whatever the number of workers.
const MAX_CHUNK_TRIANGLES: usize = 1024;

/// Splits the triangles of a pass into chunks of at most [`MAX_CHUNK_TRIANGLES`], in order.
///
/// # Errors
/// The errors of `mesh_of`, which returns a batch's mesh.
pub(super) fn setup_chunks<E>(
    commands: &SoftwareCommands,
    mesh_of: impl Fn(&Batch) -> Result<Arc<Mesh>, E>,
) -> Result<Vec<Vec<TriangleRange>>, E> {
    let (mut chunks, mut chunk, mut capacity) = (Vec::new(), Vec::new(), MAX_CHUNK_TRIANGLES);
    for (batch, remaining) in &commands.draws {
        let mesh = mesh_of(batch)?;
        let all = match remaining {
            Some(remaining) => remaining.start as usize / 3..remaining.end as usize / 3,
            None => 0..mesh.triangle_count_of(batch.state.level_of_detail()),
        };
        for &object in &commands.objects[batch.first as usize..][..batch.count as usize] {
            let mut start = all.start;
            while start < all.end {
                let end = all.end.min(start + capacity);
                let (mesh, batch) = (Arc::clone(&mesh), *batch);
                let remaining = remaining.as_ref().map(|_| Arc::clone(&commands.indices));
                chunk.push(TriangleRange { mesh, batch, object, triangles: start..end, remaining });
                capacity -= end - start;
                start = end;
                if capacity == 0 {
                    chunks.push(std::mem::take(&mut chunk));
                    capacity = MAX_CHUNK_TRIANGLES;
                }
            }
        }
    }
    if !chunk.is_empty() {
        chunks.push(chunk);
    }
    Ok(chunks)
}

/// A chunk's triangles, set up and binned.
pub(super) struct TriangleSetup<R: Real, const V: usize> {
    triangles: Vec<Triangle<R, V>>,
    /// Of each triangle.
    states: Vec<TriangleState>,
    /// Pairs of a tile and a triangle that may touch it, sorted.
    bins: Vec<(u32, u32)>,
    /// Triangles that may touch more than [`MAX_BINS`] tiles: binning them would take too much memory.
    unbinned: Vec<u32>,
}

/// The state that a triangle is drawn with.
#[derive(Clone, Copy)]
pub(super) struct TriangleState {
    pub(super) material: u32,
    pub(super) blend: Blend,
    pub(super) is_masked: bool,
    /// The object's index in the scene.
    pub(super) object: u32,
}

impl<R: Precision, const V: usize> TriangleSetup<R, V> {
    /// Runs the vertex shader for a chunk, and sets up and bins the sides of its triangles that this culling leaves.
    pub(super) fn new(
        shader: &dyn ObjectCpuShader<R>,
        attributes: &[DeclaredAttribute],
        pass: &PassInputs<'_, R>,
        tiling: &Tiling,
        (chunk, face_culling): (&[TriangleRange], FaceCulling),
        object_of: impl Fn(u32) -> Option<ShaderObject<R>>,
    ) -> Self {
        let mut setup = Self { triangles: Vec::new(), states: Vec::new(), bins: Vec::new(), unbinned: Vec::new() };
        let near_plane = if pass.view.clamps_near { NearPlane::Clamps } else { NearPlane::Clips };
        for range in chunk {
            // Every object that is drawn was uploaded.
            let Some(object) = object_of(range.object) else { continue };
            let state = TriangleState {
                material: object.material,
                blend: range.batch.state.blend(),
                is_masked: range.is_masked(),
                object: object.index,
            };
            let culled = culled_winding(face_culling.applied_to(range.batch.state.cull()));
            let mut cache = PostTransformCache::new(shader, pass, &object, &range.mesh, attributes);
            range.each_triangle(|indices| {
                let corners = indices.map(|index| cache.vertex(index));
                Triangle::set_up(&corners, tiling.size(), culled, near_plane, &mut setup.triangles);
            });
            setup.states.resize(setup.triangles.len(), state);
        }
        for (index, triangle) in (0..).zip(&setup.triangles) {
            let bounds = triangle.bounds();
            if tiling.touched(bounds).nth(MAX_BINS).is_some() {
                setup.unbinned.push(index);
            } else {
                setup.bins.extend(tiling.touched(bounds).map(|tile| (tile as u32, index)));
            }
        }
        setup.bins.sort_unstable();
        setup
    }

    /// The triangles that may touch a tile with these pixels, in order.
    pub(super) fn of_tile(
        &self,
        tile: usize,
        bounds: PixelBounds,
    ) -> impl Iterator<Item = (&Triangle<R, V>, TriangleState)> {
        let tile = tile as u32;
        let start = self.bins.partition_point(|(other, _)| *other < tile);
        let of_tile = self.bins[start..].iter().take_while(move |(other, _)| *other == tile);
        let touches = move |index: &&u32| !self.triangles[**index as usize].bounds().intersection(bounds).is_empty();
        let mut binned = of_tile.map(|(_, index)| *index).peekable();
        let mut unbinned = self.unbinned.iter().filter(touches).copied().peekable();
        let in_order = std::iter::from_fn(move || match (binned.peek(), unbinned.peek()) {
            (Some(one), Some(other)) if other < one => unbinned.next(),
            (None, _) => unbinned.next(),
            _ => binned.next(),
        });
        in_order.map(|index| (&self.triangles[index as usize], self.states[index as usize]))
    }
}

fn culled_winding(cull: Cull) -> Option<Winding> {
    match cull {
        Cull::Back => Some(Winding::Clockwise),
        Cull::Front => Some(Winding::CounterClockwise),
        Cull::Nothing => None,
    }
}

/// Runs the vertex shader for one object's vertices, and caches the latest results: consecutive triangles share most
/// vertices.
struct PostTransformCache<'a, R: Precision, const V: usize> {
    shader: &'a dyn ObjectCpuShader<R>,
    pass: &'a PassInputs<'a, R>,
    object: &'a ShaderObject<R>,
    mesh: &'a Mesh,
    /// The attributes that the process reads.
    attributes: &'a [DeclaredAttribute],
    /// Each with its index in the mesh.
    cached: [Option<(u32, ShadedVertex<R, V>)>; CACHE_SIZE],
}

/// A clip position and the varyings.
type ShadedVertex<R, const V: usize> = (Vector4<R>, [R; V]);

const CACHE_SIZE: usize = 32;

impl<'a, R: Precision, const V: usize> PostTransformCache<'a, R, V> {
    fn new(
        shader: &'a dyn ObjectCpuShader<R>,
        pass: &'a PassInputs<'a, R>,
        object: &'a ShaderObject<R>,
        mesh: &'a Mesh,
        attributes: &'a [DeclaredAttribute],
    ) -> Self {
        Self { shader, pass, object, mesh, attributes, cached: [None; CACHE_SIZE] }
    }

    fn vertex(&mut self, index: u32) -> ShadedVertex<R, V> {
        let entry = index as usize % CACHE_SIZE;
        match self.cached[entry] {
            Some((other, vertex)) if other == index => vertex,
            _ => {
                let input = vertex_input(self.mesh, index as usize, self.attributes);
                let VertexOutput { clip, varyings } = self.shader.vertex(self.pass, self.object, &input);
                let vertex = (clip, std::array::from_fn(|varying| varyings[varying]));
                self.cached[entry] = Some((index, vertex));
                vertex
            }
        }
    }
}

fn vertex_input<R: Real>(mesh: &Mesh, index: usize, attributes: &[DeclaredAttribute]) -> VertexInput<R> {
    let real = |value: f32| R::of(f64::from(value));
    let vertex = mesh.vertices()[index];
    let value_of = |&DeclaredAttribute { layout, ref default }: &DeclaredAttribute| {
        let (stride, number) = (layout.format.bytes(), (index as u32).to_ne_bytes());
        let default = if layout == VERTEX_INDEX.layout() { &number } else { default.as_slice() };
        let value = mesh.attribute_of(layout).map_or(default, |values| &values[index * stride..][..stride]);
        Vector(layout.format.numbers(value).map(R::of))
    };
    let is_color = |attribute: &DeclaredAttribute| attribute.layout == VERTEX_COLOR.layout();
    let color = attributes.iter().find(|attribute| is_color(attribute)).map(value_of);
    let mut own = [Vector::zero(); MAX_ATTRIBUTES];
    for (own, attribute) in own.iter_mut().zip(attributes.iter().filter(|attribute| !is_color(attribute))) {
        *own = value_of(attribute);
    }
    VertexInput {
        position: Vector(vertex.position.map(real)),
        normal: Vector(vertex.normal.map(real)),
        uv: Vector(vertex.uv.map(real)),
        color: color.map_or(Vector::splat(R::one()), |Vector([red, green, blue, _])| Vector([red, green, blue])),
        attributes: own,
    }
}
