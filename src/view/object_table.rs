//! What every view needs to know of every object, worked out once a frame.

use std::ops::Range;

use glam::Quat;
use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::{FixedPosition, RejectionReason, Rejections, Spheres, WorldBounds};
use crate::blocks::parts;
use crate::command::{Cull, DrawState};
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
}

/// What the table holds of [`ObjectTable::BLOCK`] objects; object `index` is at `index % BLOCK`.
#[derive(Clone, Debug)]
pub struct ObjectBlock {
    /// What is uploaded.
    pub records: [ObjectRecord; ObjectTable::BLOCK],
    /// Where they are.
    pub spheres: Spheres,
    /// How they are drawn.
    pub draws: [ObjectDraw; ObjectTable::BLOCK],
}

impl Default for ObjectBlock {
    fn default() -> Self {
        Self {
            records: [bytemuck::Zeroable::zeroed(); ObjectTable::BLOCK],
            spheres: Spheres::default(),
            draws: [ObjectDraw::default(); ObjectTable::BLOCK],
        }
    }
}

impl ObjectTable {
    /// Objects in a block.
    pub const BLOCK: usize = Spheres::COUNT;

    /// Makes room for `objects` objects.
    pub fn reset(&mut self, objects: usize) {
        self.length = objects;
        let blocks = self.block_count().max(self.blocks.len());
        self.blocks.resize_with(blocks, RwLock::default);
        // What lies behind the last object is tested with it, and is not to be seen.
        if let Some(last) = self.blocks.get_mut(objects / Self::BLOCK) {
            let spheres = &mut last.get_mut().spheres;
            (objects % Self::BLOCK..Self::BLOCK).for_each(|entry| spheres.set(entry, WorldBounds::NOTHING));
        }
        self.rejections = Rejections::default();
    }

    /// Fills in the objects of `range`.
    pub fn fill(&self, scene: &SceneRef<'_>, range: Range<usize>) {
        for (index, part) in parts(range, Self::BLOCK) {
            let mut block = self.blocks[index].write();
            let ObjectBlock { records, spheres, draws } = &mut **block;
            for object in part {
                let entry = object % Self::BLOCK;
                match describe(scene, object) {
                    Ok((record, bounds, draw)) => {
                        records[entry] = record;
                        spheres.set(entry, bounds);
                        draws[entry] = draw;
                    }
                    Err(reason) => {
                        spheres.set(entry, WorldBounds::NOTHING);
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
        self.length.div_ceil(Self::BLOCK)
    }

    /// What is uploaded, 64 bytes an object: the first object of a block, and the records of all of them.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn records_of(&self, block: usize) -> (usize, MappedRwLockReadGuard<'_, [ObjectRecord]>) {
        let first = block * Self::BLOCK;
        let count = (self.length - first).min(Self::BLOCK);
        (first, RwLockReadGuard::map(self.block(block), |block| &block.records[..count]))
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

/// An object as shaders read it. Its position is in fixed point, so that it can be taken relative to any view's camera
/// exactly: one table serves all views, wherever they are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ObjectRecord {
    /// The lower halves of the position's three coordinates.
    pub position_low: [u32; 3],
    /// Its material's slot.
    pub material: u32,
    /// The upper halves of the position's three coordinates.
    pub position_high: [i32; 3],
    /// Keeps what follows at a multiple of 16 bytes, as WGSL wants it.
    pub padding: u32,
    /// From object space to the world's axes: x, y, z, w.
    pub orientation: [f32; 4],
    /// Along the object's own axes.
    pub scale: [f32; 3],
    /// Its index.
    pub object: u32,
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

fn describe(scene: &SceneRef<'_>, object: usize) -> Result<(ObjectRecord, WorldBounds, ObjectDraw), RejectionReason> {
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
    // Grown by what rounding can have turned and moved the centre, and shortened the radius: some ten roundings of 2⁻²⁴,
    // which is less than 1e-6, in the terms of the rotation; and one each in the product and in the sum. The sum of the
    // offset's coordinates is no less than its length.
    let radius = bounds.radius * scale.abs().max_element() * 1.000_001 + offset.abs().element_sum() * 1e-6;
    // An offset that is not finite makes a radius that is none either.
    if !(bounds.radius >= 0.0 && radius < f32::INFINITY) {
        return Err(RejectionReason::InvalidBounds);
    }
    let center = position + offset.as_dvec3();

    let slots = (scene.meshes[object].index(), scene.materials[object].index());
    let (position_low, position_high) = fixed.halves();
    let record = ObjectRecord {
        position_low,
        material: slots.1,
        position_high,
        padding: 0,
        orientation: orientation.to_array(),
        scale: scale.to_array(),
        object: object as u32,
    };
    let draw = ObjectDraw { mesh: slots.0, material: slots.1, state: state_of(mesh, material, scale) };
    Ok((record, WorldBounds { center, radius }, draw))
}

/// The same rotation at unit length, of one that has drifted from it as little as [`is_unit`] allows.
///
/// Two steps of Newton's method for 1/√x from 1: of an error e in the square of the length they leave less than e⁴, which is
/// below what an f32 can say, and they take a fraction of the time of a root and a division.
#[inline]
fn normalized(turn: Quat) -> Quat {
    let closer = |turn: Quat| turn * (1.5 - 0.5 * turn.length_squared());
    closer(closer(turn))
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
