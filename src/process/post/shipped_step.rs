//! What the steps that come with the crate have in common.

use std::sync::Arc;

use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};

/// A step that comes with the crate.
pub(super) trait ShippedStep: Send + Sync + 'static {
    const NAME: &str;

    /// The format of its target.
    fn format(&self) -> Format;

    fn full_screen(&self) -> FullScreen<'static>;

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> crate::process::CpuShader;
}

/// A shipped step with its source and its target.
pub(super) struct BoundStep<S> {
    source: String,
    target: String,
    step: S,
}

impl<S: ShippedStep> BoundStep<S> {
    pub(super) fn between(source: &str, target: &str, step: S) -> Arc<Self> {
        Arc::new(Self { source: source.to_owned(), target: target.to_owned(), step })
    }
}

impl<S: ShippedStep> RenderProcess for BoundStep<S> {
    fn name(&self) -> &str {
        S::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare_step(declare, &self.source, &self.target, self.step.format());
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(self.step.full_screen())
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(self.step.cpu_shader())
    }
}

pub(super) fn declare_step(declare: &mut Declare, source: &str, target: &str, format: Format) {
    declare.samples(source);
    declare.clears_color(target, format, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
}
