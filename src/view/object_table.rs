//! The table of a frame's objects, which all views share.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::frustum::Classified;
use super::{
    BoundingBoxes, BoundingSphere, BoundingSpheres, FixedPosition, Frustum, GpuObject, OrientedBox, RejectionReason,
    Rejections,
};
use crate::chunked_array::block_ranges;
use crate::command::{Cull, DrawState};
use crate::quality::CullingVolume;
use crate::scene::{Material, Mesh, SceneRef, is_unit};

/// The frame's objects: their GPU layout, their bounds, and how they are drawn. Objects that cannot be drawn are
/// rejected.
///
/// Objects are in blocks, each with its own lock: jobs that fill different blocks never wait for each other, and one
/// uncontended lock per block costs a fraction of a nanosecond per object.
#[derive(Debug, Default)]
pub struct ObjectTable {
    blocks: Vec<RwLock<Box<ObjectBlock>>>,
    rejections: Rejections,
    length: usize,
    /// The culling volume from the next [`ObjectTable::reset`] on.
    culling: CullingVolume,
    /// The culling volume that the blocks' boxes are for.
    boxes_volume: CullingVolume,
}

/// [`ObjectTable::BLOCK_SIZE`] objects of the table; object `index` is at `index % BLOCK_SIZE`.
#[derive(Clone, Debug)]
pub struct ObjectBlock {
    /// The GPU layouts to upload.
    pub gpu_objects: [GpuObject; ObjectTable::BLOCK_SIZE],
    /// The bounding spheres.
    pub spheres: BoundingSpheres,
    /// The bounding boxes, if the culling volume is a box.
    pub boxes: Option<BoundingBoxes>,
    /// The meshes, materials and states.
    pub draws: [ObjectDraw; ObjectTable::BLOCK_SIZE],
}

impl ObjectBlock {
    /// Tests the objects `entries`, all in one word of [`Frustum::WORD`] objects, against a frustum. Returns a mask of
    /// the objects that a view may see; bit 0 is `entries.start`. The mask contains every visible object and no rejected
    /// one; it may contain a few invisible ones.
    ///
    /// Spheres are tested first, whatever the volume: they decide most objects to be entirely outside or inside. Only
    /// the others' boxes are tested.
    ///
    /// # Panics
    /// If `entries` is empty or not within the block.
    pub fn visible(&self, frustum: &Frustum, volume: CullingVolume, entries: Range<usize>) -> u64 {
        let offset = entries.start % Frustum::WORD;
        let first = entries.start - offset;
        if volume == CullingVolume::None {
            let is_valid = |mask, (bit, &radius): (usize, &f32)| mask | u64::from(radius >= 0.0) << bit;
            return self.spheres.radii()[entries].iter().enumerate().fold(0, is_valid);
        }
        if entries.len() < WORD_TEST_THRESHOLD {
            let intersects = |entry: usize| {
                let BoundingSphere { center, radius } = self.spheres.get(entry);
                frustum.intersects_sphere(center, radius)
            };
            let test = |mask, entry: usize| mask | u64::from(intersects(entry)) << (entry - entries.start);
            return self.test_boxes(frustum, first, entries.clone().fold(0, test) << offset) >> offset;
        }
        match &self.boxes {
            None => frustum.intersects_spheres(&self.spheres, first) >> offset,
            Some(_) => {
                let Classified { intersecting, inside } = frustum.classify_spheres(&self.spheres, first);
                let tested = (u64::MAX >> (Frustum::WORD - entries.len())) << offset;
                (intersecting & inside | self.test_boxes(frustum, first, intersecting & !inside & tested)) >> offset
            }
        }
    }

    /// The `candidates`, in the word from `first` on, whose boxes intersect the frustum; all of them if there are no
    /// boxes.
    fn test_boxes(&self, frustum: &Frustum, first: usize, candidates: u64) -> u64 {
        self.boxes
            .as_ref()
            .map_or(candidates, |boxes| frustum.intersects_boxes(&self.spheres, boxes, first, candidates))
    }
}

/// Fewer objects than this are tested one by one, which takes less time than testing a whole word.
const WORD_TEST_THRESHOLD: usize = 12;

