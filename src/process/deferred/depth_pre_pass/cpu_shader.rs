//! `depth_pre_pass.wgsl` on the CPU.

use crate::process::deferred::shading::cpu_shader::surface::{is_hole, uv_varyings};
use crate::process::{ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VertexInput, VertexOutput};
use crate::raster::{Real, Vector4};

/// Draws only depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthPrePassCpuShader;

impl<R: Real> ObjectCpuShader<R> for DepthPrePassCpuShader {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        VertexOutput {
            clip: pass.view.clip_position(object.relative_position(vertex.position)),
            varyings: uv_varyings(vertex),
        }
    }

    fn draws_pixels(&self) -> bool {
        false
    }

    fn draws_masked_pixels(&self) -> bool {
        true
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, _targets: &mut [Vector4<R>]) -> bool {
        !is_hole(pass, pixel, &pass.materials.get(pixel.material))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::MAX_ATTRIBUTES;
    use crate::process::cpu_shader::test_inputs::{material, pass, view_values, views};
    use crate::process::{GeometryBuffer, GeometryFormats, RenderProcess, TypedCpuShader};
    use crate::raster::{Quaternion, Vector, Vector3};
    use crate::scene::Blend;

    proptest! {
        /// What the geometry buffer draws after the pre-pass must have exactly the same depth.
        #[test]
        fn positions_equal_those_of_the_geometry_buffer_to_the_bit(
            position in prop::array::uniform3(-9.0..9.0_f64),
            origin in prop::array::uniform3(-99.0..99.0_f64),
            turn in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let buffer = GeometryBuffer::new(GeometryFormats::default()).cpu_shader().unwrap();
            let TypedCpuShader::Objects(buffer) = buffer.single else { panic!("it draws objects") };
            let object = ShaderObject {
                camera: Vector3::zero(),
                origin: Vector3::<f32>::of(origin.into()),
                orientation: Quaternion::of(DQuat::from_scaled_axis(turn.into())),
                scale: Vector3::of(DVec3::new(0.3, -7.0, 1.0)),
                material: 0,
                index: 0,
            };
            let vertex =
                VertexInput { position: Vector3::of(position.into()), normal: Vector::zero(), uv: Vector::zero(), color: Vector::splat(1.0), attributes: [Vector::zero(); MAX_ATTRIBUTES] };
            for view in views() {
                let view = view_values(&view);
                let material = material(Blend::None);
                let pass = pass(&view, &material, &[]);
                let pre_pass: VertexOutput<f32> = DepthPrePassCpuShader.vertex(&pass, &object, &vertex);
                let buffer = buffer.vertex(&pass, &object, &vertex);
                prop_assert_eq!(pre_pass.clip.0.map(f32::to_bits), buffer.clip.0.map(f32::to_bits));
            }
        }
    }

    #[test]
    fn it_draws_no_pixels() {
        assert!(!ObjectCpuShader::<f32>::draws_pixels(&DepthPrePassCpuShader));
    }
}
