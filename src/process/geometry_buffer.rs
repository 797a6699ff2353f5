//! The geometry buffer (L 4.1).

use super::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};

/// Draws what lighting needs to know of each pixel: depth, normal and diffuse colour, and the light that the surface gives
/// off itself.
///
/// The seven steps of L 4.1 and where they are here: the viewport is the view's picture; the render targets and their
/// clearing are declared below; depth is read and written, and what faces away is culled, by the pipeline; the objects
/// are drawn from the view's queue; the command buffer is finished on a worker.
///
/// | target | format | what |
/// | --- | --- | --- |
/// | `depth` | [`Format::Depth32Float`] | reversed: 1 at the near plane, 0 infinitely far away |
/// | `normal` | [`Format::Rg16Float`] | world space, octahedral (Cigolle et al. 2014) |
/// | `diffuse` | [`Format::Rgba8Srgb`] | share of light reflected |
/// | `radiance` | [`Format::Rgba16Float`] | light given off, linear; the background where nothing is |
#[derive(Clone, Copy, Debug, Default)]
pub struct GeometryBuffer;

impl RenderProcess for GeometryBuffer {
    fn name(&self) -> &str {
        "geometry buffer"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("normal", Format::Rg16Float, ClearColor::Value([0.0; 4]));
        declare.clears_color("diffuse", Format::Rgba8Srgb, ClearColor::Value([0.0; 4]));
        declare.clears_color("radiance", Format::Rgba16Float, ClearColor::Background);
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: include_str!("geometry_buffer.wgsl"), ..CommandDraws::default() })
    }
}