impl Default for ObjectBlock {
    fn default() -> Self {
        Self {
            gpu_objects: [bytemuck::Zeroable::zeroed(); ObjectTable::BLOCK_SIZE],
            spheres: BoundingSpheres::default(),
            boxes: None,
            draws: [ObjectDraw::default(); ObjectTable::BLOCK_SIZE],
        }
    }
}

impl ObjectTable {
    /// Objects in a block.
    pub const BLOCK_SIZE: usize = BoundingSpheres::COUNT;

    /// Sets the bounding volume that culling tests, from the next [`ObjectTable::reset`] on. The default is spheres.
    pub fn configure(&mut self, volume: CullingVolume) {
        self.culling = volume;
    }

    /// Resizes the table for `objects` objects, and clears its rejections.
    pub fn reset(&mut self, objects: usize) {
        self.length = objects;
        let old_count = self.blocks.len();
        let blocks = self.block_count().max(old_count);
        self.blocks.resize_with(blocks, RwLock::default);
        // Blocks whose boxes are already right stay untouched.
        let up_to_date = if self.boxes_volume == self.culling { old_count } else { 0 };
        for block in &mut self.blocks[up_to_date..] {
            block.get_mut().boxes = BoundingBoxes::new(self.culling);
        }
        self.boxes_volume = self.culling;
        // Entries after the last object are tested with it, and must not be visible.
        if let Some(last) = self.blocks.get_mut(objects / Self::BLOCK_SIZE) {
            let spheres = &mut last.get_mut().spheres;
            (objects % Self::BLOCK_SIZE..Self::BLOCK_SIZE).for_each(|entry| spheres.set(entry, BoundingSphere::EMPTY));
        }
        self.rejections = Rejections::default();
    }

    /// Fills in the objects in `range`.
    pub fn fill(&self, scene: &SceneRef<'_>, range: Range<usize>) {
        for (index, part) in block_ranges(range, Self::BLOCK_SIZE) {
            let mut block = self.blocks[index].write();
            let ObjectBlock { gpu_objects, spheres, boxes, draws } = &mut **block;
            for object in part {
                let entry = object % Self::BLOCK_SIZE;
                match entry_of(scene, object) {
                    Ok((gpu_object, bounds, draw)) => {
                        gpu_objects[entry] = gpu_object;
                        spheres.set(entry, bounds);
                        if let Some(boxes) = boxes {
                            boxes.set(entry, &bounding_box(scene, object, bounds));
                        }
                        draws[entry] = draw;
                    }
                    Err(reason) => {
                        spheres.set(entry, BoundingSphere::EMPTY);
                        self.rejections.count(reason, object);
                    }
                }
            }
        }
    }

    /// The number of objects.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there are no objects.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The number of blocks that the objects fill.
    pub fn block_count(&self) -> usize {
        self.length.div_ceil(Self::BLOCK_SIZE)
    }

    /// The first object of a block, and the GPU layouts of all its objects, 64 bytes each.
    ///
    /// # Panics
    /// If `block` is not below [`ObjectTable::block_count`].
    pub fn gpu_objects(&self, block: usize) -> (usize, MappedRwLockReadGuard<'_, [GpuObject]>) {
        let first = block * Self::BLOCK_SIZE;
        let count = (self.length - first).min(Self::BLOCK_SIZE);
        (first, RwLockReadGuard::map(self.block(block), |block| &block.gpu_objects[..count]))
    }

    /// A block of objects.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::block_count`].
    pub fn block(&self, index: usize) -> RwLockReadGuard<'_, Box<ObjectBlock>> {
        self.blocks[index].read()
    }

    /// The objects that were rejected.
    pub fn rejections(&self) -> &Rejections {
        &self.rejections
    }
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

impl Default for ObjectDraw {
    fn default() -> Self {
        Self { mesh: 0, material: 0, state: DrawState::PLAIN }
    }
}

