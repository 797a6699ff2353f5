//! A view of a frame.

use super::shader_inputs::CameraPosition;
use crate::process::{ShaderLight, ShaderView};

/// A view of a frame, as CPU shaders read it.
pub(super) struct ViewState<R> {
    pub(super) shader_view: ShaderView<R>,
    /// The lights that reach it.
    pub(super) lights: Vec<ShaderLight<R>>,
    /// See [`PassInputs::lights_by_layer`](crate::process::PassInputs::lights_by_layer).
    pub(super) lights_by_layer: Vec<ShaderLight<R>>,
    pub(super) camera: CameraPosition,
}
