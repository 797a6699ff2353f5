//! The twin of `light_volumes.wgsl`.

use std::f64::consts::PI;

use super::built_in::{rgb, with_alpha};
use super::geometry_buffer_twin::BRIGHTEST_STORED;
use super::illumination_twin::illuminance_from;
use super::shadow_twin::ShadowReader;
use super::{FullScreenPixel, GeometryFormats, LightTwin, LightValues, PassValues};
use crate::raster::{Real, Vector3, Vector4};

/// Adds what a surface of the geometry buffer reflects of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightVolumesTwin {
    /// Of the geometry buffer.
    pub(super) formats: GeometryFormats,
    /// Without shadow maps everything is lit.
    pub(super) shadows: Option<ShadowReader>,
}

impl<R: Real> LightTwin<R> for LightVolumesTwin {
    fn fragment(
        &self,
        pass: &PassValues<'_, R>,
        pixel: &FullScreenPixel<R>,
        light: &LightValues<R>,
        targets: &mut [Vector4<R>],
    ) -> bool {
        let stored = |target: usize| pass.sampled[target].load(pixel.place, 0);
        let place = pass.view.relative_of_pixel(pixel.clip, stored(DEPTH)[0]);
        let normal = self.formats.normal_of_stored(stored(NORMAL));

        let mut illuminance = illuminance_from(light, place, normal);
        if illuminance == Vector3::zero() {
            return false;
        }
        if let Some(shadows) = self.shadows {
            illuminance = illuminance * shadows.lit_share(pass.sampled[SHADOW_MAPS], light, place, normal);
        }
        let reflected = rgb(stored(DIFFUSE)).map(|value| value / R::of(PI)) * illuminance;
        // Half floats end at 65,504; past that they would be infinite, and infinities turn to NaN further on.
        targets[0] = with_alpha(reflected.map(|value| value.min(R::of(BRIGHTEST_STORED))), R::zero());
        true
    }
}

