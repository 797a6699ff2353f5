//! Bloom: the glow around what is brighter than white, on workers of the CPU or on the device.

#[cfg(feature = "software")]
mod cpu_shader;
mod kernel;
mod on_cpu;
mod on_device;

use std::sync::Arc;

use drawloom::process::{PostStep, RenderProcess, targets};

use self::kernel::{Kernel, MAX_RADIUS, NAME};
use self::on_cpu::BloomStep;
use self::on_device::{BloomColumns, BloomLayer, BloomRows};
use crate::downsample::Downsample;
use crate::source::StepSource;
use crate::step::AsyncStep;

/// Bloom: what is brighter than a threshold glows, by a Gaussian blur of `radiance` at a fraction of its size.
///
/// The same layer is computed [on workers](Self::on_cpu), a frame late, and [on the device](Self::on_device), in the
/// same frame. Both agree up to the rounding of half floats. It is wide and smooth, so a late one is hardly noticed.
///
/// Sums are made in floats. The smaller picture, its blur along rows (on the device), its blur along columns, and the
/// picture with the layer are stored in half floats, each with an error of 2⁻¹⁰ of itself, and of 2⁻²⁴ at least,
/// however many pixels glow.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::Renderer;
/// use drawloom::backend::NullBackend;
/// use drawloom_async_post::{Bloom, LayerSettings, AsyncPost};
/// use drawloom::process::{Deferred, ToneMapping};
/// use drawloom::task::Scheduler;
///
/// let scheduler = Arc::new(Scheduler::new(2)?);
/// let bloom = Bloom::default();
/// let post = AsyncPost::new(Arc::clone(&scheduler), bloom.on_cpu(), bloom.source());
/// let deferred = Deferred::new()
///     .post(post.layer(LayerSettings { strength: 0.3, ..LayerSettings::default() }))
///     .post(ToneMapping::default());
/// let (renderer, submitter) = Renderer::builder(NullBackend)
///     .pipeline(deferred)
///     .process(post.downsample().expect("bloom is computed from a smaller picture"))
///     .output(post.source_target())
///     .build(scheduler)?;
/// // In each frame: post.begin_frame(&renderer, cameras), record, post.read_back(&mut recorded), submit.
/// # let _ = (renderer, submitter);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bloom {
    /// What width and height of `radiance` are divided by, from 1.
    pub divisor: u32,
    /// What is brighter glows, in each channel, by as much as it is brighter. Negative and NaN count as 0.
    pub threshold: f32,
    /// How far light is spread, in pixels of the smaller picture: 1 to [`MAX_RADIUS`](Self::MAX_RADIUS); other numbers
    /// count as the nearest of these. The standard deviation is half of it.
    pub radius: u32,
}

impl Default for Bloom {
    /// A quarter of the size, what is brighter than white, and 16 pixels.
    fn default() -> Self {
        Self { divisor: 4, threshold: 1.0, radius: 16 }
    }
}

impl Bloom {
    /// The largest radius.
    pub const MAX_RADIUS: u32 = MAX_RADIUS;

    /// What it is computed from.
    pub fn source(&self) -> StepSource {
        StepSource::downsampled(targets::RADIANCE, self.divisor.max(1))
    }

    /// The step for a [`AsyncPost`](crate::AsyncPost). Its source must be in
    /// [`Format::Rgba16Float`](drawloom::process::Format::Rgba16Float), as [`source`](Self::source) is; otherwise each
    /// result is an error.
    pub fn on_cpu(&self) -> impl AsyncStep {
        BloomStep::new(self.kernel())
    }

    /// The processes of the same step on the device, in the same frame, and the step of post-processing that adds
    /// `strength` times their result.
    pub fn on_device(&self, strength: f32) -> (Vec<Arc<dyn RenderProcess>>, impl PostStep + 'static) {
        let source = self.source();
        let target = Downsample::target_of(NAME, &source);
        let downsample =
            Downsample::new(NAME, &source).map(|downsample| Arc::new(downsample) as Arc<dyn RenderProcess>);
        let (divisor, kernel) = (self.divisor.max(1), self.kernel());
        let rows = Arc::new(BloomRows { source: target, divisor, kernel: kernel.clone() });
        let processes = downsample.into_iter().chain([rows as _, Arc::new(BloomColumns { divisor, kernel }) as _]);
        (processes.collect(), BloomLayer { strength })
    }

    fn kernel(&self) -> Kernel {
        Kernel::new(self.threshold, self.radius)
    }
}
