//! What every view needs to know of an object, derived from the scene in packets: eight objects that are described
//! together, as packets of rays are traced.

// Loops over the indices of arrays of a fixed length compile to vector instructions; chains of iterators do not always.
#![allow(clippy::needless_range_loop)]

use glam::{DMat3, DVec3, Quat, Vec3};

use super::draw_states::DrawStates;
use super::fixed_position::{is_within_reach, nearest_step};
use super::{BoundingSphere, FixedPosition, GpuObject, IssueReason, OrientedBox};
use crate::command::DrawState;
use crate::handle::Handle;
use crate::scene::{Bounds, Column, Material, Mesh, SceneRef, is_unit};

/// The number of objects in a packet.
pub(super) const LANES: usize = 8;

/// One number of each object of a packet.
pub(super) type Lanes<T> = [T; LANES];

/// The columns of a scene for a packet of objects: an entry for each.
#[derive(Clone, Copy)]
pub(super) struct PacketColumns<'a> {
    pub(super) positions: &'a Lanes<DVec3>,
    pub(super) orientations: &'a Lanes<Quat>,
    pub(super) scales: &'a Lanes<Vec3>,
    pub(super) bounds: &'a Lanes<Bounds>,
    pub(super) meshes: &'a Lanes<Handle<Mesh>>,
    pub(super) materials: &'a Lanes<Handle<Material>>,
}

/// The entries of up to eight objects that do not lie side by side in the columns. Unused lanes repeat the first
/// object.
pub(super) struct GatheredColumns {
    positions: Lanes<DVec3>,
    orientations: Lanes<Quat>,
    scales: Lanes<Vec3>,
    bounds: Lanes<Bounds>,
    meshes: Lanes<Handle<Mesh>>,
    materials: Lanes<Handle<Material>>,
}

impl<'a> PacketColumns<'a> {
    /// The packet of eight objects from `first` on.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub(super) fn new(scene: &SceneRef<'a>, first: usize) -> Self {
        Self {
            positions: packet(scene.position_column(), first),
            orientations: packet(scene.orientation_column(), first),
            scales: packet(scene.scale_column(), first),
            bounds: packet(scene.bounds_column(), first),
            meshes: whole(&scene.meshes[first..]),
            materials: whole(&scene.materials[first..]),
        }
    }
}

impl GatheredColumns {
    /// The packet of these objects: one to eight.
    ///
    /// # Panics
    /// If there are more or none, or if one does not exist.
    #[inline(always)]
    pub(super) fn new(scene: &SceneRef<'_>, objects: &[usize]) -> Self {
        let first = objects[0];
        let mut columns = Self {
            positions: [scene.position_column().get(first); LANES],
            orientations: [scene.orientation_column().get(first); LANES],
            scales: [scene.scale_column().get(first); LANES],
            bounds: [scene.bounds_column().get(first); LANES],
            meshes: [scene.meshes[first]; LANES],
            materials: [scene.materials[first]; LANES],
        };
        for (lane, &object) in objects.iter().enumerate().skip(1) {
            columns.positions[lane] = scene.position_column().get(object);
            columns.orientations[lane] = scene.orientation_column().get(object);
            columns.scales[lane] = scene.scale_column().get(object);
            columns.bounds[lane] = scene.bounds_column().get(object);
            columns.meshes[lane] = scene.meshes[object];
            columns.materials[lane] = scene.materials[object];
        }
        columns
    }

    #[inline(always)]
    pub(super) fn columns(&self) -> PacketColumns<'_> {
        let Self { positions, orientations, scales, bounds, meshes, materials } = self;
        PacketColumns { positions, orientations, scales, bounds, meshes, materials }
    }
}

/// The eight entries of a column from `first` on.
#[inline(always)]
fn packet<T: Copy>(column: Column<'_, T>, first: usize) -> &Lanes<T> {
    whole(column.from(first))
}

/// The first eight entries of a part of a column.
#[inline(always)]
fn whole<T>(entries: &[T]) -> &Lanes<T> {
    entries.first_chunk().expect("the packet is whole")
}

/// How an object is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectDraw {
    /// The mesh's slot.
    pub mesh: u32,
    /// The material's slot.
    pub material: u32,
    /// The fixed-function state.
    pub state: DrawState,
}

impl ObjectDraw {
    /// Equal to no object's draw: no mesh has this slot.
    pub(super) const NONE: Self = Self { mesh: u32::MAX, material: 0, state: DrawState::PLAIN };
}

/// What every view needs to know of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ObjectDescription {
    pub(super) gpu_object: GpuObject,
    pub(super) bounds: BoundingSphere,
    pub(super) draw: ObjectDraw,
}

