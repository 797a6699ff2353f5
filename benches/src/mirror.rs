//! A process that shows what a mirror's view has drawn.

use drawloom::command::Selection;
use drawloom::process::{CommandDraws, Declare, Draws, InjectionPoint, RenderProcess, targets};
use drawloom::scene::{LayerMask, ViewKind};

/// The layer of the mirror's surface.
pub const LAYER: LayerMask = LayerMask::layer(1);

/// The name of the mirror's view behind that of the view that shows it.
pub const VIEW: &str = "mirror";

/// Draws the mirror's surface.
pub struct Mirror;

impl RenderProcess for Mirror {
    fn name(&self) -> &str {
        "mirror"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, VIEW, targets::RADIANCE);
        declare.draws_over(targets::RADIANCE);
        declare.matches_depth(targets::DEPTH);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var mirrored: texture_2d<f32>;

            @vertex
            fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
                return clip_position(relative_position(drawn_object(in.instance), in.position));
            }

            @fragment
            fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
                return textureLoad(mirrored, vec2<i32>(position.xy), 0);
            }
        ";
        Draws::Commands(CommandDraws { shader, selection: Selection::ALL.in_layers(LAYER), ..CommandDraws::default() })
    }
}
