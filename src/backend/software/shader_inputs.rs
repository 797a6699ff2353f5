//! The views, objects and lights that CPU shaders read: from what a device gets, in f32, or from the scene, in f64.

use std::ops::Range;
use std::sync::OnceLock;

use glam::{DVec3, Vec3};

use crate::process::{ShaderLight, ShaderObject, ShaderView};
use crate::quality::TransformPrecision;
use crate::raster::{Quaternion, Real, Vector, Vector3};
use crate::scene::{Light, LightFields, LightKind, Projection, SceneRef};
use crate::view::{FixedPosition, GpuLight, GpuObject, GpuView, ObjectTable, RenderView};

/// A camera's position in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraPosition {
    /// In metres.
    pub(super) exact: DVec3,
    /// As devices have it.
    pub(super) fixed: FixedPosition,
    /// How devices make other positions relative to it.
    pub(super) transforms: TransformPrecision,
}

/// A frame's objects as a device gets them.
pub(super) struct UploadedObjects {
    /// One for each block of the table.
    blocks: Vec<OnceLock<Box<[GpuObject]>>>,
}

impl UploadedObjects {
    pub(super) fn new(scene: &SceneRef<'_>) -> Self {
        let mut blocks = Vec::new();
        blocks.resize_with(scene.object_count().div_ceil(ObjectTable::BLOCK_SIZE), OnceLock::new);
        Self { blocks }
    }

    pub(super) fn upload(&self, table: &ObjectTable, blocks: Range<usize>) {
        for block in blocks {
            if let Some(uploaded) = self.blocks.get(block) {
                uploaded.get_or_init(|| Box::from(&*table.gpu_objects(block).1));
            }
        }
    }

    pub(super) fn get(&self, index: usize, camera: &CameraPosition) -> Option<ShaderObject<f32>> {
        let block = self.blocks.get(index / ObjectTable::BLOCK_SIZE)?.get()?;
        let object = block.get(index % ObjectTable::BLOCK_SIZE)?;
        let position = FixedPosition::from_halves(object.position_low, object.position_high);
        let (from, camera_in_world) = match camera.transforms {
            TransformPrecision::CameraRelative => (camera.fixed, [0.0; 3]),
            TransformPrecision::Absolute => (FixedPosition::ORIGIN, camera.fixed.relative_to(FixedPosition::ORIGIN)),
        };
        Some(ShaderObject {
            origin: Vector(position.relative_to(from)),
            camera: Vector(camera_in_world),
            orientation: Quaternion(object.orientation),
            scale: Vector(object.scale),
            material: object.material,
            index: object.object,
        })
    }
}

/// A frame's objects as the scene has them.
pub(super) struct ExactObjects {
    /// One for each block of the table.
    blocks: Vec<OnceLock<Box<[ExactObject]>>>,
}

impl ExactObjects {
    pub(super) fn new(scene: &SceneRef<'_>) -> Self {
        let mut blocks = Vec::new();
        blocks.resize_with(scene.object_count().div_ceil(ObjectTable::BLOCK_SIZE), OnceLock::new);
        Self { blocks }
    }

    pub(super) fn upload(&self, scene: &SceneRef<'_>, blocks: Range<usize>) {
        for block in blocks {
            let first = block * ObjectTable::BLOCK_SIZE;
            let objects = first..scene.object_count().min(first + ObjectTable::BLOCK_SIZE);
            if let Some(uploaded) = self.blocks.get(block) {
                uploaded.get_or_init(|| objects.map(|object| ExactObject::new(scene, object)).collect());
            }
        }
    }

    pub(super) fn get(&self, index: usize) -> Option<&ExactObject> {
        self.blocks.get(index / ObjectTable::BLOCK_SIZE)?.get()?.get(index % ObjectTable::BLOCK_SIZE)
    }
}

/// An object as the scene has it.
pub(super) struct ExactObject {
    position: DVec3,
    orientation: Quaternion<f64>,
    scale: Vector3<f64>,
    material: u32,
    index: u32,
}

impl ExactObject {
    pub(super) fn new(scene: &SceneRef<'_>, object: usize) -> Self {
        Self {
            position: scene.position_column().get(object),
            orientation: Quaternion::of(scene.orientation_column().get(object).as_dquat().normalize()),
            scale: Vector3::of_single(scene.scale_column().get(object)),
            material: scene.materials[object].index(),
            index: object as u32,
        }
    }

