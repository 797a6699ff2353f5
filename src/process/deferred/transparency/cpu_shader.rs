//! `transparency.wgsl` on the CPU.

use std::f64::consts::PI;

use crate::process::cpu_shader::built_in::{rgb, with_alpha};
use crate::process::deferred::shading::cpu_shader::illumination::{MAX_STORED_RADIANCE, illuminance_from};
use crate::process::deferred::shading::cpu_shader::light_batches::LightBatches;
use crate::process::deferred::shading::cpu_shader::shadow::ShadowFilter;
use crate::process::deferred::shading::cpu_shader::surface::{
    relative_of, shading_normal, surface_diffuse, surface_vertex,
};
use crate::process::{ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VertexInput, VertexOutput};
use crate::raster::{Real, Vector4};
use crate::scene::Blend;
use crate::view::ShadowMaps;

/// Lights blended objects.
#[derive(Clone, Copy, Debug)]
pub(super) struct TransparencyCpuShader {
    /// `None` if no light has a shadow map.
    shadows: Option<ShadowFilter>,
    /// Whether vertices have colours.
    has_colors: bool,
    /// Whether the objects are added to a sum of floats.
    sums: bool,
}

impl TransparencyCpuShader {
    pub(super) fn new(maps: Option<&ShadowMaps>, has_colors: bool, sums: bool) -> Self {
        Self { shadows: maps.map(ShadowFilter::new), has_colors, sums }
    }
}

impl<R: Real> ObjectCpuShader<R> for TransparencyCpuShader {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        surface_vertex(pass.view, object, vertex)
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let material = pass.materials.get(pixel.material);
        let normal = shading_normal(pass.view, pixel, &material);
        let diffuse = surface_diffuse(pass, pixel, &material, self.has_colors);
        let position = relative_of(pixel);
        let pi = R::of(PI);
        let mut illuminance = pass.view.ambient * pi;
        let mut batches = LightBatches::default();
        for light in pass.lights {
            let unobstructed = illuminance_from(light, position, normal);
            if unobstructed.0.iter().any(|&value| value > R::zero()) {
                let visibility = self.shadows.map_or(R::one(), |shadows| {
                    let maps = pass.sampled[SHADOW_MAPS];
                    shadows.light_visibility(pass.view, maps, light, pass.lights_by_layer, position, normal)
                });
                if self.sums {
                    batches.add(unobstructed * visibility);
                } else {
                    illuminance = illuminance + unobstructed * visibility;
                }
            }
        }
        if self.sums {
            illuminance = illuminance + batches.sum();
        }
        let radiance = material.emission + rgb(diffuse).map(|value| value / pi) * illuminance;
        let radiance = radiance.map(|value| value.min(R::of(MAX_STORED_RADIANCE)));
        let opacity = diffuse[3];
        // Alpha blending multiplies by the opacity. In a sum alpha is how much is hidden of what is behind: what is
        // added hides nothing.
        targets[0] = match material.blend {
            Blend::Alpha => with_alpha(radiance, opacity),
            _ => with_alpha(radiance * opacity, if self.sums { R::zero() } else { opacity }),
        };
        true
    }
}

/// The index of the only sampled target.
const SHADOW_MAPS: usize = 0;

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::process::cpu_shader::TypedCpuShader;
    use crate::process::cpu_shader::test_inputs::{light_values, material, pass, plain, view_values, views};
    use crate::process::{RenderProcess, SampledTexture, ShaderLight, Transparency, VARYINGS};
    use crate::raster::Vector;
    use crate::scene::{Camera, Light};
    use crate::view::RenderView;

    /// A pixel of a surface 4 m in front of the camera that faces it, whose texture is (0.5, 1, 0.25) there.
    fn drawn(
        blend: Blend,
        lights: &[ShaderLight<f64>],
        maps: Option<(&ShadowMaps, &dyn SampledTexture<f64>)>,
    ) -> [f64; 4] {
        let shader = Transparency::new(maps.map(|(maps, _)| maps)).cpu_shader().unwrap().double;
        let TypedCpuShader::Objects(cpu_shader) = shader else { panic!("it draws objects") };
        let view = view_values(&views()[0]);
        let material = material(blend);
        let sampled: Vec<_> = maps.into_iter().map(|(_, sampled)| sampled).collect();
        let mut pass = pass(&view, &material, &sampled);
        pass.lights = lights;
        let pixel = ObjectPixel {
            coordinates: [0, 0],
            varyings: [0.0, 0.0, -4.0, 0.0, 0.0, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0],
            dpdx: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0],
            dpdy: [0.0; VARYINGS],
            material: 0,
            object: 0,
        };
        let mut targets = [Vector::zero()];
        assert!(cpu_shader.draws_pixels() && cpu_shader.fragment(&pass, &pixel, &mut targets));
        targets[0].0
    }

    fn assert_near(found: [f64; 4], expected: [f64; 4]) {
        let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6);
        assert!(near, "{found:?} {expected:?}");
    }

    #[test]
    fn radiance_is_premultiplied_unless_blending_is_alpha() {
        // Diffuse is (0.25, 0.25, 0.25), ambient light (0.1, 0.2, 0.3), emission (0, 0.5, 0.125), and opacity 0.5.
        let radiance = [0.025, 0.55, 0.2];
        let [red, green, blue] = radiance;
        assert_near(drawn(Blend::Alpha, &[], None), [red, green, blue, 0.5]);
        for blend in [Blend::Additive, Blend::Subtractive] {
            assert_near(drawn(blend, &[], None), [red / 2.0, green / 2.0, blue / 2.0, 0.5]);
        }
    }

    #[test]
    fn every_light_adds_its_illumination() {
        let sun = |direction: Vec3| Light::Directional { direction, illuminance: Vec3::splat(4.0), casts_shadow: true };
        let maps = ShadowMaps::default();
        let main = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let map = RenderView::new(&maps.cameras("map", &sun(Vec3::NEG_Z), &[main])[0]);
        let shadowed = light_values(&sun(Vec3::NEG_Z), Some(&map));
        let [before, behind] = [Vec3::NEG_Z, Vec3::Z].map(|direction| light_values(&sun(direction), None));
        let none = drawn(Blend::Alpha, &[behind], None);
        assert_near(none, [0.025, 0.55, 0.2, 0.5]);
        let reflected = 0.25 / PI * 4.0;
        let with =
            |count: f64| [none[0] + reflected * count, none[1] + reflected * count, none[2] + reflected * count, 0.5];
        assert_near(drawn(Blend::Alpha, &[before, behind, before], None), with(2.0));
        assert_near(drawn(Blend::Alpha, &[before, shadowed], Some((&maps, &plain([0.0; 4])))), with(2.0));
        assert_near(drawn(Blend::Alpha, &[before, shadowed], Some((&maps, &plain([1.0; 4])))), with(1.0));
        let mut blinding = before;
        blinding.intensity = Vector::splat(1e30);
        assert_eq!(drawn(Blend::Alpha, &[blinding, blinding], None)[..3], [60_000.0; 3]);
    }
}
