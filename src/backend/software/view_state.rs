//! A view of a frame.

use super::precision::Precision;
use super::shader_inputs::{CameraPosition, light_as_uploaded};
use crate::backend::{BackendError, ViewRequest};
use crate::process::{ShaderLight, ShaderView};
use crate::quality::TransformPrecision;
use crate::view::{FixedPosition, GpuLight, LightClass};

/// A view of a frame, as CPU shaders read it.
pub(super) struct ViewState<R> {
    pub(super) shader_view: ShaderView<R>,
    /// The lights that reach it.
    pub(super) lights: Vec<ShaderLight<R>>,
    /// See [`PassInputs::light_ends`](crate::process::PassInputs::light_ends).
    pub(super) light_ends: [usize; LightClass::COUNT],
    /// See [`PassInputs::lights_by_layer`](crate::process::PassInputs::lights_by_layer).
    pub(super) lights_by_layer: Vec<ShaderLight<R>>,
    pub(super) camera: CameraPosition,
}

impl<R: Precision> ViewState<R> {
    /// # Errors
    /// If the camera is out of reach.
    pub(super) fn new(request: &ViewRequest<'_>, transforms: TransformPrecision) -> Result<Self, BackendError> {
        let ViewRequest { view, views, light_table, lights, ambient, .. } = *request;
        let gpu_view = request.gpu_view()?;
        let camera = CameraPosition {
            exact: view.camera.position,
            fixed: FixedPosition::from_halves(gpu_view.position_low, gpu_view.position_high),
            transforms,
        };
        let light = |(gpu_light, (light, map)): (&GpuLight, (usize, Option<usize>))| {
            R::light(gpu_light, &lights[light], &camera, map.map(|map| &views[map]))
        };
        let of_layer = |(gpu_light, source): (&GpuLight, &Option<(usize, usize)>)| match *source {
            Some((index, map)) => light((gpu_light, (index, Some(map)))),
            None => light_as_uploaded(gpu_light),
        };
        let (gpu_lights, by_layer) = light_table.gpu_lights().split_at(light_table.light_count());
        Ok(Self {
            shader_view: R::view(view, &gpu_view, ambient),
            lights: gpu_lights.iter().zip(light_table.sources()).map(light).collect(),
            light_ends: light_table.class_ends().map(|end| end as usize),
            lights_by_layer: by_layer.iter().zip(light_table.layer_sources()).map(of_layer).collect(),
            camera,
        })
    }
}
