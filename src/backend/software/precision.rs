//! What differs between drawing in f32 and in f64.

use std::ops::Range;

use glam::Vec3;

use super::shader_inputs::{
    CameraPosition, ExactObjects, UploadedObjects, exact_light, exact_view, light_as_uploaded, view_as_uploaded,
};
use crate::backend::FrameRequest;
use crate::process::{CpuShader, ShaderLight, ShaderObject, ShaderView, TypedCpuShader};
use crate::raster::Real;
use crate::scene::{Light, SceneRef};
use crate::view::{GpuLight, GpuView, RenderView};

/// A precision that the backend draws in: f32 reads the same numbers that a device gets, f64 reads the scene.
pub(super) trait Precision: Real {
    /// The objects of a frame.
    type Objects: Send + Sync;

    /// Whether targets round their values to their formats.
    const ROUNDS: bool;

    /// A process's CPU shader in this precision.
    fn shader(shader: &CpuShader) -> &TypedCpuShader<Self>;

    /// Storage for a frame's objects.
    fn objects(scene: &SceneRef<'_>) -> Self::Objects;

    /// Copies blocks of objects.
    fn upload(objects: &Self::Objects, request: &FrameRequest<'_>, blocks: Range<usize>);

    /// One object, relative to a camera; `None` if there is none.
    fn object(objects: &Self::Objects, index: usize, camera: &CameraPosition) -> Option<ShaderObject<Self>>;

    /// A view in a scene with this ambient light.
    fn view(view: &RenderView, gpu_view: &GpuView, ambient: Vec3) -> ShaderView<Self>;

    /// A light relative to a view's camera. `map` is the view that draws its shadow map.
    fn light(
        gpu_light: &GpuLight,
        light: &Light,
        camera: &CameraPosition,
        map: Option<&RenderView>,
    ) -> ShaderLight<Self>;
}

impl Precision for f32 {
    type Objects = UploadedObjects;

    const ROUNDS: bool = true;

    fn shader(shader: &CpuShader) -> &TypedCpuShader<Self> {
        &shader.single
    }

    fn objects(scene: &SceneRef<'_>) -> UploadedObjects {
        UploadedObjects::new(scene)
    }

    fn upload(objects: &UploadedObjects, request: &FrameRequest<'_>, blocks: Range<usize>) {
        objects.upload(request.objects, blocks);
    }

    fn object(objects: &UploadedObjects, index: usize, camera: &CameraPosition) -> Option<ShaderObject<Self>> {
        objects.get(index, camera)
    }

    fn view(view: &RenderView, gpu_view: &GpuView, _ambient: Vec3) -> ShaderView<Self> {
        view_as_uploaded(view, gpu_view)
    }

    fn light(
        gpu_light: &GpuLight,
        _light: &Light,
        _camera: &CameraPosition,
        _map: Option<&RenderView>,
    ) -> ShaderLight<Self> {
        light_as_uploaded(gpu_light)
    }
}

impl Precision for f64 {
    type Objects = ExactObjects;

    const ROUNDS: bool = false;

    fn shader(shader: &CpuShader) -> &TypedCpuShader<Self> {
        &shader.double
    }

    fn objects(scene: &SceneRef<'_>) -> ExactObjects {
        ExactObjects::new(scene)
    }

    fn upload(objects: &ExactObjects, request: &FrameRequest<'_>, blocks: Range<usize>) {
        objects.upload(request.scene, blocks);
    }

    fn object(objects: &ExactObjects, index: usize, camera: &CameraPosition) -> Option<ShaderObject<Self>> {
        objects.get(index).map(|object| object.relative_to(camera))
    }

    fn view(view: &RenderView, _gpu_view: &GpuView, ambient: Vec3) -> ShaderView<Self> {
        exact_view(view, ambient)
    }

    fn light(
        gpu_light: &GpuLight,
        light: &Light,
        camera: &CameraPosition,
        map: Option<&RenderView>,
    ) -> ShaderLight<Self> {
        exact_light(gpu_light, light, camera, map)
    }
}
