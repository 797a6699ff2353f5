//! What every view needs to know of an object, derived from the scene.

// Loops over the indices of arrays of a fixed length compile to vector instructions; chains of iterators do not always.
#![allow(clippy::needless_range_loop)]

use std::array::from_fn;

use glam::{DMat3, DVec3, Quat, Vec3};

use super::draw_states::DrawStates;
use super::fixed_position::{is_within_reach, nearest_step};
use super::{BoundingSphere, FixedPosition, GpuObject, OrientedBox, RejectionReason};
use crate::command::DrawState;
use crate::scene::{Bounds, SceneRef, is_unit};

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

impl Default for ObjectDraw {
    fn default() -> Self {
        Self { mesh: 0, material: 0, state: DrawState::PLAIN }
    }
}

/// What every view needs to know of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ObjectDescription {
    pub(super) gpu_object: GpuObject,
    pub(super) bounds: BoundingSphere,
    pub(super) draw: ObjectDraw,
}

/// The most objects that are described at once.
pub(super) const LANES: usize = 8;

/// One number of each object.
type Lane<T> = [T; LANES];

/// Describes objects among the [`LANES`] from `first` on: bit `b` of `mask` stands for the object `first + b`. Calls `put` with the
/// index of each, and its description, or why it cannot be drawn.
///
/// What is computed is computed in loops over arrays of a fixed length, which compile to vector instructions.
#[inline(always)]
pub(super) fn describe_objects(
    scene: &SceneRef<'_>,
    draw_states: &DrawStates,
    first: usize,
    mask: u8,
    mut put: impl FnMut(usize, Result<ObjectDescription, RejectionReason>),
) {
    let inputs = ObjectInputs::gather(scene, first);
    let orientations = normalized(&inputs.orientations);
    let offsets = rotated(&orientations, &inputs.scales, &inputs.centers);
    let (centers, radii) = bounding_spheres(&inputs, &offsets);
    let is_valid = inputs.are_valid(&radii);
    let steps = nearest_steps(&inputs.positions);

    for lane in (0..LANES).filter(|lane| mask >> lane & 1 == 1) {
        let object = first + lane;
        let (mesh, material, scale) = (scene.meshes[object], scene.materials[object], scene.scales[object]);
        let description = match draw_states.get(mesh, material, scale) {
            Some(state) if is_valid[lane] => {
                let (position_low, position_high) =
                    FixedPosition::from_steps([steps[0][lane], steps[1][lane], steps[2][lane]]).halves();
                let gpu_object = GpuObject {
                    position_low,
                    material: material.index(),
                    position_high,
                    padding: 0,
                    orientation: from_fn(|axis| orientations[axis][lane]),
                    scale: scale.to_array(),
                    object: object as u32,
                };
                let center = from_fn::<_, 3, _>(|axis| centers[axis][lane]).into();
                let bounds = BoundingSphere { center, radius: radii[lane] };
                let draw = ObjectDraw { mesh: mesh.index(), material: material.index(), state };
                Ok(ObjectDescription { gpu_object, bounds, draw })
            }
            _ => Err(rejection_reason(scene, object)),
        };
        put(object, description);
    }
}

