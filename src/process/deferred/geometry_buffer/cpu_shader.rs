//! `geometry_buffer.wgsl` on the CPU.

use crate::process::cpu_shader::built_in::{rgb, with_alpha};
use crate::process::deferred::shading::cpu_shader::illumination::MAX_STORED_RADIANCE;
use crate::process::deferred::shading::cpu_shader::surface::{
    is_hole, shading_normal, surface_diffuse, surface_vertex,
};
use crate::process::{
    GeometryFormats, ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VertexInput, VertexOutput,
};
use crate::raster::{Real, Vector3, Vector4};

/// Writes normal, diffuse and radiance.
#[derive(Clone, Copy, Debug)]
pub(super) struct GeometryBufferCpuShader {
    /// The formats of its targets.
    pub(super) formats: GeometryFormats,
    /// Whether vertices have colours.
    pub(super) has_colors: bool,
}

impl<R: Real> ObjectCpuShader<R> for GeometryBufferCpuShader {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        surface_vertex(pass.view, object, vertex)
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let material = pass.materials.get(pixel.material);
        if is_hole(pass, pixel, &material) {
            return false;
        }
        let normal = shading_normal(pass.view, pixel, &material);
        let diffuse = rgb(surface_diffuse(pass, pixel, &material, self.has_colors));
        let radiance = material.emission + diffuse * pass.view.ambient;
        let clamped = |color: Vector3<R>| color.map(|value| value.min(R::of(MAX_STORED_RADIANCE)));
        let outputs = [
            self.formats.encode_normal(normal),
            with_alpha(clamped(diffuse), R::one()),
            with_alpha(clamped(radiance), R::one()),
        ];
        for (target, output) in targets.iter_mut().zip(outputs) {
            *target = output;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::cpu_shader::TypedCpuShader;
    use crate::process::cpu_shader::test_inputs::{material, pass, view_values, views};
    use crate::process::{Format, GeometryBuffer, RenderProcess, VARYINGS};
    use crate::raster::Vector;
    use crate::scene::Blend;

    #[test]
    fn it_writes_normal_diffuse_and_radiance_in_the_order_declared() {
        let view = view_values::<f64>(&views()[0]);
        let mut material = material::<f64>(Blend::None);
        material.0.emission = Vector([0.0, 0.5, 1e9]);
        let normal = Vector([0.48, 0.6, 0.64]);
        let pixel = ObjectPixel {
            coordinates: [0, 0],
            varyings: [0.0, 0.0, -4.0, normal[0], normal[1], normal[2], 0.5, 1.0, 1.0, 1.0, 1.0],
            dpdx: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0],
            dpdy: [0.0; VARYINGS],
            material: 0,
            object: 0,
        };
        for (format, bound) in [(Format::Rg16Float, 1e-15), (Format::Rgba8Unorm, 1e-4), (Format::Rg8Unorm, 0.02)] {
            let formats = GeometryFormats { normal: format, ..GeometryFormats::default() };
            let cpu_shader = GeometryBuffer::new(formats).cpu_shader().unwrap();
            let TypedCpuShader::Objects(cpu_shader) = cpu_shader.double else { panic!("it draws objects") };
            let mut targets = [Vector::zero(); 3];
            assert!(
                cpu_shader.draws_pixels() && cpu_shader.fragment(&pass(&view, &material, &[]), &pixel, &mut targets)
            );
            assert!((formats.decode_normal(targets[0]) - normal).length() < bound);
            assert_eq!(targets[1], Vector([0.25, 0.25, 0.25, 1.0]));
            assert_eq!(targets[2], Vector([0.25 * view.ambient[0], 0.5 + 0.25 * view.ambient[1], 60_000.0, 1.0]));
        }
    }
}
