//! `float_sum.wgsl` on the CPU.

use crate::process::cpu_shader::built_in::{clamp, rgb, with_alpha};
use crate::process::deferred::shading::cpu_shader::illumination::MAX_STORED_RADIANCE;
use crate::process::{FullScreenCpuShader, FullScreenPixel, PassInputs};
use crate::raster::{Real, Vector4};

/// Adds a sum of floats to half floats.
#[derive(Clone, Copy, Debug)]
pub(super) struct FloatSumCpuShader;

impl<R: Real> FullScreenCpuShader<R> for FloatSumCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let sum = pass.sampled[0].load(pixel.coordinates, 0);
        if sum == Vector4::zero() {
            return false;
        }
        // Beyond 65,504 a half float would become infinite, and later NaN.
        let most = R::of(MAX_STORED_RADIANCE);
        targets[0] = with_alpha(rgb(sum).map(|value| clamp(value, -most, most)), sum[3]);
        true
    }
}
