//! `tone_mapping.wgsl` on the CPU.

use crate::process::cpu_shader::built_in::{clamp, rgb, with_alpha};
use crate::process::{FullScreenCpuShader, FullScreenPixel, PassInputs};
use crate::quality::ToneCurve;
use crate::raster::{Real, Vector3, Vector4};

/// Maps radiance to a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToneMappingCpuShader {
    /// Finite, 0 or more.
    pub(super) exposure: f32,
    pub(super) curve: ToneCurve,
}

impl<R: Real> FullScreenCpuShader<R> for ToneMappingCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let largest = R::of(MAX_HALF_FLOAT);
        let exposure = R::of(f64::from(self.exposure));
        // A sum of several processes may exceed the half floats and be infinite; a difference may be negative.
        let finite = rgb(pass.sampled[0].load(pixel.coordinates, 0)).map(|value| clamp(value, R::zero(), largest));
        let radiance = finite.map(|value| (value * exposure).min(largest));
        let mapped = match self.curve {
            ToneCurve::Filmic => filmic(radiance),
            ToneCurve::Clipped => radiance.map(|value| value.min(R::one())),
        };
        targets[0] = with_alpha(mapped, R::one());
        true
    }
}

const MAX_HALF_FLOAT: f64 = 65_504.0;

/// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
fn filmic<R: Real>(radiance: Vector3<R>) -> Vector3<R> {
    radiance.map(|value| {
        let above = value * (R::of(2.51) * value + R::of(0.03));
        let below = value * (R::of(2.43) * value + R::of(0.59)) + R::of(0.14);
        clamp(above / below, R::zero(), R::one())
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::TypedCpuShader;
    use crate::process::cpu_shader::test_inputs::{UNIT, material, pass, plain, view_values, views};
    use crate::process::post::{PostStep, ToneMapping};
    use crate::process::{RenderProcess, SampledTexture};
    use crate::raster::Vector;
    use crate::scene::Blend;

    /// A radiance mapped by a step, in f32 and in f64.
    fn mapped(step: &dyn RenderProcess, radiance: [f64; 3]) -> [[f64; 4]; 2] {
        let [red, green, blue] = radiance;
        let cpu_shader = step.cpu_shader().unwrap();
        let (TypedCpuShader::FullScreen(single), TypedCpuShader::FullScreen(double)) =
            (cpu_shader.single, cpu_shader.double)
        else {
            panic!("it draws every pixel once")
        };
        let source = plain::<f32>([red, green, blue, 1.0]);
        let view = view_values(&views()[0]);
        let pixel = FullScreenPixel { coordinates: [5, 6], clip: Vector([0.0, 0.0]) };
        let mut targets = [Vector::zero()];
        assert!(single.fragment(&pass(&view, &material(Blend::None), &[&source]), &pixel, &mut targets));
        let source = plain::<f64>([red, green, blue, 1.0]);
        let view = view_values(&views()[0]);
        let sampled: [&dyn SampledTexture<f64>; 1] = [&source];
        let pixel = FullScreenPixel { coordinates: [5, 6], clip: Vector([0.0, 0.0]) };
        let mut double_targets = [Vector::zero()];
        assert!(double.fragment(&pass(&view, &material(Blend::None), &sampled), &pixel, &mut double_targets));
        [targets[0].0.map(f64::from), double_targets[0].0]
    }

    proptest! {
        /// All of the curve's terms are positive, so nothing cancels: four roundings above the line, five below, one
        /// for the quotient, one for the exposure's product, whose share the curve never enlarges, and five for
        /// constants, each u.
        #[test]
        fn it_is_the_filmic_curve(exponents in prop::array::uniform3(-6.0..5.0_f64), exposure in 0.01..10.0_f32) {
            let radiance = exponents.map(|exponent| f64::from(10_f64.powf(exponent) as f32));
            let [single, double] = mapped(&ToneMapping::new(exposure), radiance);
            for channel in 0..3 {
                let x = (radiance[channel].min(65_504.0) * f64::from(exposure)).min(65_504.0);
                let expected = ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0);
                prop_assert!((double[channel] - expected).abs() <= 1e-15);
                prop_assert!((single[channel] - expected).abs() <= 18.0 * UNIT * expected);
            }
            prop_assert_eq!([single[3], double[3]], [1.0; 2]);
        }
    }

    #[test]
    fn the_clipped_curve_ends_at_one() {
        let step = ToneMapping { curve: ToneCurve::Clipped, ..ToneMapping::new(0.5) };
        assert_eq!(mapped(&step, [0.25, 2.0, 1e9])[0], [0.125, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn results_are_numbers_from_zero_to_one() {
        let step = ToneMapping::default();
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, -0.0, 1e-40, 1e38] {
            for found in mapped(&step, [value; 3]) {
                let expected = if value > 1.0 { 1.0 } else { 0.0 };
                assert!(found[..3].iter().all(|found| (found - expected).abs() < 1e-30), "{value} {found:?}");
            }
        }
        for exposure in [f32::NAN, -1.0, 0.0] {
            assert_eq!(mapped(&ToneMapping::new(exposure), [1.0, 2.0, f64::INFINITY])[0][..3], [0.0; 3]);
        }
        assert_eq!(mapped(&ToneMapping::new(f32::INFINITY), [0.0, 1.0, 0.0])[0][..3], [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_step_maps_like_the_process_at_the_current_exposure() {
        let mapping = ToneMapping::new(0.5);
        let step = mapping.process("radiance", "mapped");
        assert_eq!(mapped(&*step, [0.1, 0.5, 2.0]), mapped(&mapping, [0.1, 0.5, 2.0]));
        let before = mapped(&*step, [0.1, 0.5, 2.0]);
        mapping.exposure.set(1.0);
        assert_eq!(mapped(&*step, [0.05, 0.25, 1.0])[1], before[1]);
    }
}
