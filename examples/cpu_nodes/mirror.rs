//! A mirror, of which jobs trace the few pixels that a camera sees (L 5), at an eighth of the picture's width and
//! height; a process puts them into the picture.

use std::ops::Range;

use drawloom::command::Cull;
use drawloom::glam::{Vec2, Vec3};
use drawloom::graph::NodeError;
use drawloom::process::{
    Declare, DrawCount, Draws, InjectionPoint, ProceduralDraws, RenderProcess, StorageBuffer, targets,
};
use drawloom::scene::{GeneratedBuffer, NodeColumn};
use drawloom::task::Worker;
use drawloom::{CpuNode, FrameData, NodeAccesses, NodeContext};
use parking_lot::RwLock;

use crate::bvh::{Bvh, Triangle};
use crate::creature::{self, Creature};
use crate::{colors, ground};

/// The mirror's middle, and half of its width and height, along x and y, in metres. It faces z.
pub const MIDDLE: Vec3 = Vec3::new(0.0, 4.2, 0.0);
pub const HALF: Vec2 = Vec2::new(5.0, 3.0);

/// The pixels that are traced.
const SIZE: [usize; 2] = [120, 68];

/// The radiance of each pixel, and 1 if the mirror is there.
const REFLECTION: StorageBuffer<[f32; 4]> =
    StorageBuffer::new("reflection", (SIZE[0] * SIZE[1]) as u32).filled_by_nodes();

/// How far rays look for land, in metres.
const REACH: f32 = 60.0;

/// What rays meet beside the land: the creature, and walkers near the mirror.
#[derive(Default)]
pub struct Reflected {
    bvh: RwLock<Bvh>,
}

/// Builds the hierarchy of what rays meet, from what other nodes make in this frame.
pub struct BuildBvh<'a> {
    pub reflected: &'a Reflected,
    pub creature: &'a Creature,
    pub positions: &'a NodeColumn<'a, drawloom::glam::DVec3>,
    pub orientations: &'a NodeColumn<'a, drawloom::glam::Quat>,
    /// The index of the first walker among the objects.
    pub first_walker: usize,
}

impl CpuNode for BuildBvh<'_> {
    fn name(&self) -> &str {
        "reflected triangles"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.reads(FrameData::Transforms).reads(&self.creature.vertices).writes("reflected");
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        let mut vertices = Vec::with_capacity(self.creature.vertices.capacity());
        for chunk in 0..self.creature.vertices.chunk_count() {
            vertices.extend_from_slice(&frame.filled(&self.creature.vertices, chunk)?);
        }
        let of_creature = self.creature.triangles().map(|corners| {
            let corners = corners.map(|corner| &vertices[corner as usize]);
            let position =
                |vertex: &drawloom::scene::Vertex| Vec3::from(vertex.position) + creature::POSITION.as_vec3();
            Triangle {
                corners: corners.map(position),
                normals: corners.map(|vertex| vertex.normal.into()),
                color: colors::CREATURE,
            }
        });
        let mut boxes = Vec::new();
        for chunk in 0..self.positions.chunk_count() {
            let objects = chunk * NodeColumn::<()>::CHUNK..;
            let (positions, orientations) = (self.positions.read(chunk), self.orientations.read(chunk));
            for ((object, position), orientation) in objects.zip(positions).zip(orientations) {
                let position = position.as_vec3();
                if object >= self.first_walker && position.z > 0.0 && position.distance(MIDDLE) < 18.0 {
                    add_box(&mut boxes, |corner| position + *orientation * (corner * colors::WALKER_SIZE / 2.0));
                }
            }
        }
        self.reflected.bvh.write().rebuild(of_creature.chain(boxes));
        Ok(())
    }
}