/// The positions in fixed point.
#[inline(always)]
fn nearest_steps(positions: &[Lane<f64>; 3]) -> [Lane<i64>; 3] {
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
fn rejection_reason(scene: &SceneRef<'_>, object: usize) -> RejectionReason {
    let [x, y, z, w] = scene.orientations[object].to_array();
    // Rounded as where it was found to be invalid.
    let is_rotation = is_unit(x * x + y * y + z * z + w * w);
    if !is_rotation || !scene.transform_is_valid(object) {
        RejectionReason::InvalidTransform
    } else if FixedPosition::new(scene.positions[object]).is_none() {
        RejectionReason::OutOfReach
    } else if scene.assets.get(scene.meshes[object]).is_err() {
        RejectionReason::StaleMesh
    } else if scene.assets.get(scene.materials[object]).is_err() {
        RejectionReason::StaleMaterial
    } else {
        RejectionReason::InvalidBounds
    }
}

/// The numbers that objects are described by: an array for each coordinate.
struct ObjectInputs {
    positions: [Lane<f64>; 3],
    orientations: [Lane<f32>; 4],
    scales: [Lane<f32>; 3],
    /// The centres and radii of the bounds, in object space.
    centers: [Lane<f32>; 3],
    radii: Lane<f32>,
}

impl ObjectInputs {
    /// The numbers of the objects from `first` on; zeros in lanes without an object.
    #[inline(always)]
    fn gather(scene: &SceneRef<'_>, first: usize) -> Self {
        let (positions, orientations) = (&scene.positions[first..], &scene.orientations[first..]);
        let (scales, bounds) = (&scene.scales[first..], &scene.bounds[first..]);
        let chunks = (positions.first_chunk(), orientations.first_chunk(), scales.first_chunk(), bounds.first_chunk());
        if let (Some(positions), Some(orientations), Some(scales), Some(bounds)) = chunks {
            Self::of(positions, orientations, scales, bounds)
        } else {
            Self::of(&padded(positions), &padded(orientations), &padded(scales), &padded(bounds))
        }
    }

    #[inline(always)]
    fn of(positions: &Lane<DVec3>, orientations: &Lane<Quat>, scales: &Lane<Vec3>, bounds: &Lane<Bounds>) -> Self {
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

    /// Whether objects have valid transforms and bounds. `world_radii` are those of their bounding spheres.
    #[inline(always)]
    fn are_valid(&self, world_radii: &Lane<f32>) -> Lane<bool> {
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
        valid
    }
}

/// The numbers of one lane.
#[inline(always)]
fn lane_of<T: Copy + Default, const N: usize>(numbers: &[Lane<T>; N], lane: usize) -> [T; N] {
    let mut of_lane = [T::default(); N];
    for index in 0..N {
        of_lane[index] = numbers[index][lane];
    }
    of_lane
}

/// The first entries of a column; defaults in lanes beyond its end.
#[cold]
fn padded<T: Copy + Default>(column: &[T]) -> Lane<T> {
    let mut lanes = [T::default(); LANES];
    for (lane, entry) in lanes.iter_mut().zip(column) {
        *lane = *entry;
    }
    lanes
}

/// Normalizes quaternions whose lengths differ from 1 by no more than [`is_unit`] allows.
///
/// Two steps of Newton's method for 1/√x, starting at 1, reduce an error e of the squared length to less than e⁴, which
/// is below f32's precision, and take a fraction of the time of a square root and a division. They run in f64, because
/// an error of one rounding in the length moves rotated vectors by four.
#[inline(always)]
fn normalized(orientations: &[Lane<f32>; 4]) -> [Lane<f32>; 4] {
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
fn rotated(orientations: &[Lane<f32>; 4], scales: &[Lane<f32>; 3], vectors: &[Lane<f32>; 3]) -> [Lane<f32>; 3] {
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

/// The bounding spheres of objects in the world: centres and radii. The radii include an upper bound of the distance in metres
/// between an object's computed centre and where devices draw it. If a sphere is not finite, its radius is NaN or infinite.
#[inline(always)]
fn bounding_spheres(inputs: &ObjectInputs, offsets: &[Lane<f32>; 3]) -> ([Lane<f64>; 3], Lane<f32>) {
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

/// An upper bound of the distance in metres between an object's computed centre and where devices draw it. `offset` is the sum of
/// the absolute coordinates of the rotated offset of the centre from the object's position.
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
    let bounds = scene.bounds[object];
    let mesh = scene.assets.get(scene.meshes[object]).ok().filter(|mesh| mesh.bounds() == bounds);
    let Some(mesh) = mesh else {
        let radius = f64::from(sphere.radius);
        return OrientedBox { half_axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius), margin: 0.0 };
    };
    let [low, high] = mesh.corners().map(Vec3::as_dvec3);
    let center = bounds.center.as_dvec3();
    let scale = scene.scales[object];
    let half = (high - center).max(center - low) * scale.abs().as_dvec3();
    let rotation = DMat3::from_quat(scene.orientations[object].as_dquat().normalize());
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
