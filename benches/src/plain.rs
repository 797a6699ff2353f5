//! A render process that costs next to nothing on the device.

use drawloom::command::Selection;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};

/// Draws all opaque objects in one colour, into the target `plain`.
pub struct Plain;

impl RenderProcess for Plain {
    fn name(&self) -> &str {
        "plain"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("plain", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth of plain", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @vertex
            fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
                return clip_position(relative_position(drawn_object(in.instance), in.position));
            }
            @fragment
            fn fragment() -> @location(0) vec4<f32> {
                return vec4<f32>(1.0);
            }";
        Draws::Commands(CommandDraws { shader, selection: Selection::OPAQUE, ..CommandDraws::default() })
    }
}
