//! Pieces: what one job makes of a pass's triangles before they are drawn.

use std::ops::Range;
use std::sync::Arc;

use super::number::Number;
use super::tiles::Tiling;
use crate::command::Batch;
use crate::command::Cull;
use crate::process::{Corner, ObjectTwin, ObjectValues, VertexValues, ViewValues};
use crate::raster::{PixelBounds, Real, Triangle, Vector, Vector4, Winding};
use crate::scene::{Blend, Mesh, Vertex};

/// Some triangles of one object.
pub(super) struct Run {
    pub(super) mesh: Arc<Mesh>,
    pub(super) batch: Batch,
    /// The object.
    pub(super) object: u32,
    /// Among the mesh's, or among those that remain of it.
    pub(super) triangles: Range<usize>,
    /// The corners of those that remain, where the mesh is not drawn whole.
    remaining: Option<Arc<[u32]>>,
}

impl Run {
    /// Calls `visit` with the indices of each triangle's corners.
    fn each_triangle(&self, mut visit: impl FnMut([u32; 3])) {
        match &self.remaining {
            Some(indices) => indices.as_chunks().0[self.triangles.clone()].iter().copied().for_each(visit),
            None => self.mesh.triangles_in(self.triangles.clone()).for_each(&mut visit),
        }
    }
}

/// A batch, and where the indices of what remains of it are if its mesh is not drawn whole.
pub(super) type PassDraw = (Batch, Option<Range<u32>>);

/// Squares that are written down for a triangle at most.
const MOST_PLACES: usize = 16;

/// Triangles in a piece at most. Pieces are the same whoever draws them.
const LARGEST: usize = 1024;

/// Cuts what batches draw into pieces, in order.
///
/// # Errors
/// Whatever `mesh_of` says of a batch.
pub(super) fn pieces<E>(
    draws: &[PassDraw],
    objects: &[u32],
    indices: &Arc<[u32]>,
    mesh_of: impl Fn(&Batch) -> Result<Arc<Mesh>, E>,
) -> Result<Vec<Vec<Run>>, E> {
    let (mut pieces, mut piece, mut room) = (Vec::new(), Vec::new(), LARGEST);
    for (batch, remaining) in draws {
        let mesh = mesh_of(batch)?;
        let all = match remaining {
            Some(remaining) => remaining.start as usize / 3..remaining.end as usize / 3,
            None => 0..mesh.triangle_count(),
        };
        for &object in &objects[batch.first as usize..][..batch.count as usize] {
            let mut start = all.start;
            while start < all.end {
                let end = all.end.min(start + room);
                let remaining = remaining.as_ref().map(|_| Arc::clone(indices));
                piece.push(Run { mesh: Arc::clone(&mesh), batch: *batch, object, triangles: start..end, remaining });
                room -= end - start;
                start = end;
                if room == 0 {
                    pieces.push(std::mem::take(&mut piece));
                    room = LARGEST;
                }
            }
        }
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    Ok(pieces)
}

/// A piece's triangles, ready to be drawn.
pub(super) struct SetUp<R: Real, const V: usize> {
    pub(super) triangles: Vec<Triangle<R, V>>,
    /// Of each triangle.
    pub(super) faces: Vec<Face>,
    /// Squares of the picture, each with a triangle that may touch it: by square, then by triangle.
    places: Vec<(u32, u32)>,
    /// Triangles that may touch more squares than that: to write down each would take more memory than there is.
    wide: Vec<u32>,
}

/// What a triangle is drawn with.
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub(super) material: u32,
    pub(super) blend: Blend,
}