/// Adds the triangles of a box. `place` takes the corners of a cube with sides of 2.
fn add_box(triangles: &mut Vec<Triangle>, place: impl Fn(Vec3) -> Vec3) {
    for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let right = axis.any_orthonormal_vector();
        let up = axis.cross(right);
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| place(axis + right * x + up * y));
        let normal = (place(axis) - place(Vec3::ZERO)).normalize_or_zero();
        for half in [[0, 1, 2], [0, 2, 3]] {
            let corners = half.map(|corner: usize| corners[corner]);
            triangles.push(Triangle { corners, normals: [normal; 3], color: colors::WALKER });
        }
    }
}

/// Traces the pixels of the mirror.
pub struct TraceMirror<'a> {
    pub reflected: &'a Reflected,
    pub pixels: &'a GeneratedBuffer<[f32; 4]>,
}

/// The memory of its pixels.
pub fn pixels() -> GeneratedBuffer<[f32; 4]> {
    REFLECTION.generated()
}

impl CpuNode for TraceMirror<'_> {
    fn name(&self) -> &str {
        "trace mirror"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.reads("reflected").fills(self.pixels);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.pixels.chunk_count()
    }

    fn items_per_job(&self) -> Option<usize> {
        Some(1)
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        let view = &frame.views()[0];
        let (eye, [right, up, forward]) = (view.camera.position.as_vec3(), view.picture_axes());
        let bvh = self.reflected.bvh.read();
        for chunk in chunks {
            for (pixel, made) in self.pixels.chunk_range(chunk).zip(&mut *frame.fill(self.pixels, chunk)?) {
                let [column, row] = [pixel % SIZE[0], pixel / SIZE[0]].map(|index| index as f32 + 0.5);
                let [x, y] = [column / SIZE[0] as f32 * 2.0 - 1.0, 1.0 - row / SIZE[1] as f32 * 2.0];
                *made = [0.0; 4];
                let direction = (right * x + up * y + forward).normalize();
                let distance = (MIDDLE.z - eye.z) / direction.z;
                let point = eye + direction * distance;
                let off = (point - MIDDLE).truncate().abs();
                // A pixel around it is traced as well, so that the edge has something to mix with.
                if distance > 0.0 && off.x < HALF.x + 0.4 && off.y < HALF.y + 0.4 {
                    let reflected = Vec3::new(direction.x, direction.y, -direction.z);
                    *made = radiance(&bvh, point, reflected).extend(1.0).to_array();
                }
            }
        }
        Ok(())
    }
}

/// What comes back along a ray.
fn radiance(bvh: &Bvh, origin: Vec3, direction: Vec3) -> Vec3 {
    let land = ground::cast(origin, direction, REACH).map(|distance| {
        let point = origin + direction * distance;
        (distance, ground::normal(point.x, point.z), colors::LAND)
    });
    let object = bvh.cast(origin, direction).map(|hit| (hit.distance, hit.normal, hit.color));
    let nearest = [land, object].into_iter().flatten().min_by(|one, other| one.0.total_cmp(&other.0));
    let Some((distance, normal, color)) = nearest else { return colors::SKY };
    let point = origin + direction * distance + normal * 0.02;
    let to_sun = -colors::SUN_DIRECTION.normalize();
    let is_lit = bvh.cast(point, to_sun).is_none();
    let sun = if is_lit { colors::SUN * normal.dot(to_sun).max(0.0) / std::f32::consts::PI } else { Vec3::ZERO };
    color * (sun + colors::AMBIENT)
}

/// Puts the traced pixels into the picture where the mirror is.
pub struct DrawMirror;

impl RenderProcess for DrawMirror {
    fn name(&self) -> &str {
        "draw mirror"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.reads_buffer(REFLECTION);
        declare.tests_depth(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        let parameters = [MIDDLE.to_array(), [HALF.x, HALF.y, 0.0], [SIZE[0] as f32, SIZE[1] as f32, 0.0]];
        let parameters: Vec<[f32; 4]> = parameters.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect();
        Draws::Procedural(ProceduralDraws {
            shader: include_str!("mirror.wgsl"),
            count: DrawCount::Count { vertices: 6, instances: 1 },
            cull: Cull::Nothing,
            parameters: bytemuck::cast_slice(&parameters).to_vec().into(),
            ..ProceduralDraws::default()
        })
    }
}
