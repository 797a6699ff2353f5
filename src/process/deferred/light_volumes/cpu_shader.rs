//! `light_volumes.wgsl` on the CPU.

use std::f64::consts::PI;

use crate::process::cpu_shader::built_in::{rgb, with_alpha};
use crate::process::deferred::shading::cpu_shader::illumination::{MAX_STORED_RADIANCE, illuminance_from};
use crate::process::deferred::shading::cpu_shader::shadow::ShadowFilter;
use crate::process::{FullScreenPixel, GeometryFormats, LightCpuShader, PassInputs, ShaderLight};
use crate::raster::{Real, Vector3, Vector4};
use crate::view::ShadowMaps;

/// Adds the light that a surface of the geometry buffer reflects.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightVolumesCpuShader {
    /// The formats of the geometry buffer.
    formats: GeometryFormats,
    /// `None` if the lights have no shadow maps.
    shadows: Option<ShadowFilter>,
}

impl LightVolumesCpuShader {
    pub(super) fn new(formats: GeometryFormats, maps: Option<&ShadowMaps>) -> Self {
        Self { formats, shadows: maps.map(ShadowFilter::new) }
    }
}

impl<R: Real> LightCpuShader<R> for LightVolumesCpuShader {
    fn fragment(
        &self,
        pass: &PassInputs<'_, R>,
        pixel: &FullScreenPixel<R>,
        light: &ShaderLight<R>,
        targets: &mut [Vector4<R>],
    ) -> bool {
        let stored = |target: usize| pass.sampled[target].load(pixel.coordinates, 0);
        let position = pass.view.position_from_depth(pixel.clip, stored(DEPTH)[0]);
        let normal = self.formats.decode_normal(stored(NORMAL));

        let mut illuminance = illuminance_from(light, position, normal);
        if illuminance == Vector3::zero() {
            return false;
        }
        if let Some(shadows) = self.shadows {
            let (maps, by_layer) = (pass.sampled[SHADOW_MAPS], pass.lights_by_layer);
            illuminance = illuminance * shadows.light_visibility(pass.view, maps, light, by_layer, position, normal);
        }
        let reflected = rgb(stored(DIFFUSE)).map(|value| value / R::of(PI)) * illuminance;
        // Above 65,504 a half float would become infinite, and later NaN.
        targets[0] = with_alpha(reflected.map(|value| value.min(R::of(MAX_STORED_RADIANCE))), R::zero());
        true
    }
}

