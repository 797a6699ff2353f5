//! What every view needs to know of every object, worked out once a frame.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::frustum::Judged;
use super::{
    BoundingBoxes, BoundingSphere, BoundingSpheres, FixedPosition, Frustum, GpuObject, OrientedBox, RejectionReason,
    Rejections,
};
use crate::chunked_array::block_ranges;
use crate::command::{Cull, DrawState};
use crate::quality::CullingVolume;
use crate::scene::{Material, Mesh, SceneRef, is_unit};

/// The frame's objects: what is uploaded, where each is, and how each is drawn. Objects that cannot be drawn are counted
/// and left out.
///
/// They lie in blocks, each behind a lock of its own: jobs that fill different blocks never wait for each other, and one
/// uncontended lock a block is a fraction of a nanosecond an object.
#[derive(Debug, Default)]
pub struct ObjectTable {
    blocks: Vec<RwLock<Box<ObjectBlock>>>,
    rejections: Rejections,
    length: usize,
    culling: CullingVolume,
    /// The volume that blocks have boxes for.
    held: CullingVolume,
}

/// What the table holds of [`ObjectTable::BLOCK_SIZE`] objects; object `index` is at `index % BLOCK`.
#[derive(Clone, Debug)]
pub struct ObjectBlock {
    /// What is uploaded.
    pub gpu_objects: [GpuObject; ObjectTable::BLOCK_SIZE],
    /// Where they are.
    pub spheres: BoundingSpheres,
    /// The boxes around them, where the table is told to hold some.
    pub boxes: Option<BoundingBoxes>,
    /// How they are drawn.
    pub draws: [ObjectDraw; ObjectTable::BLOCK_SIZE],
}

impl ObjectBlock {
    /// Which of the objects `entries`, of one word of [`Frustum::WORD`], a view may see: a bit each, from the lowest. Never
    /// left out is one that it does see; those that cannot be drawn are.
    ///
    /// The sphere is asked for first, whatever volume it is: it tells of most objects whether they are outside or inside as a
    /// whole, and only of the others the box is asked for.
    ///
    /// # Panics
    /// If there are no such objects, or none.
    pub fn visible(&self, frustum: &Frustum, volume: CullingVolume, entries: Range<usize>) -> u64 {
        let place = entries.start % Frustum::WORD;
        let first = entries.start - place;
        if volume == CullingVolume::None {
            let drawn = |bits, (offset, &radius): (usize, &f32)| bits | u64::from(radius >= 0.0) << offset;
            return self.spheres.radii()[entries].iter().enumerate().fold(0, drawn);
        }
        if entries.len() < FEW {
            let intersects_sphere = |entry: usize| {
                let BoundingSphere { center, radius } = self.spheres.get(entry);
                frustum.intersects_sphere(center, radius)
            };
            let one = |bits, entry: usize| bits | u64::from(intersects_sphere(entry)) << (entry - entries.start);
            return self.kept(frustum, first, entries.clone().fold(0, one) << place) >> place;
        }
        match &self.boxes {
            None => frustum.intersects_spheres(&self.spheres, first) >> place,
            Some(_) => {
                let Judged { seen, whole } = frustum.judge_each(&self.spheres, first);
                let asked = (u64::MAX >> (Frustum::WORD - entries.len())) << place;
                (seen & whole | self.kept(frustum, first, seen & !whole & asked)) >> place
            }
        }
    }

    /// Those of the objects `asked` for, of the word from `first` on, of whose boxes any may be seen; all of them where there are
    /// no boxes.
    fn kept(&self, frustum: &Frustum, first: usize, asked: u64) -> u64 {
        self.boxes.as_ref().map_or(asked, |boxes| frustum.intersects_boxes(&self.spheres, boxes, first, asked))
    }
}

