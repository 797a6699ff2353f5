//! `shadow_casters.wgsl` on the CPU.

use crate::process::{
    ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VARYINGS, VertexInput, VertexOutput, bounded_uv,
};
use crate::raster::{Real, Vector, Vector4};
use crate::scene::Projection;

/// Draws the depth of shadow casters.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadowCastersCpuShader {
    /// See [`ShadowCasters`](super::ShadowCasters).
    pub(super) hemispheres: bool,
}

/// A margin beyond the disc's rim: filtering at the rim reads a few pixels past it.
const RIM_MARGIN: f64 = 0.05;

impl<R: Real> ObjectCpuShader<R> for ShadowCastersCpuShader {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[UV..UV + 2].copy_from_slice(&bounded_uv(vertex.uv).0);
        varyings[FORWARD] = match pass.view.projection {
            Projection::Paraboloid => pass.view.forward.dot(relative) / relative.length().max(R::of(1e-30)),
            _ => R::one(),
        };
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn draws_pixels(&self) -> bool {
        self.hemispheres
    }

    fn draws_masked_pixels(&self) -> bool {
        true
    }

    /// Discards pixels behind a paraboloid: a triangle behind it whose corners surround its axis would be rasterized
    /// across the picture. Discards those in the holes of masks, too.
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, _targets: &mut [Vector4<R>]) -> bool {
        let is_behind = pixel.varyings[FORWARD] < R::of(-RIM_MARGIN);
        let uv = Vector([pixel.varyings[UV], pixel.varyings[UV + 1]]);
        !is_behind && !pass.is_cut_out(pixel.material, &pass.materials.get(pixel.material), uv)
    }
}

// The index of each varying.
const FORWARD: usize = 0;
const UV: usize = 1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::MAX_ATTRIBUTES;
    use crate::process::ShaderView;
    use crate::process::cpu_shader::test_inputs::{material, paraboloid, pass, view_values, views};
    use crate::raster::{Quaternion, Vector3};
    use crate::scene::Blend;
    use crate::view::RenderView;

    fn is_drawn(view: &RenderView, position: impl Fn(&ShaderView<f64>) -> Vector3<f64>) -> bool {
        let view = view_values::<f64>(view);
        let object = ShaderObject {
            camera: Vector3::zero(),
            origin: position(&view),
            orientation: Quaternion([0.0, 0.0, 0.0, 1.0]),
            scale: Vector::splat(1.0),
            material: 0,
            index: 0,
        };
        let vertex = VertexInput {
            position: Vector::zero(),
            normal: Vector::zero(),
            uv: Vector::zero(),
            color: Vector::splat(1.0),
            attributes: [Vector::zero(); MAX_ATTRIBUTES],
        };
        let cpu_shader = ShadowCastersCpuShader { hemispheres: true };
        let material = material(Blend::None);
        let pass = pass(&view, &material, &[]);
        let VertexOutput { varyings, .. } = cpu_shader.vertex(&pass, &object, &vertex);
        let (coordinates, dpdx, dpdy) = ([0, 0], [0.0; VARYINGS], [0.0; VARYINGS]);
        let pixel = ObjectPixel { coordinates, varyings, dpdx, dpdy, material: 0, object: 0 };
        cpu_shader.fragment(&pass, &pixel, &mut [])
    }

    #[test]
    fn pixels_behind_a_paraboloid_are_discarded() {
        let map = RenderView::new(&paraboloid());
        assert!(is_drawn(&map, |view| view.forward * 2.0));
        assert!(is_drawn(&map, |view| view.right * 2.0 - view.forward * 0.09), "just past the rim");
        assert!(!is_drawn(&map, |view| view.right * 2.0 - view.forward * 0.11));
        assert!(!is_drawn(&map, |view| view.forward * -2.0));
        assert!(is_drawn(&map, |_| Vector::zero()));
        assert!(is_drawn(&views()[1], |view| view.forward * -2.0), "other maps discard nothing");
    }

    #[test]
    fn only_hemispheres_need_a_fragment_shader() {
        for hemispheres in [false, true] {
            assert_eq!(ObjectCpuShader::<f32>::draws_pixels(&ShadowCastersCpuShader { hemispheres }), hemispheres);
        }
    }
}
