//! The object under the cursor: the indices of objects in a target of whole numbers, of which one pixel is read back.

use drawloom::command::Selection;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess, Target};

/// The target of the indices.
pub const TARGET: Target = Target::new("object index");

const NOTHING: u32 = u32::MAX;

/// Draws the index of the nearest object of each pixel.
pub struct ObjectIndex;

impl RenderProcess for ObjectIndex {
    fn name(&self) -> &str {
        TARGET.name()
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(TARGET, Format::R32Uint, ClearColor::Value([f64::from(NOTHING), 0.0, 0.0, 0.0]));
        declare.clears_depth("depth of object index", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, selection) = (include_str!("picking.wgsl"), Selection::ALL);
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }
}

/// What was read back, in words.
pub fn describe(object: u32) -> String {
    if object == NOTHING { "nothing".to_owned() } else { format!("object {object}") }
}