fn entry_of(scene: &SceneRef<'_>, object: usize) -> Result<(GpuObject, BoundingSphere, ObjectDraw), RejectionReason> {
    let (position, scale, orientation) = (scene.positions[object], scene.scales[object], scene.orientations[object]);
    let Some(fixed) = FixedPosition::new(position) else {
        let is_valid = scene.transform_is_valid(object);
        return Err(if is_valid { RejectionReason::OutOfReach } else { RejectionReason::InvalidTransform });
    };
    if !(scale.is_finite() && is_unit(orientation.length_squared())) {
        return Err(RejectionReason::InvalidTransform);
    }
    let orientation = normalized(orientation);
    let mesh = scene.assets.get(scene.meshes[object]).map_err(|_| RejectionReason::StaleMesh)?;
    let material = scene.assets.get(scene.materials[object]).map_err(|_| RejectionReason::StaleMaterial)?;

    let bounds = scene.bounds[object];
    let offset = orientation * (scale * bounds.center);
    let center = position + offset.as_dvec3();
    let radius = bounds.radius * scale.abs().max_element() * 1.000_001 + position_error(center, offset) as f32;
    // An offset that is not finite makes the radius NaN or infinite.
    if !(bounds.radius >= 0.0 && radius <= MAX_RADIUS) {
        return Err(RejectionReason::InvalidBounds);
    }

    let (mesh_slot, material_slot) = (scene.meshes[object].index(), scene.materials[object].index());
    let (position_low, position_high) = fixed.halves();
    let gpu_object = GpuObject {
        position_low,
        material: material_slot,
        position_high,
        padding: 0,
        orientation: orientation.to_array(),
        scale: scale.to_array(),
        object: object as u32,
    };
    let draw = ObjectDraw { mesh: mesh_slot, material: material_slot, state: draw_state(mesh, material, scale) };
    Ok((gpu_object, BoundingSphere { center, radius }, draw))
}

/// An upper bound of the distance in metres between an object's computed centre and where devices draw it.
///
/// The offset is rotated in f32: at most some 40 roundings of 2⁻²⁴ (thirteen of the orientation's length and direction
/// and of the scaled centre, 24 of the products and sums), and the sum of its coordinates is no less than its length;
/// 2⁻¹⁸ is 64 of them. The error of each coordinate of the centre, in f64, is half a step, 2⁻⁵³ of it. The error of the
/// drawn position relative to a camera is half a fixed-point step for each of the two, 2⁻³⁰ m per coordinate. √3 times
/// as much in space is less than twice.
#[inline]
fn position_error(center: DVec3, offset: Vec3) -> f64 {
    let turned = f64::from(offset.abs().element_sum()) * 2_f64.powi(-18);
    turned + center.abs().max_element() * 2_f64.powi(-52) + 2_f64.powi(-29)
}

/// The box around an object's mesh, or around its bounding sphere if the engine's bounds differ from the mesh's.
///
/// Rounding in f64 is far below the tolerances of [`position_error`] and [`Frustum::intersects_boxes`].
fn bounding_box(scene: &SceneRef<'_>, object: usize, sphere: BoundingSphere) -> OrientedBox {
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
    let offset = scale * bounds.center;
    OrientedBox {
        half_axes: [rotation.x_axis * half.x, rotation.y_axis * half.y, rotation.z_axis * half.z],
        // A rotation changes no coordinate by more than the vector's length.
        margin: position_error(sphere.center, offset),
    }
}

/// The largest radius in metres of an object in the world. Larger ones exceed the range of f32 on the way to clip
/// space: the narrowest field of view multiplies positions by some 1e6, and a tall picture by a hundred more.
const MAX_RADIUS: f32 = 1e30;

/// Normalizes a quaternion whose length differs from 1 by no more than [`is_unit`] allows.
///
/// Two steps of Newton's method for 1/√x, starting at 1, reduce an error e of the squared length to less than e⁴, which
/// is below f32's precision, and take a fraction of the time of a square root and a division. They run in f64, because
/// an error of one rounding in the length moves rotated vectors by four.
#[inline]
fn normalized(orientation: Quat) -> Quat {
    let newton_step = |q: DQuat| q * (1.5 - 0.5 * q.length_squared());
    newton_step(newton_step(orientation.as_dquat())).as_quat()
}

fn draw_state(mesh: &Mesh, material: &Material, scale: Vec3) -> DrawState {
    let mirrored = scale.is_negative_bitmask().count_ones() % 2 == 1;
    let cull = match (material.double_sided, mirrored) {
        (true, _) => Cull::Nothing,
        (false, false) => Cull::Back,
        (false, true) => Cull::Front,
    };
    DrawState::new(mesh.topology(), cull, material.blend)
}
