//! `blur.wgsl` and `add.wgsl` on the CPU, for the software backend.

use drawloom::process::{FullScreenCpuShader, FullScreenPixel, PassInputs};
use drawloom::raster::{Real, Vector, Vector4};

use super::kernel::Kernel;

/// `blur.wgsl`.
pub(super) struct BlurCpuShader {
    pub(super) kernel: Kernel,
    /// To the next pixel of the row or column.
    pub(super) step: [usize; 2],
}

impl<R: Real> FullScreenCpuShader<R> for BlurCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let source = pass.sampled[0];
        let (size, [x, y], [across, down]) = (source.size(), pixel.coordinates, self.step);
        let (threshold, largest) = (R::of(f64::from(self.kernel.threshold)), R::of(65_504.0));
        let bright = |[x, y]: [usize; 2]| {
            let color = source.load([x.min(size[0] - 1), y.min(size[1] - 1)], 0);
            color.map(|value| (value - threshold).max(R::zero()).min(largest))
        };
        let mut sum = Vector::zero();
        for (distance, &weight) in self.kernel.weights.iter().enumerate() {
            let weight = R::of(f64::from(weight));
            let before = bright([x.saturating_sub(distance * across), y.saturating_sub(distance * down)]);
            let both =
                if distance == 0 { before } else { before + bright([x + distance * across, y + distance * down]) };
            sum = sum + both * weight;
        }
        targets[0] = Vector([sum[0], sum[1], sum[2], R::one()]);
        true
    }
}

/// `add.wgsl`.
pub(super) struct AddCpuShader {
    pub(super) strength: f32,
}

impl<R: Real> FullScreenCpuShader<R> for AddCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let color = pass.sampled[0].load(pixel.coordinates, 0);
        let (half, strength) = (R::of(0.5), R::of(f64::from(self.strength)));
        let place = Vector([pixel.clip[0] * half + half, half - pixel.clip[1] * half]);
        let value = pass.sampled[1].sample_level(place, 0, R::zero());
        let channel = |index: usize| color[index] + strength * value[index];
        targets[0] = Vector([channel(0), channel(1), channel(2), color[3]]);
        true
    }
}
