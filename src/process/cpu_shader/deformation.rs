//! CPU shaders of objects whose vertices are moved first.

use std::sync::Arc;

use super::interface::TypedCpuShader;
use super::{CpuShader, ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VertexInput, VertexOutput};
use crate::raster::{Real, Vector4};
use crate::unwind::Contained;

/// The function `deform` of a [`Deformation`](crate::process::Deformation) on the CPU.
pub trait DeformationCpuShader<R: Real>: Send + Sync {
    /// The vertex in the object's shape of this frame.
    fn deform(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexInput<R>;
}

impl CpuShader {
    /// The same CPU shader for objects that are deformed. CPU shaders that draw no objects do not change.
    pub fn deformed<D>(self, deformation: D) -> Self
    where
        D: DeformationCpuShader<f32> + DeformationCpuShader<f64> + 'static,
    {
        let deformation = Arc::new(deformation);
        Self { single: self.single.deformed(Arc::clone(&deformation) as _), double: self.double.deformed(deformation) }
    }
}

impl<R: Real> TypedCpuShader<R> {
    fn deformed(self, deformation: Arc<dyn DeformationCpuShader<R>>) -> Self {
        match self {
            Self::Objects(process) => {
                let deformation = Contained::new(deformation);
                Self::Objects(Contained::new(Arc::new(Deformed { process, deformation })))
            }
            other => other,
        }
    }
}

struct Deformed<R> {
    process: Contained<Arc<dyn ObjectCpuShader<R>>>,
    deformation: Contained<Arc<dyn DeformationCpuShader<R>>>,
}

impl<R: Real> ObjectCpuShader<R> for Deformed<R> {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        self.process.vertex(pass, object, &self.deformation.deform(pass, object, vertex))
    }

    fn draws_pixels(&self) -> bool {
        self.process.draws_pixels()
    }

    fn draws_masked_pixels(&self) -> bool {
        self.process.draws_masked_pixels()
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        self.process.fragment(pass, pixel, targets)
    }
}