// Indices of the sampled targets, in the order declared.
const DEPTH: usize = 0;
const NORMAL: usize = 1;
const DIFFUSE: usize = 2;
const SHADOW_MAPS: usize = 3;

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::TypedCpuShader;
    use crate::process::cpu_shader::test_inputs::{
        FunctionTexture, direction, light_values, material, pass, plain, view_values, views,
    };
    use crate::process::{
        Format, LightVolumes, ObjectCpuShader, ObjectPixel, RenderProcess, SampledTexture, Transparency, VARYINGS,
        octahedral_from_direction,
    };
    use crate::raster::Vector;
    use crate::scene::{Blend, Light, LightKind};
    use crate::view::RenderView;

    fn cpu_shader<R: Real>(shadows: Option<ShadowFilter>) -> impl LightCpuShader<R> {
        LightVolumesCpuShader { formats: GeometryFormats::default(), shadows }
    }

    fn light(position: DVec3) -> Light {
        Light::Point { position, intensity: Vec3::new(3.0, 5.0, 7.0), range: 40.0, casts_shadow: false }
    }

    proptest! {
        /// A surface is lit the same whether it is in the geometry buffer or drawn over it.
        #[test]
        fn lighting_equals_that_of_transparency(normal in direction(), position in prop::array::uniform3(-5.0..5.0_f64), depth in 0.01..0.5_f64) {
            let view = view_values::<f64>(&views()[0]);
            let clip = Vector([0.25, -0.5]);
            let surface = view.position_from_depth(clip, depth);
            let light = light_values(&light(DVec3::from(position)), None);
            let point = octahedral_from_direction(Vector3::of(normal));
            let sampled = [plain([depth, 0.0, 0.0, 0.0]), plain([point[0], point[1], 0.0, 1.0]), plain([0.5, 0.25, 0.75, 1.0])];
            let [one, two, three] = &sampled;
            let sampled: [&dyn SampledTexture<f64>; 3] = [one, two, three];
            let mut material = material(Blend::Alpha);
            material.0.diffuse = Vector([1.0, 0.25, 1.5]);
            material.0.emission = Vector::zero();
            let mut pass = pass(&view, &material, &sampled);
            let mut lit = [Vector::splat(9.0)];
            let pixel = FullScreenPixel { coordinates: [3, 5], clip };
            let is_lit = cpu_shader(None).fragment(&pass, &pixel, &light, &mut lit);
            if !is_lit {
                lit = [Vector::zero()];
            }

            let lights = [light];
            pass.lights = &lights;
            let [x, y, z] = surface.0;
            let [dpdx, dpdy] = [[0.0; VARYINGS], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]];
            let varyings = [x, y, z, normal.x, normal.y, normal.z, 0.5, 1.0, 1.0, 1.0, 1.0];
            let pixel = ObjectPixel { coordinates: [3, 5], varyings, dpdx, dpdy, material: 0, object: 0 };
            let TypedCpuShader::Objects(transparency) = Transparency::new(None).cpu_shader().unwrap().double else { panic!("objects") };
            let mut drawn = [Vector::zero()];
            prop_assert!(ObjectCpuShader::fragment(&**transparency, &pass, &pixel, &mut drawn));
            for channel in 0..3 {
                let ambient = [0.5, 0.25, 0.75][channel] * view.ambient[channel];
                let difference = lit[0][channel] + ambient - drawn[0][channel];
                prop_assert!(difference.abs() < 1e-9 * drawn[0][channel], "{lit:?} {drawn:?} {ambient}");
            }
            prop_assert_eq!(lit[0][3], 0.0);
        }
    }

    #[test]
    fn a_lambertian_surface_reflects_its_diffuse_colour_over_pi() {
        let view = view_values::<f64>(&views()[0]);
        let depth = view.near / 4.0;
        let material = material(Blend::None);
        for format in [GeometryFormats::default(), of_bytes()] {
            // It faces the camera.
            let Vector([x, y, z, w]) = format.encode_normal(Vector([0.0, 0.0, 1.0]));
            let shader = LightVolumes::new(LightKind::Point, format).cpu_shader().unwrap().double;
            let TypedCpuShader::Lights(cpu_shader) = shader else { panic!("it draws lights") };
            let [depth, normal, diffuse] =
                [plain([depth, 0.0, 0.0, 0.0]), plain([x, y, z, w]), plain([0.5, 0.25, 1.0, 1.0])];
            let sampled: [&dyn SampledTexture<f64>; 3] = [&depth, &normal, &diffuse];
            let pass = pass(&view, &material, &sampled);
            let pixel = FullScreenPixel { coordinates: [0, 0], clip: Vector([0.0, 0.0]) };
            // The surface is 4 m in front of the camera and faces it; the light is 2 m in front of the surface.
            let in_front = light_values(&light(DVec3::NEG_Z * 2.0), None);
            let mut targets = [Vector::zero()];
            assert!(cpu_shader.fragment(&pass, &pixel, &in_front, &mut targets));
            let window = (1.0 - 0.05_f64.powi(4)).powi(2);
            for (channel, expected) in [0.5 * 3.0, 0.25 * 5.0, 7.0].into_iter().enumerate() {
                let expected = expected / PI / 4.0 * window;
                assert!((targets[0][channel] / expected - 1.0).abs() < 1e-6, "{targets:?}");
            }
            let behind = light_values(&light(DVec3::NEG_Z * 6.0), None);
            let mut untouched = [Vector::splat(7.0)];
            assert!(!cpu_shader.fragment(&pass, &pixel, &behind, &mut untouched), "unlit pixels are discarded");
            assert_eq!(untouched, [Vector::splat(7.0)]);
            let mut blinding = in_front;
            blinding.intensity = Vector::splat(1e30);
            assert!(cpu_shader.fragment(&pass, &pixel, &blinding, &mut targets));
            assert_eq!(targets[0], Vector([60_000.0, 60_000.0, 60_000.0, 0.0]));
        }
    }

    #[test]
    fn shadow_maps_are_the_fourth_sampled_target() {
        let view = view_values::<f64>(&views()[0]);
        let material = material(Blend::None);
        let maps = ShadowMaps::default();
        let shader =
            LightVolumes::shadowed(LightKind::Spot, GeometryFormats::default(), &maps).cpu_shader().unwrap().double;
        let TypedCpuShader::Lights(cpu_shader) = shader else { panic!("it draws lights") };
        let spot = Light::Spot {
            position: DVec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::ONE,
            range: 9.0,
            inner_angle: 0.4,
            outer_angle: 0.5,
            casts_shadow: true,
        };
        let map = RenderView { layer: 1, ..RenderView::new(&maps.cameras("map", &spot, &[])[0]) };
        let light = light_values(&spot, Some(&map));
        let targets = [plain([view.near / 4.0, 0.0, 0.0, 0.0]), plain([0.0; 4]), plain([1.0; 4])];
        let [depth, normal, diffuse] = &targets;
        // The layers of other lights show a wall right in front of them.
        let walled = FunctionTexture {
            size: [64; 2],
            color: |_, layer: usize| Vector::splat(if layer == 1 { 0.0 } else { 1.0 }),
        };
        for (maps, is_lit) in [(&walled as &dyn SampledTexture<f64>, true), (&plain([1.0; 4]), false)] {
            let sampled = [depth as &dyn SampledTexture<f64>, normal, diffuse, maps];
            let mut targets = [Vector::zero()];
            let pixel = FullScreenPixel { coordinates: [0, 0], clip: Vector([0.0, 0.0]) };
            assert!(cpu_shader.fragment(&pass(&view, &material, &sampled), &pixel, &light, &mut targets));
            assert_eq!(targets[0][0] > 0.0, is_lit);
        }
    }

    fn of_bytes() -> GeometryFormats {
        GeometryFormats { normal: Format::Rgba8Unorm, ..GeometryFormats::default() }
    }
}