/// Fewer objects than these are tested one by one: it takes less time than to test a whole word of them.
const FEW: usize = 12;

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

    /// Says what stands for objects when views are asked for them, from the next [`ObjectTable::reset`] on; spheres unless it is
    /// said otherwise.
    pub fn configure(&mut self, volume: CullingVolume) {
        self.culling = volume;
    }

    /// Makes room for `objects` objects.
    pub fn reset(&mut self, objects: usize) {
        self.length = objects;
        let before = self.blocks.len();
        let blocks = self.block_count().max(before);
        self.blocks.resize_with(blocks, RwLock::default);
        // Blocks are only touched where something is to change.
        let right = if self.held == self.culling { before } else { 0 };
        for block in &mut self.blocks[right..] {
            block.get_mut().boxes = BoundingBoxes::new(self.culling);
        }
        self.held = self.culling;
        // What lies behind the last object is tested with it, and is not to be seen.
        if let Some(last) = self.blocks.get_mut(objects / Self::BLOCK_SIZE) {
            let spheres = &mut last.get_mut().spheres;
            (objects % Self::BLOCK_SIZE..Self::BLOCK_SIZE)
                .for_each(|entry| spheres.set(entry, BoundingSphere::NOTHING));
        }
        self.rejections = Rejections::default();
    }

    /// Fills in the objects of `range`.
    pub fn fill(&self, scene: &SceneRef<'_>, range: Range<usize>) {
        for (index, part) in block_ranges(range, Self::BLOCK_SIZE) {
            let mut block = self.blocks[index].write();
            let ObjectBlock { gpu_objects, spheres, boxes, draws } = &mut **block;
            for object in part {
                let entry = object % Self::BLOCK_SIZE;
                match describe(scene, object) {
                    Ok((record, bounds, draw)) => {
                        gpu_objects[entry] = record;
                        spheres.set(entry, bounds);
                        if let Some(boxes) = boxes {
                            boxes.set(entry, &box_of(scene, object, bounds));
                        }
                        draws[entry] = draw;
                    }
                    Err(reason) => {
                        spheres.set(entry, BoundingSphere::NOTHING);
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

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The number of blocks that the objects fill.
    pub fn block_count(&self) -> usize {
        self.length.div_ceil(Self::BLOCK_SIZE)
    }

    /// What is uploaded, 64 bytes an object: the first object of a block, and the gpu_objects of all of them.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn gpu_objects(&self, block: usize) -> (usize, MappedRwLockReadGuard<'_, [GpuObject]>) {
        let first = block * Self::BLOCK_SIZE;
        let count = (self.length - first).min(Self::BLOCK_SIZE);
        (first, RwLockReadGuard::map(self.block(block), |block| &block.gpu_objects[..count]))
    }

    /// All there is of a block of objects.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn block(&self, index: usize) -> RwLockReadGuard<'_, Box<ObjectBlock>> {
        self.blocks[index].read()
    }

    /// What was left out, and why.
    pub fn rejections(&self) -> &Rejections {
        &self.rejections
    }
}

/// How an object is drawn, as slots and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectDraw {
    /// Its mesh's slot.
    pub mesh: u32,
    /// Its material's slot.
    pub material: u32,
    /// Its fixed-function state.
    pub state: DrawState,
}

impl Default for ObjectDraw {
    fn default() -> Self {
        Self { mesh: 0, material: 0, state: DrawState::PLAIN }
    }
}

fn describe(scene: &SceneRef<'_>, object: usize) -> Result<(GpuObject, BoundingSphere, ObjectDraw), RejectionReason> {
    let (position, scale, turn) = (scene.positions[object], scene.scales[object], scene.orientations[object]);
    let Some(fixed) = FixedPosition::new(position) else {
        let is_valid = scene.transform_is_valid(object);
        return Err(if is_valid { RejectionReason::OutOfReach } else { RejectionReason::InvalidTransform });
    };
    if !(scale.is_finite() && is_unit(turn.length_squared())) {
        return Err(RejectionReason::InvalidTransform);
    }
    let orientation = normalized(turn);
    let mesh = scene.assets.get(scene.meshes[object]).map_err(|_| RejectionReason::StaleMesh)?;
    let material = scene.assets.get(scene.materials[object]).map_err(|_| RejectionReason::StaleMaterial)?;

    let bounds = scene.bounds[object];
    let offset = orientation * (scale * bounds.center);
    let center = position + offset.as_dvec3();
    let radius = bounds.radius * scale.abs().max_element() * 1.000_001 + misplaced(center, offset) as f32;
    // An offset that is not finite makes a radius that is none either.
    if !(bounds.radius >= 0.0 && radius <= LARGEST) {
        return Err(RejectionReason::InvalidBounds);
    }

    let slots = (scene.meshes[object].index(), scene.materials[object].index());
    let (position_low, position_high) = fixed.halves();
    let record = GpuObject {
        position_low,
        material: slots.1,
        position_high,
        padding: 0,
        orientation: orientation.to_array(),
        scale: scale.to_array(),
        object: object as u32,
    };
    let draw = ObjectDraw { mesh: slots.0, material: slots.1, state: state_of(mesh, material, scale) };
    Ok((record, BoundingSphere { center, radius }, draw))
}

/// How far an object's centre may be from where it is drawn, in metres.
///
/// The offset is turned in f32: some 40 roundings of 2⁻²⁴ at most (thirteen of the orientation's length and direction and of the
/// scaled centre, 24 of the products and sums), and the sum of its coordinates is no less than its length; 2⁻¹⁸ is 64 of them.
/// Each coordinate of the centre, in f64, is off by half a step, 2⁻⁵³ of it. And where the object is drawn relative to a camera is
/// off by half a step of fixed point for each of the two, 2⁻³⁰ m a coordinate. √3 times as much in space is less than twice.
#[inline]
fn misplaced(center: DVec3, offset: Vec3) -> f64 {
    let turned = f64::from(offset.abs().element_sum()) * 2_f64.powi(-18);
    turned + center.abs().max_element() * 2_f64.powi(-52) + 2_f64.powi(-29)
}

/// The box around an object's mesh, or around its sphere where the engine gave it other bounds than its mesh has.
///
/// What is rounded in f64 is far below what [`misplaced`] and [`Frustum::intersects_boxes`] allow.
fn box_of(scene: &SceneRef<'_>, object: usize, sphere: BoundingSphere) -> OrientedBox {
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
    let turn = DMat3::from_quat(scene.orientations[object].as_dquat().normalize());
    let offset = scale * bounds.center;
    OrientedBox {
        half_axes: [turn.x_axis * half.x, turn.y_axis * half.y, turn.z_axis * half.z],
        // Turning it changes no coordinate by more than its length.
        margin: misplaced(sphere.center, offset),
    }
}

/// The largest radius in metres of an object in the world. What is larger leaves the range of f32 on its way to clip space: where
/// the field of view is the narrowest there is, a place is multiplied by some 1e6, and by a hundred more where a picture is that
/// much higher than wide.
const LARGEST: f32 = 1e30;

/// The same rotation at unit length, of one that has drifted from it as little as [`is_unit`] allows.
///
/// Two steps of Newton's method for 1/√x from 1: of an error e in the square of the length they leave less than e⁴, which is
/// below what an f32 can say, and they take a fraction of the time of a root and a division. In f64, since a length that is off by
/// one rounding moves what is turned by four.
#[inline]
fn normalized(turn: Quat) -> Quat {
    let closer = |turn: DQuat| turn * (1.5 - 0.5 * turn.length_squared());
    closer(closer(turn.as_dquat())).as_quat()
}

fn state_of(mesh: &Mesh, material: &Material, scale: glam::Vec3) -> DrawState {
    let mirrored = scale.is_negative_bitmask().count_ones() % 2 == 1;
    let cull = match (material.double_sided, mirrored) {
        (true, _) => Cull::Nothing,
        (false, false) => Cull::Back,
        (false, true) => Cull::Front,
    };
    DrawState::new(mesh.topology(), cull, material.blend)
}