impl<R: Number, const V: usize> SetUp<R, V> {
    /// Runs the vertex shader and sets up what comes of it.
    pub(super) fn new(
        twin: &dyn ObjectTwin<R>,
        view: &ViewValues<R>,
        tiling: &Tiling,
        piece: &[Run],
        object_of: impl Fn(u32) -> Option<ObjectValues<R>>,
    ) -> Self {
        let mut set_up = Self { triangles: Vec::new(), faces: Vec::new(), places: Vec::new(), wide: Vec::new() };
        for run in piece {
            // Every object that is drawn was uploaded.
            let Some(object) = object_of(run.object) else { continue };
            let face = Face { material: object.material, blend: run.batch.state.blend() };
            let culled = culled(run.batch.state.cull());
            let mut shaded = Shaded::new(twin, view, &object, run.mesh.vertices());
            run.each_triangle(|corners| {
                let corners = corners.map(|corner| shaded.corner(corner));
                Triangle::set_up(&corners, tiling.size(), culled, &mut set_up.triangles);
            });
            set_up.faces.resize(set_up.triangles.len(), face);
        }
        for (index, triangle) in (0..).zip(&set_up.triangles) {
            let bounds = triangle.bounds();
            if tiling.touched(bounds).nth(MOST_PLACES).is_some() {
                set_up.wide.push(index);
            } else {
                set_up.places.extend(tiling.touched(bounds).map(|tile| (tile as u32, index)));
            }
        }
        set_up.places.sort_unstable();
        set_up
    }

    /// The triangles that may touch a square with these pixels, in order.
    pub(super) fn of_tile(&self, tile: usize, bounds: PixelBounds) -> impl Iterator<Item = (&Triangle<R, V>, Face)> {
        let tile = tile as u32;
        let start = self.places.partition_point(|(other, _)| *other < tile);
        let of_tile = self.places[start..].iter().take_while(move |(other, _)| *other == tile);
        let touches = move |index: &&u32| !self.triangles[**index as usize].bounds().intersection(bounds).is_empty();
        let mut narrow = of_tile.map(|(_, index)| *index).peekable();
        let mut wide = self.wide.iter().filter(touches).copied().peekable();
        let in_order = std::iter::from_fn(move || match (narrow.peek(), wide.peek()) {
            (Some(one), Some(other)) if other < one => wide.next(),
            (None, _) => wide.next(),
            _ => narrow.next(),
        });
        in_order.map(|index| (&self.triangles[index as usize], self.faces[index as usize]))
    }
}

fn culled(cull: Cull) -> Option<Winding> {
    match cull {
        Cull::Back => Some(Winding::Clockwise),
        Cull::Front => Some(Winding::CounterClockwise),
        Cull::Nothing => None,
    }
}

/// An object's corners, of which the latest are kept: most are shared by triangles that follow one another.
struct Shaded<'a, R: Number, const V: usize> {
    twin: &'a dyn ObjectTwin<R>,
    view: &'a ViewValues<R>,
    object: &'a ObjectValues<R>,
    vertices: &'a [Vertex],
    /// Each with its index in the mesh.
    kept: [Option<(u32, ShadedCorner<R, V>)>; KEPT],
}

/// Where a corner is in clip space, and what is interpolated.
type ShadedCorner<R, const V: usize> = (Vector4<R>, [R; V]);

const KEPT: usize = 32;

impl<'a, R: Number, const V: usize> Shaded<'a, R, V> {
    fn new(
        twin: &'a dyn ObjectTwin<R>,
        view: &'a ViewValues<R>,
        object: &'a ObjectValues<R>,
        vertices: &'a [Vertex],
    ) -> Self {
        Self { twin, view, object, vertices, kept: [None; KEPT] }
    }

    fn corner(&mut self, index: u32) -> ShadedCorner<R, V> {
        let place = index as usize % KEPT;
        match self.kept[place] {
            Some((other, corner)) if other == index => corner,
            _ => {
                let vertex = values_of(&self.vertices[index as usize]);
                let Corner { clip, varyings } = self.twin.vertex(self.view, self.object, &vertex);
                let corner = (clip, std::array::from_fn(|varying| varyings[varying]));
                self.kept[place] = Some((index, corner));
                corner
            }
        }
    }
}

fn values_of<R: Real>(vertex: &Vertex) -> VertexValues<R> {
    let real = |value: f32| R::of(f64::from(value));
    VertexValues {
        position: Vector(vertex.position.map(real)),
        normal: Vector(vertex.normal.map(real)),
        uv: Vector(vertex.uv.map(real)),
    }
}