/// What every view needs to know of a packet of objects.
pub(super) struct PacketDescription {
    /// A mask of the objects that can be drawn; the numbers of the others mean nothing.
    pub(super) valid: u8,
    pub(super) draws: Lanes<ObjectDraw>,
    /// The bounding spheres, as in [`BoundingSphere`].
    pub(super) centers: [Lanes<f64>; 3],
    pub(super) radii: Lanes<f32>,
    /// The positions in fixed point.
    steps: [Lanes<i64>; 3],
    /// Quaternions of unit length.
    orientations: [Lanes<f32>; 4],
}

impl PacketDescription {
    /// Describes the objects of a packet.
    ///
    /// What is computed is computed in loops over arrays of a fixed length, which compile to vector instructions.
    #[inline(always)]
    pub(super) fn new(columns: &PacketColumns<'_>, draw_states: &DrawStates) -> Self {
        let inputs = ObjectInputs::new(columns);
        let orientations = normalized(&inputs.orientations);
        let offsets = rotated(&orientations, &inputs.scales, &inputs.centers);
        let (centers, radii) = bounding_spheres(&inputs, &offsets);
        let steps = nearest_steps(&inputs.positions);
        let (draws, known) = find_draws(columns, draw_states);
        Self { valid: known & inputs.are_valid(&radii), draws, centers, radii, steps, orientations }
    }

    /// The GPU layout of the object of that index in the scene, in a lane of the packet.
    #[inline(always)]
    pub(super) fn gpu_object(&self, columns: &PacketColumns<'_>, lane: usize, object: usize) -> GpuObject {
        let (position_low, position_high) = FixedPosition::from_steps(lane_of(&self.steps, lane)).halves();
        GpuObject {
            position_low,
            material: self.draws[lane].material,
            position_high,
            padding: 0,
            orientation: lane_of(&self.orientations, lane),
            scale: columns.scales[lane].to_array(),
            object: object as u32,
        }
    }

    /// The description of the object of that index in the scene, in a lane of the packet; `None` if it cannot be drawn.
    pub(super) fn object(&self, columns: &PacketColumns<'_>, lane: usize, object: usize) -> Option<ObjectDescription> {
        let bounds = BoundingSphere { center: lane_of(&self.centers, lane).into(), radius: self.radii[lane] };
        let gpu_object = self.gpu_object(columns, lane, object);
        (self.valid >> lane & 1 == 1).then(|| ObjectDescription { gpu_object, bounds, draw: self.draws[lane] })
    }
}

/// How the objects of a packet are drawn, and a mask of those whose mesh and material exist.
#[inline(always)]
fn find_draws(columns: &PacketColumns<'_>, draw_states: &DrawStates) -> (Lanes<ObjectDraw>, u8) {
    let (mut draws, mut known) = ([ObjectDraw::NONE; LANES], 0);
    for lane in 0..LANES {
        let (mesh, material) = (columns.meshes[lane], columns.materials[lane]);
        if let Some(state) = draw_states.get(mesh, material, columns.scales[lane]) {
            draws[lane] = ObjectDraw { mesh: mesh.index(), material: material.index(), state };
            known |= 1 << lane;
        }
    }
    (draws, known)
}

/// The positions in fixed point.
#[inline(always)]
fn nearest_steps(positions: &[Lanes<f64>; 3]) -> [Lanes<i64>; 3] {
    let mut steps = [[0; LANES]; 3];
    for axis in 0..3 {
        for lane in 0..LANES {
            steps[axis][lane] = nearest_step(positions[axis][lane]);
        }
    }
    steps
}

/// Why an object cannot be drawn.
#[cold]
pub(super) fn rejection_reason(scene: &SceneRef<'_>, draw_states: &DrawStates, object: usize) -> IssueReason {
    let [x, y, z, w] = scene.orientation_column().get(object).to_array();
    // Rounded as where it was found to be invalid.
    let is_rotation = is_unit(x * x + y * y + z * z + w * w);
    if !is_rotation || !scene.transform_is_valid(object) {
        IssueReason::InvalidTransform
    } else if FixedPosition::new(scene.position_column().get(object)).is_none() {
        IssueReason::OutOfReach
    } else if scene.assets.is_pending(scene.meshes[object]) || scene.assets.is_pending(scene.materials[object]) {
        IssueReason::NotResident
    } else if scene.assets.get(scene.meshes[object]).is_err() {
        IssueReason::StaleMesh
    } else if scene.assets.get(scene.materials[object]).is_err() {
        IssueReason::StaleMaterial
    } else if !draw_states.is_drawable(scene.meshes[object].index() as usize) {
        IssueReason::UndrawableMesh
    } else if !draw_states.has_material(scene.materials[object].index() as usize) {
        IssueReason::MaterialLimit
    } else {
        IssueReason::InvalidBounds
    }
}

