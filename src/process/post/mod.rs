//! Post-processing: what is done to a picture after it was lit, step by step.

mod fxaa;
mod fxaa_twin;
mod tone_mapping;
mod tone_mapping_twin;

use std::sync::Arc;

use super::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, Twin};
use crate::quality::Quality;

pub use fxaa::Fxaa;
pub use tone_mapping::{Exposure, ToneMapping};

/// A step of post-processing that does not know yet where in the chain it stands.
///
/// The chain begins at the target `radiance`, which is linear, and ends at the target `picture`. Each step samples what
/// the step before it wrote, and writes a target of its own, in a format of its own choice; before [`ToneMapping`] that is
/// [`Format::Rgba16Float`], from there on [`Format::Rgba8Srgb`]. A step may sample other targets too, `depth` for one.
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
    /// The process that does this step from the target `source` to the target `target`.
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess>;

    /// The step to take instead in frames of a quality; `None`, unless said otherwise, for this one.
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

/// A shipped step.
trait PlacedStep: Send + Sync + 'static {
    const NAME: &str;

    fn full_screen(&self) -> FullScreen<'static>;

    fn twin(&self) -> Twin;
}

/// A shipped step that knows where it stands.
struct Placed<S> {
    source: String,
    target: String,
    step: S,
}

impl<S: PlacedStep> Placed<S> {
    fn between(source: &str, target: &str, step: S) -> Arc<Self> {
        Arc::new(Self { source: source.to_owned(), target: target.to_owned(), step })
    }
}

impl<S: PlacedStep> RenderProcess for Placed<S> {
    fn name(&self) -> &str {
        S::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare_step(declare, &self.source, &self.target);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(self.step.full_screen())
    }

    fn twin(&self) -> Option<Twin> {
        Some(self.step.twin())
    }
}

fn declare_step(declare: &mut Declare, source: &str, target: &str) {
    declare.samples(source);
    declare.clears_color(target, Format::Rgba8Srgb, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
}
