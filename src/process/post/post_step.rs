//! A step of post-processing.

use std::sync::Arc;

use crate::process::RenderProcess;
use crate::quality::Quality;

/// A step of post-processing, which makes a process once its source and target are known.
///
/// The chain begins at the target `radiance`, which is linear, and ends at the target `picture`. Each step samples the
/// target of the step before it, and writes a target of its own, in a format that it chooses; before
/// [`ToneMapping`](super::ToneMapping) that is [`Format::Rgba16Float`](crate::process::Format::Rgba16Float), from then
/// on one that is sRGB encoded, such as [`Format::Rgba8Srgb`](crate::process::Format::Rgba8Srgb). A step may sample
/// other targets too, such as `depth`.
///
/// A closure from the names of the two targets to a process is a step:
///
/// ```
/// use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, PostStep, RenderProcess};
///
/// /// Turns the picture into its negative.
/// struct Negative {
///     source: String,
///     target: String,
/// }
///
/// impl RenderProcess for Negative {
///     fn name(&self) -> &str {
///         "negative"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.samples(&self.source);
///         declare.clears_color(&self.target, Format::Rgba8Srgb, ClearColor::Value([0.0; 4]));
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::FullScreen(FullScreen {
///             shader: "
///                 @group(2) @binding(1) var source: texture_2d<f32>;
///
///                 @fragment
///                 fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
///                     let color = textureLoad(source, vec2<i32>(in.position.xy), 0);
///                     return vec4<f32>(1.0 - color.rgb, color.a);
///                 }
///             ",
///             ..FullScreen::default()
///         })
///     }
/// }
///
/// let step = |source: &str, target: &str| Negative { source: source.to_owned(), target: target.to_owned() };
/// assert_eq!(step.process("mapped", "picture").name(), "negative");
/// ```
pub trait PostStep: Send + Sync {
    /// The process of this step, which reads the target `source` and draws the target `target`. It is called again for
    /// every plan, and with two empty names where only the process's name is asked for (see `Deferred::leave_out`), so
    /// it should do no more than make the process.
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess>;

    /// The step for frames of a quality; `None`, the default, for this step itself.
    fn with_quality(&self, _quality: &Quality) -> Option<Arc<dyn PostStep>> {
        None
    }
}

impl<F, P> PostStep for F
where
    F: Fn(&str, &str) -> P + Send + Sync,
    P: RenderProcess + 'static,
{
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        Arc::new(self(source, target))
    }
}