/// The numbers that objects are described by: an array for each coordinate.
struct ObjectInputs {
    positions: [Lanes<f64>; 3],
    orientations: [Lanes<f32>; 4],
    scales: [Lanes<f32>; 3],
    /// The centres and radii of the bounds, in object space.
    centers: [Lanes<f32>; 3],
    radii: Lanes<f32>,
}

impl ObjectInputs {
    #[inline(always)]
    fn new(columns: &PacketColumns<'_>) -> Self {
        let PacketColumns { positions, orientations, scales, bounds, .. } = columns;
        let mut inputs = Self {
            positions: [[0.0; LANES]; 3],
            orientations: [[0.0; LANES]; 4],
            scales: [[0.0; LANES]; 3],
            centers: [[0.0; LANES]; 3],
            radii: [0.0; LANES],
        };
        for lane in 0..LANES {
            let (position, orientation) = (positions[lane].to_array(), orientations[lane].to_array());
            let (scale, center) = (scales[lane].to_array(), bounds[lane].center.to_array());
            for axis in 0..3 {
                inputs.positions[axis][lane] = position[axis];
                inputs.scales[axis][lane] = scale[axis];
                inputs.centers[axis][lane] = center[axis];
            }
            for axis in 0..4 {
                inputs.orientations[axis][lane] = orientation[axis];
            }
            inputs.radii[lane] = bounds[lane].radius;
        }
        inputs
    }

    /// A mask of the objects that have valid transforms and bounds. `world_radii` are those of their bounding spheres.
    #[inline(always)]
    fn are_valid(&self, world_radii: &Lanes<f32>) -> u8 {
        let mut valid = [false; LANES];
        for lane in 0..LANES {
            let [x, y, z, w] = lane_of(&self.orientations, lane);
            // The conjunction without branches. NaN is not finite, and no radius that is NaN is valid.
            valid[lane] = is_within_reach(self.positions[0][lane])
                & is_within_reach(self.positions[1][lane])
                & is_within_reach(self.positions[2][lane])
                & is_unit(x * x + y * y + z * z + w * w)
                & self.scales[0][lane].is_finite()
                & self.scales[1][lane].is_finite()
                & self.scales[2][lane].is_finite()
                & (self.radii[lane] >= 0.0)
                & (world_radii[lane] <= MAX_RADIUS);
        }
        let mut mask = 0;
        for lane in 0..LANES {
            mask |= u8::from(valid[lane]) << lane;
        }
        mask
    }
}

/// The numbers of one lane.
#[inline(always)]
fn lane_of<T: Copy + Default, const N: usize>(numbers: &[Lanes<T>; N], lane: usize) -> [T; N] {
    let mut of_lane = [T::default(); N];
    for index in 0..N {
        of_lane[index] = numbers[index][lane];
    }
    of_lane
}

/// Normalizes quaternions whose lengths differ from 1 by no more than [`is_unit`] allows.
///
/// Two steps of Newton's method for 1/√x, starting at 1, reduce an error e of the squared length to less than e⁴, which
/// is below f32's precision, and take a fraction of the time of a square root and a division. They run in f64, because
/// an error of one rounding in the length moves rotated vectors by four.
#[inline(always)]
fn normalized(orientations: &[Lanes<f32>; 4]) -> [Lanes<f32>; 4] {
    let (mut widened, mut normalized) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
    for axis in 0..4 {
        for lane in 0..LANES {
            widened[axis][lane] = f64::from(orientations[axis][lane]);
        }
    }
    for lane in 0..LANES {
        let [mut x, mut y, mut z, mut w] = lane_of(&widened, lane);
        for _ in 0..2 {
            let factor = 1.5 - 0.5 * (x * x + y * y + z * z + w * w);
            (x, y, z, w) = (x * factor, y * factor, z * factor, w * factor);
        }
        normalized[0][lane] = x as f32;
        normalized[1][lane] = y as f32;
        normalized[2][lane] = z as f32;
        normalized[3][lane] = w as f32;
    }
    normalized
}

/// Scales vectors, and rotates the results v by quaternions of unit length, with the vector part b and the real part w:
/// (w² − b·b) v + 2 (v·b) b + 2w (b × v).
#[inline(always)]
fn rotated(orientations: &[Lanes<f32>; 4], scales: &[Lanes<f32>; 3], vectors: &[Lanes<f32>; 3]) -> [Lanes<f32>; 3] {
    let mut rotated = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let [x, y, z, w] = lane_of(orientations, lane);
        let (scale, vector) = (lane_of(scales, lane), lane_of(vectors, lane));
        let v = [scale[0] * vector[0], scale[1] * vector[1], scale[2] * vector[2]];
        let along = w * w - (x * x + y * y + z * z);
        let twice_dot = 2.0 * (v[0] * x + v[1] * y + v[2] * z);
        let twice_w = 2.0 * w;
        rotated[0][lane] = v[0] * along + x * twice_dot + (y * v[2] - z * v[1]) * twice_w;
        rotated[1][lane] = v[1] * along + y * twice_dot + (z * v[0] - x * v[2]) * twice_w;
        rotated[2][lane] = v[2] * along + z * twice_dot + (x * v[1] - y * v[0]) * twice_w;
    }
    rotated
}