// The targets sampled, in the order declared.
const DEPTH: usize = 0;
const NORMAL: usize = 1;
const DIFFUSE: usize = 2;
const SHADOW_MAPS: usize = 3;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::twin::TwinShader;
    use crate::process::twin_samples::{Painted, direction, light_values, material, pass, plain, view_values, views};
    use crate::process::{
        Format, LightVolumes, ObjectPixel, ObjectTwin, RenderProcess, Sampled, Transparency, VARYINGS,
        octahedral_from_direction,
    };
    use crate::raster::Vector;
    use crate::scene::{Blend, Light, LightKind};
    use crate::view::{RenderView, ShadowMaps};

    fn twin<R: Real>(shadows: Option<ShadowReader>) -> impl LightTwin<R> {
        LightVolumesTwin { formats: GeometryFormats::default(), shadows }
    }

    fn light(position: DVec3) -> Light {
        Light::Point { position, intensity: Vec3::new(3.0, 5.0, 7.0), range: 40.0 }
    }

    proptest! {
        /// A surface is lit alike whether it went through the geometry buffer or is drawn over it, in both kinds of number.
        #[test]
        fn it_lights_as_transparency_does(normal in direction(), position in prop::array::uniform3(-5.0..5.0_f64), depth in 0.01..0.5_f64) {
            let view = view_values::<f64>(&views()[0]);
            let clip = Vector([0.25, -0.5]);
            let place = view.relative_of_pixel(clip, depth);
            let light = light_values(&light(DVec3::from(position)), None);
            let point = octahedral_from_direction(Vector3::of(normal));
            let sampled = [plain([depth, 0.0, 0.0, 0.0]), plain([point[0], point[1], 0.0, 1.0]), plain([0.5, 0.25, 0.75, 1.0])];
            let [one, two, three] = &sampled;
            let sampled: [&dyn Sampled<f64>; 3] = [one, two, three];
            let mut material = material(Blend::Alpha);
            material.0.diffuse = Vector([1.0, 0.25, 1.5]);
            material.0.emission = Vector::zero();
            let mut pass = pass(&view, &material, &sampled);
            let mut lit = [Vector::splat(9.0)];
            let pixel = FullScreenPixel { place: [3, 5], clip };
            let is_lit = twin(None).fragment(&pass, &pixel, &light, &mut lit);
            if !is_lit {
                lit = [Vector::zero()];
            }

            let lights = [light];
            pass.lights = &lights;
            let [x, y, z] = place.0;
            let [across, down] = [[0.0; VARYINGS], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0]];
            let varyings = [x, y, z, normal.x, normal.y, normal.z, 0.5, 1.0, 0.0];
            let pixel = ObjectPixel { place: [3, 5], varyings, across, down, material: 0 };
            let TwinShader::Objects(transparency) = Transparency::new(None).twin().unwrap().double else { panic!("objects") };
            let mut drawn = [Vector::zero()];
            prop_assert!(ObjectTwin::fragment(&*transparency, &pass, &pixel, &mut drawn));
            for channel in 0..3 {
                let ambient = [0.5, 0.25, 0.75][channel] * view.ambient[channel];
                let difference = lit[0][channel] + ambient - drawn[0][channel];
                prop_assert!(difference.abs() < 1e-9 * drawn[0][channel], "{lit:?} {drawn:?} {ambient}");
            }
            prop_assert_eq!(lit[0][3], 0.0);
        }
    }

    #[test]
    fn a_lambertian_surface_reflects_its_share_over_pi() {
        let view = view_values::<f64>(&views()[0]);
        let depth = view.near / 4.0;
        let material = material(Blend::None);
        for format in [GeometryFormats::default(), of_bytes()] {
            // It faces the camera.
            let Vector([x, y, z, w]) = format.stored_normal(Vector([0.0, 0.0, 1.0]));
            let shader = LightVolumes::new(LightKind::Point, format).twin().unwrap().double;
            let TwinShader::Lights(twin) = shader else { panic!("it draws lights") };
            let [depth, normal, diffuse] =
                [plain([depth, 0.0, 0.0, 0.0]), plain([x, y, z, w]), plain([0.5, 0.25, 1.0, 1.0])];
            let sampled: [&dyn Sampled<f64>; 3] = [&depth, &normal, &diffuse];
            let pass = pass(&view, &material, &sampled);
            let pixel = FullScreenPixel { place: [0, 0], clip: Vector([0.0, 0.0]) };
            // The surface is 4 m before the camera and faces it; the light is 2 m before the surface.
            let before = light_values(&light(DVec3::NEG_Z * 2.0), None);
            let mut targets = [Vector::zero()];
            assert!(twin.fragment(&pass, &pixel, &before, &mut targets));
            let window = (1.0 - 0.05_f64.powi(4)).powi(2);
            for (channel, expected) in [0.5 * 3.0, 0.25 * 5.0, 7.0].into_iter().enumerate() {
                let expected = expected / PI / 4.0 * window;
                assert!((targets[0][channel] / expected - 1.0).abs() < 1e-6, "{targets:?}");
            }
            let behind = light_values(&light(DVec3::NEG_Z * 6.0), None);
            let mut untouched = [Vector::splat(7.0)];
            assert!(!twin.fragment(&pass, &pixel, &behind, &mut untouched), "what gives nothing is discarded");
            assert_eq!(untouched, [Vector::splat(7.0)]);
            let mut blinding = before;
            blinding.intensity = Vector::splat(1e30);
            assert!(twin.fragment(&pass, &pixel, &blinding, &mut targets));
            assert_eq!(targets[0], Vector([60_000.0, 60_000.0, 60_000.0, 0.0]));
        }
    }

    #[test]
    fn shadows_come_from_the_fourth_target() {
        let view = view_values::<f64>(&views()[0]);
        let material = material(Blend::None);
        let maps = ShadowMaps::default();
        let shader = LightVolumes::shadowed(LightKind::Spot, GeometryFormats::default(), &maps).twin().unwrap().double;
        let TwinShader::Lights(twin) = shader else { panic!("it draws lights") };
        let spot = Light::Spot {
            position: DVec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::ONE,
            range: 9.0,
            inner_angle: 0.4,
            outer_angle: 0.5,
            casts_shadow: true,
        };
        let map = RenderView { layer: 1, ..RenderView::new(&maps.camera("map".into(), &spot, &[]).unwrap()) };
        let light = light_values(&spot, Some(&map));
        let targets = [plain([view.near / 4.0, 0.0, 0.0, 0.0]), plain([0.0; 4]), plain([1.0; 4])];
        let [depth, normal, diffuse] = &targets;
        // The layer of another light shows a wall before it.
        let walled =
            Painted { size: [64; 2], color: |_, layer: usize| Vector::splat(if layer == 1 { 0.0 } else { 1.0 }) };
        for (maps, is_lit) in [(&walled as &dyn Sampled<f64>, true), (&plain([1.0; 4]), false)] {
            let sampled = [depth as &dyn Sampled<f64>, normal, diffuse, maps];
            let mut targets = [Vector::zero()];
            let pixel = FullScreenPixel { place: [0, 0], clip: Vector([0.0, 0.0]) };
            assert!(twin.fragment(&pass(&view, &material, &sampled), &pixel, &light, &mut targets));
            assert_eq!(targets[0][0] > 0.0, is_lit);
        }
    }

    fn of_bytes() -> GeometryFormats {
        GeometryFormats { normal: Format::Rgba8Unorm, ..GeometryFormats::default() }
    }
}
