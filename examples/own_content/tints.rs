//! A colour of the engine's own for each object, in the shipped geometry buffer's place.

use drawloom::command::Selection;
use drawloom::process::{CommandDraws, Declare, Draws, GeometryBuffer, GeometryFormats, RenderProcess, SURFACE_SHADER};
use drawloom::scene::ObjectColumn;

/// The colour of each object, linear, and how much of it is emitted.
pub const TINT: ObjectColumn<[f32; 4]> = ObjectColumn::new("tint");

/// The shipped geometry buffer with diffuse colours times [`TINT`].
pub struct TintedGeometryBuffer {
    shipped: GeometryBuffer,
    shader: String,
}

impl Default for TintedGeometryBuffer {
    fn default() -> Self {
        let formats = GeometryFormats::default();
        let shader = [SURFACE_SHADER, &formats.normal_encoding_wgsl(), include_str!("tints.wgsl")].concat();
        Self { shipped: GeometryBuffer::new(formats), shader }
    }
}

impl RenderProcess for TintedGeometryBuffer {
    fn name(&self) -> &str {
        "tinted geometry buffer"
    }

    fn declare(&self, declare: &mut Declare) {
        self.shipped.declare(declare);
        declare.reads_column(TINT);
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::OPAQUE.of_shipped_materials();
        Draws::Commands(CommandDraws { shader: &self.shader, selection, ..CommandDraws::default() })
    }
}