/// The bounding spheres of objects in the world: centres and radii. The radii include an upper bound of the distance in
/// metres between an object's computed centre and where devices draw it. If a sphere is not finite, its radius is NaN
/// or infinite.
#[inline(always)]
fn bounding_spheres(inputs: &ObjectInputs, offsets: &[Lanes<f32>; 3]) -> ([Lanes<f64>; 3], Lanes<f32>) {
    let ObjectInputs { positions, scales, radii, .. } = inputs;
    let (mut centers, mut world_radii) = ([[0.0; LANES]; 3], [0.0; LANES]);
    for lane in 0..LANES {
        let ([px, py, pz], [x, y, z]) = (lane_of(positions, lane), lane_of(offsets, lane));
        let center = [px + f64::from(x), py + f64::from(y), pz + f64::from(z)];
        let error = position_error(center, x.abs() + y.abs() + z.abs());
        let [x, y, z] = lane_of(scales, lane);
        world_radii[lane] = radii[lane] * max(max(x.abs(), y.abs()), z.abs()) * 1.000_001 + error as f32;
        for axis in 0..3 {
            centers[axis][lane] = center[axis];
        }
    }
    (centers, world_radii)
}

/// An upper bound of the distance in metres between an object's computed centre and where devices draw it. `offset` is
/// the sum of the absolute coordinates of the rotated offset of the centre from the object's position.
///
/// The offset is rotated in f32: at most some 40 roundings of 2⁻²⁴ (thirteen of the orientation's length and direction
/// and of the scaled centre, 24 of the products and sums), and the sum of its coordinates is no less than its length;
/// 2⁻¹⁸ is 64 of them. The error of each coordinate of the centre, in f64, is half a step, 2⁻⁵³ of it. The error of the
/// drawn position relative to a camera is half a fixed-point step for each of the two, 2⁻³⁰ m per coordinate. √3 times
/// as much in space is less than twice.
#[inline(always)]
fn position_error(center: [f64; 3], offset: f32) -> f64 {
    const OF_OFFSET: f64 = 1.0 / (1_u64 << 18) as f64;
    const OF_CENTER: f64 = 1.0 / (1_u64 << 52) as f64;
    const OF_STEPS: f64 = 1.0 / (1_u64 << 29) as f64;
    let [x, y, z] = center;
    f64::from(offset) * OF_OFFSET + max(max(x.abs(), y.abs()), z.abs()) * OF_CENTER + OF_STEPS
}

/// The greater of two numbers; the second if one of them is NaN. Compiles to one instruction, unlike `f32::max`.
#[inline(always)]
fn max<T: PartialOrd>(one: T, other: T) -> T {
    if one > other { one } else { other }
}

/// The box around an object's mesh, or around its bounding sphere if the engine's bounds differ from the mesh's.
///
/// Rounding in f64 is far below the tolerances of [`position_error`] and
/// [`Frustum::intersects_boxes`](super::Frustum::intersects_boxes).
pub(super) fn bounding_box(scene: &SceneRef<'_>, object: usize, sphere: BoundingSphere) -> OrientedBox {
    let bounds = scene.bounds_column().get(object);
    let mesh = scene.assets.get(scene.meshes[object]).ok().filter(|mesh| mesh.bounds() == bounds);
    let Some(mesh) = mesh else {
        let radius = f64::from(sphere.radius);
        return OrientedBox { half_axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius), margin: 0.0 };
    };
    let [low, high] = mesh.corners().map(Vec3::as_dvec3);
    let center = bounds.center.as_dvec3();
    let scale = scene.scale_column().get(object);
    let half = (high - center).max(center - low) * scale.abs().as_dvec3();
    let rotation = DMat3::from_quat(scene.orientation_column().get(object).as_dquat().normalize());
    let offset = (scale * bounds.center).abs().element_sum();
    OrientedBox {
        half_axes: [rotation.x_axis * half.x, rotation.y_axis * half.y, rotation.z_axis * half.z],
        // A rotation changes no coordinate by more than the vector's length.
        margin: position_error(sphere.center.to_array(), offset),
    }
}

/// The largest radius in metres of an object in the world. Larger ones exceed the range of f32 on the way to clip
/// space: the narrowest field of view multiplies positions by some 1e6, and a tall picture by a hundred more.
const MAX_RADIUS: f32 = 1e30;
