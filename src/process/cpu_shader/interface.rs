//! What a process implements for the software backend.

use std::sync::Arc;

use super::{FullScreenPixel, ObjectPixel, PassInputs, ShaderLight, ShaderObject, VertexInput, VertexOutput};
use crate::raster::{Real, Vector4};
use crate::unwind::Contained;

/// A process's shader on the CPU, which the software backend runs in place of its WGSL, in f32 and in f64: see
/// [`RenderProcess::cpu_shader`](crate::process::RenderProcess::cpu_shader). It computes the same numbers as the WGSL.
#[derive(Clone)]
pub struct CpuShader {
    pub(crate) single: TypedCpuShader<f32>,
    pub(crate) double: TypedCpuShader<f64>,
}

/// A CPU shader in one precision.
#[derive(Clone)]
pub(crate) enum TypedCpuShader<R> {
    Objects(Contained<Arc<dyn ObjectCpuShader<R>>>),
    FullScreen(Contained<Arc<dyn FullScreenCpuShader<R>>>),
    Lights(Contained<Arc<dyn LightCpuShader<R>>>),
}

impl CpuShader {
    /// For a process that draws objects: [`Draws::Commands`](crate::process::Draws::Commands).
    pub fn objects<S: ObjectCpuShader<f32> + ObjectCpuShader<f64> + 'static>(shader: S) -> Self {
        let shader = Arc::new(shader);
        let single = TypedCpuShader::Objects(Contained::new(Arc::clone(&shader) as _));
        Self { single, double: TypedCpuShader::Objects(Contained::new(shader)) }
    }

    /// For a process that draws every pixel once: [`Draws::FullScreen`](crate::process::Draws::FullScreen).
    pub fn full_screen<S: FullScreenCpuShader<f32> + FullScreenCpuShader<f64> + 'static>(shader: S) -> Self {
        let shader = Arc::new(shader);
        let single = TypedCpuShader::FullScreen(Contained::new(Arc::clone(&shader) as _));
        Self { single, double: TypedCpuShader::FullScreen(Contained::new(shader)) }
    }

    /// For a process that draws the pixels that lights reach: [`Draws::Lights`](crate::process::Draws::Lights).
    pub fn lights<S: LightCpuShader<f32> + LightCpuShader<f64> + 'static>(shader: S) -> Self {
        let shader = Arc::new(shader);
        let single = TypedCpuShader::Lights(Contained::new(Arc::clone(&shader) as _));
        Self { single, double: TypedCpuShader::Lights(Contained::new(shader)) }
    }
}

/// A vertex and a fragment shader for objects.
pub trait ObjectCpuShader<R: Real>: Send + Sync {
    /// The entry point `vertex`: a vertex' clip position and varyings.
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R>;

    /// Whether there is a fragment entry point. Without one, only depth is drawn.
    fn draws_pixels(&self) -> bool {
        true
    }

    /// Whether `fragment` runs for objects whose material [is a mask](crate::scene::Material::is_masked), which [have
    /// entry points of their own](crate::process::CommandDraws::masked) in WGSL. By default it does if it runs for
    /// others.
    fn draws_masked_pixels(&self) -> bool {
        self.draws_pixels()
    }

    /// The fragment entry point: writes the targets in the order declared; `false` discards the pixel.
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool;
}

/// A fragment shader that runs once for every pixel.
pub trait FullScreenCpuShader<R: Real>: Send + Sync {
    /// The fragment entry point: writes the targets in the order declared; `false` discards the pixel.
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool;
}

/// A fragment shader that runs for every pixel that a light may reach.
///
/// It runs for the pixels within conservative bounds of the light whose surface is nearer than the light's far side. No
/// light geometry is drawn, so the shader discards pixels that the light does not reach.
pub trait LightCpuShader<R: Real>: Send + Sync {
    /// The fragment entry point: writes the targets in the order declared; `false` discards the pixel.
    fn fragment(
        &self,
        pass: &PassInputs<'_, R>,
        pixel: &FullScreenPixel<R>,
        light: &ShaderLight<R>,
        targets: &mut [Vector4<R>],
    ) -> bool;
}
