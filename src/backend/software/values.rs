//! What twins are given of views, objects and lights: as devices get it, and as the scene says.

use std::ops::Range;
use std::sync::OnceLock;

use glam::DVec3;

use super::number::CameraPlace;
use crate::process::{LightValues, ObjectValues, ViewValues};
use crate::quality::TransformPrecision;
use crate::raster::{Quaternion, Real, Vector, Vector3};
use crate::scene::{Light, LightKind, Projection, SceneRef, ViewKind};
use crate::view::{FixedPosition, GpuLight, GpuObject, GpuView, ObjectTable, RenderView};

/// A frame's objects as a device gets them.
pub(super) struct Uploaded {
    /// A block of the table each.
    blocks: Vec<OnceLock<Box<[GpuObject]>>>,
}

impl Uploaded {
    pub(super) fn new(scene: &SceneRef<'_>) -> Self {
        let mut blocks = Vec::new();
        blocks.resize_with(scene.object_count().div_ceil(ObjectTable::BLOCK_SIZE), OnceLock::new);
        Self { blocks }
    }

    pub(super) fn upload(&self, table: &ObjectTable, blocks: Range<usize>) {
        for block in blocks {
            if let Some(place) = self.blocks.get(block) {
                place.get_or_init(|| Box::from(&*table.gpu_objects(block).1));
            }
        }
    }

    pub(super) fn get(&self, index: usize, camera: &CameraPlace) -> Option<ObjectValues<f32>> {
        let block = self.blocks.get(index / ObjectTable::BLOCK_SIZE)?.get()?;
        let record = block.get(index % ObjectTable::BLOCK_SIZE)?;
        let place = FixedPosition::from_halves(record.position_low, record.position_high);
        let (from, taken_last) = match camera.transforms {
            TransformPrecision::CameraRelative => (camera.fixed, [0.0; 3]),
            TransformPrecision::Absolute => (FixedPosition::ORIGIN, camera.fixed.relative_to(FixedPosition::ORIGIN)),
        };
        Some(ObjectValues {
            origin: Vector(place.relative_to(from)),
            camera: Vector(taken_last),
            orientation: Quaternion(record.orientation),
            scale: Vector(record.scale),
            material: record.material,
        })
    }
}

/// An object as the scene says.
pub(super) struct Placed {
    position: DVec3,
    orientation: Quaternion<f64>,
    scale: Vector3<f64>,
    material: u32,
}

impl Placed {
    pub(super) fn new(scene: &SceneRef<'_>, object: usize) -> Self {
        Self {
            position: scene.positions[object],
            orientation: Quaternion::of(scene.orientations[object].as_dquat().normalize()),
            scale: Vector3::of_single(scene.scales[object]),
            material: scene.materials[object].index(),
        }
    }

    pub(super) fn relative_to(&self, camera: &CameraPlace) -> ObjectValues<f64> {
        let Self { position, orientation, scale, material } = *self;
        ObjectValues {
            origin: Vector3::of(position - camera.exact),
            camera: Vector3::zero(),
            orientation,
            scale,
            material,
        }
    }
}

/// A view as a device gets it.
pub(super) fn view_of_record(view: &RenderView, record: &GpuView) -> ViewValues<f32> {
    let axis = |axis: glam::Vec3| Vector(axis.to_array());
    ViewValues {
        clip_from_relative: record.clip_from_relative.to_cols_array_2d().map(Vector),
        right: axis(record.right),
        up: axis(record.up),
        forward: axis(record.forward),
        near: record.near,
        far: record.far,
        size: size_of(view),
        projection: view.camera.projection,
        clamps_near: clamps_near(view),
        ambient: axis(record.ambient),
    }
}

/// A view as its camera says, in f64.
pub(super) fn exact_view(view: &RenderView, scene: &SceneRef<'_>) -> ViewValues<f64> {
    let camera = &view.camera;
    let orientation = camera.orientation.as_dquat().normalize();
    let [width, height] = camera.size.map(f64::from);
    let half = half_height(camera.projection);
    ViewValues {
        clip_from_relative: view.precise_clip_from_relative().to_cols_array_2d().map(Vector),
        right: Vector3::of(orientation * DVec3::X * half * (width / height)),
        up: Vector3::of(orientation * DVec3::Y * half),
        forward: Vector3::of(orientation * DVec3::NEG_Z),
        near: f64::from(camera.near),
        far: f64::from(camera.far),
        size: size_of(view),
        projection: camera.projection,
        clamps_near: clamps_near(view),
        ambient: Vector3::of_single(scene.ambient),
    }
}

/// Half the picture's height, in metres; in perspective at a distance of 1.
fn half_height(projection: Projection) -> f64 {
    match projection {
        Projection::Perspective { field_of_view } => (f64::from(field_of_view) * 0.5).tan(),
        Projection::Orthographic { height } => f64::from(height) * 0.5,
        Projection::Paraboloid => 1.0,
    }
}

fn size_of(view: &RenderView) -> [usize; 2] {
    view.camera.size.map(|pixels| pixels as usize)
}

fn clamps_near(view: &RenderView) -> bool {
    matches!(view.camera.projection, Projection::Orthographic { .. }) && view.kind() == ViewKind::Shadow
}

/// A light as a device gets it.
pub(super) fn light_of_record<R: Real>(record: &GpuLight) -> LightValues<R> {
    let real = |value: f32| R::of(f64::from(value));
    let kind = LightKind::ALL.into_iter().find(|kind| *kind as u32 == record.kind);
    LightValues {
        position: Vector3::of_single(record.position),
        kind: kind.unwrap_or(LightKind::Point),
        direction: Vector3::of_single(record.direction),
        range: real(record.range),
        intensity: Vector3::of_single(record.intensity),
        cone_begin: real(record.cone_begin),
        cone_end: real(record.cone_end),
        shadow_layer: (record.shadow_layer != GpuLight::NO_SHADOW_MAP).then_some(record.shadow_layer as usize),
        shadow_half: real(record.shadow_half),
        shadow_near: real(record.shadow_near),
        shadow_orientation: Quaternion(record.shadow_orientation.to_array().map(real)),
    }
}

/// A light as the scene says: what [`GpuLight::new`] rounds is not rounded here.
pub(super) fn exact_light(
    record: &GpuLight,
    light: &Light,
    camera: &CameraPlace,
    map: Option<&RenderView>,
) -> LightValues<f64> {
    let relative = |position: DVec3| Vector3::of(position - camera.exact);
    let mut values = light_of_record(record);
    let (position, direction) = match *light {
        Light::Directional { direction, .. } => (None, Some(direction)),
        Light::Point { position, .. } => (Some(position), None),
        Light::Spot { position, direction, inner_angle, outer_angle, .. } => {
            values.cone_begin = f64::from(inner_angle).cos();
            values.cone_end = f64::from(outer_angle).cos();
            (Some(position), Some(direction))
        }
        Light::Hemispherical { position, direction, .. } => (Some(position), Some(direction)),
    };
    if let Some(position) = position {
        values.position = relative(position);
    }
    if let Some(direction) = direction {
        values.direction = Vector3::of(direction.as_dvec3().normalize());
    }
    if let Some(map) = map {
        values.shadow_half = half_height(map.camera.projection);
        values.shadow_orientation = Quaternion::of(map.camera.orientation.as_dquat().normalize());
        if let Projection::Orthographic { .. } = map.camera.projection {
            values.position = relative(map.camera.position);
        }
    }
    values
}