    pub(super) fn relative_to(&self, camera: &CameraPosition) -> ShaderObject<f64> {
        let Self { position, orientation, scale, material, index } = *self;
        ShaderObject {
            origin: Vector3::of(position - camera.exact),
            camera: Vector3::zero(),
            orientation,
            scale,
            material,
            index,
        }
    }
}

/// A view as a device gets it.
pub(super) fn view_as_uploaded(view: &RenderView, gpu_view: &GpuView) -> ShaderView<f32> {
    let axis = |axis: Vec3| Vector(axis.to_array());
    ShaderView {
        name: view.name().into(),
        position: view.camera.position,
        clip_from_relative: gpu_view.clip_from_relative.to_cols_array_2d().map(Vector),
        right: axis(gpu_view.right),
        up: axis(gpu_view.up),
        forward: axis(gpu_view.forward),
        near: gpu_view.near,
        far: gpu_view.far,
        size: size_of(view),
        projection: view.camera.projection,
        clamps_near: view.clamps_depth(),
        ambient: axis(gpu_view.ambient),
    }
}

/// A view computed from its camera, in f64.
pub(super) fn exact_view(view: &RenderView, ambient: Vec3) -> ShaderView<f64> {
    let camera = &view.camera;
    let [right, up, forward] = view.precise_picture_axes().map(Vector3::of);
    ShaderView {
        name: view.name().into(),
        position: view.camera.position,
        clip_from_relative: view.precise_clip_from_relative().to_cols_array_2d().map(Vector),
        right,
        up,
        forward,
        near: f64::from(camera.near),
        far: f64::from(camera.far),
        size: size_of(view),
        projection: camera.projection,
        clamps_near: view.clamps_depth(),
        ambient: Vector3::of_single(ambient),
    }
}

fn size_of(view: &RenderView) -> [usize; 2] {
    view.camera.size.map(|pixels| pixels as usize)
}

/// A light as a device gets it.
pub(super) fn light_as_uploaded<R: Real>(gpu_light: &GpuLight) -> ShaderLight<R> {
    let real = |value: f32| R::of(f64::from(value));
    let kind = LightKind::ALL.into_iter().find(|kind| *kind as u32 == gpu_light.kind);
    ShaderLight {
        position: Vector3::of_single(gpu_light.position),
        kind: kind.unwrap_or(LightKind::Point),
        direction: Vector3::of_single(gpu_light.direction),
        range: real(gpu_light.range),
        intensity: Vector3::of_single(gpu_light.intensity),
        cone_begin: real(gpu_light.cone_begin),
        cone_end: real(gpu_light.cone_end),
        shadow_layer: (gpu_light.shadow_layer != GpuLight::NO_SHADOW_MAP).then_some(gpu_light.shadow_layer as usize),
        shadow_half: real(gpu_light.shadow_half),
        shadow_near: real(gpu_light.shadow_near),
        shadow_orientation: Quaternion(gpu_light.shadow_orientation.to_array().map(real)),
    }
}

/// A light computed from the scene, in f64: without the rounding of [`GpuLight::new`].
pub(super) fn exact_light(
    gpu_light: &GpuLight,
    light: &Light,
    camera: &CameraPosition,
    map: Option<&RenderView>,
) -> ShaderLight<f64> {
    let relative = |position: DVec3| Vector3::of(position - camera.exact);
    let mut values = light_as_uploaded(gpu_light);
    let LightFields { position, direction, cone, .. } = light.fields();
    if let Some(cone) = cone {
        [values.cone_begin, values.cone_end] = cone.map(|angle| f64::from(angle).cos());
    }
    if let Some(position) = position {
        values.position = relative(*position);
    }
    if let Some(direction) = direction {
        values.direction = Vector3::of(direction.as_dvec3().normalize());
    }
    if let Some(map) = map {
        values.shadow_half = map.camera.projection.half_height();
        values.shadow_orientation = Quaternion::of(map.camera.orientation.as_dquat().normalize());
        if let Projection::Orthographic { .. } = map.camera.projection {
            values.position = relative(map.camera.position);
        }
    }
    values
}
