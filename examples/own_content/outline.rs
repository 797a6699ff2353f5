//! A line around selected objects: a stencil holds their pixels, and the same objects are drawn a little larger
//! elsewhere.

use drawloom::command::Selection;
use drawloom::process::{
    CommandDraws, Comparison, Declare, Deformation, Draws, Format, InjectionPoint, RenderProcess, SURFACE_SHADER,
    Stencil, Target, targets,
};
use drawloom::scene::LayerMask;

/// The layer of the selected objects.
pub const LAYER: LayerMask = LayerMask::layer(3);

/// The target of the stencil.
const STENCIL: Target = Target::new("stencil of selected objects");

/// Sets the stencil where selected objects are, hidden or not.
pub struct Selected<D>(pub D);

impl<D: Deformation> RenderProcess for Selected<D> {
    fn name(&self) -> &str {
        "selected"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth(STENCIL, Format::Stencil8);
        self.0.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let stencil = Some(Stencil::mark(1));
        Draws::Commands(CommandDraws { fragment: None, stencil, ..selected(SURFACE_SHADER, &self.0) })
    }
}

/// Draws the line over the picture.
pub struct Outline<D>(pub D);

impl<D: Deformation> RenderProcess for Outline<D> {
    fn name(&self) -> &str {
        "outline"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterPostProcessing);
        declare.tests_stencil(STENCIL);
        declare.draws_over(targets::PICTURE);
        self.0.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let stencil = Some(Stencil::test(Comparison::NotEqual, 1));
        Draws::Commands(CommandDraws { stencil, ..selected(include_str!("outline.wgsl"), &self.0) })
    }
}

/// The selected objects, deformed as in the pipeline.
fn selected<'a>(shader: &'a str, deformation: &'a impl Deformation) -> CommandDraws<'a> {
    CommandDraws {
        shader,
        deformation: Some(deformation.shader()),
        selection: Selection::ALL.in_layers(LAYER),
        writes_depth: false,
        resources: deformation.resources(),
        ..CommandDraws::default()
    }
}
