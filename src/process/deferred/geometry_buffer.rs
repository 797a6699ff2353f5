//! The geometry buffer (L 4.1).

#[cfg(feature = "software")]
mod cpu_shader;

use super::GeometryFormats;
use super::shading::{COLORED_SURFACE_SHADER, SURFACE_SHADER};
use crate::command::Selection;
use crate::process::{ClearColor, CommandDraws, Declare, Draws, MaskedEntryPoints, RenderProcess, targets};
use crate::scene::VERTEX_COLOR;

/// Stores what lighting needs of the nearest opaque surface at each pixel, in the targets of L 4.1 and one for
/// radiance:
///
/// | target | content | default format |
/// | --- | --- | --- |
/// | `depth` | reversed depth, 0 where nothing was drawn | [`Depth32Float`](crate::process::Format::Depth32Float) |
/// | `normal` | world-space normal, octahedral (Cigolle et al. 2014): see [`GeometryFormats::normal_encoding_wgsl`] | [`Rg16Float`](crate::process::Format::Rg16Float) |
/// | `diffuse` | the fraction of light reflected, 0 to 1 | [`Rgba8Srgb`](crate::process::Format::Rgba8Srgb) |
/// | `radiance` | emitted light and reflected ambient light; elsewhere the scene's background | [`Rgba16Float`](crate::process::Format::Rgba16Float) |
///
/// [Masked](crate::scene::Material::is_masked) objects are drawn with their holes, by pipelines of their own: others
/// need not discard.
///
/// The seven steps of L 4.1 are: set the viewport, the targets, the depth state and the rasterizer state; clear the
/// depth; draw each object; finish. The viewport is the picture's, and the states are the pipelines'.
#[derive(Clone, Debug)]
pub struct GeometryBuffer {
    name: String,
    shader: String,
    formats: GeometryFormats,
    /// The share of the materials that it draws, and how many shares there are.
    share: (u32, u32),
    has_depth: bool,
    has_colors: bool,
}

impl GeometryBuffer {
    /// Draws every opaque object whose material has no [`MaterialType`](crate::scene::MaterialType).
    pub fn new(formats: GeometryFormats) -> Self {
        Self::of_share(formats, 0, 1)
    }

    /// Draws the objects of share `index` of `of` shares of the materials (L 5). The first share clears the targets,
    /// the others draw over them: all shares are recorded at the same time.
    pub(crate) fn of_share(formats: GeometryFormats, index: u32, of: u32) -> Self {
        let name =
            if of <= 1 { String::from("geometry buffer") } else { format!("geometry buffer {} of {of}", index + 1) };
        Self {
            name,
            shader: shader(SURFACE_SHADER, formats),
            formats,
            share: (index, of),
            has_depth: false,
            has_colors: false,
        }
    }

    /// The same with [`VERTEX_COLOR`]: it multiplies diffuse colours by those of the vertices, which are white in
    /// meshes without colours.
    pub fn with_vertex_colors(self) -> Self {
        Self { shader: shader(COLORED_SURFACE_SHADER, self.formats), has_colors: true, ..self }
    }

    /// The same after a [`DepthPrePass`](super::DepthPrePass): it draws only pixels whose depth equals the stored
    /// depth.
    pub fn after_depth_pre_pass(self) -> Self {
        Self { has_depth: true, ..self }
    }
}

/// The shader that draws such surfaces.
fn shader(surface: &str, formats: GeometryFormats) -> String {
    [surface, &formats.normal_encoding_wgsl(), include_str!("geometry_buffer/geometry_buffer.wgsl")].concat()
}

impl RenderProcess for GeometryBuffer {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        let GeometryFormats { normal, diffuse, radiance, depth } = self.formats;
        let zero = ClearColor::Value([0.0; 4]);
        let targets = [
            (targets::NORMAL, normal, zero),
            (targets::DIFFUSE, diffuse, zero),
            (targets::RADIANCE, radiance, ClearColor::Background),
        ];
        let first = self.share.0 == 0;
        for (target, format, clear) in targets {
            if first {
                declare.clears_color(target, format, clear);
            } else {
                declare.draws_over(target);
            }
        }
        if self.has_colors {
            declare.reads_attribute(VERTEX_COLOR, [1.0; 3]);
        }
        if self.has_depth {
            declare.matches_depth(targets::DEPTH);
        } else if first {
            declare.clears_depth(targets::DEPTH, depth);
        } else {
            declare.draws_depth(targets::DEPTH);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let (index, of) = self.share;
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: Selection::OPAQUE.of_shipped_materials().of_material_share(index, of),
            writes_depth: !self.has_depth,
            masked: Some(MaskedEntryPoints { vertex: "vertex", fragment: "masked_fragment" }),
            ..CommandDraws::default()
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        let Self { formats, has_colors, .. } = *self;
        Some(crate::process::CpuShader::objects(cpu_shader::GeometryBufferCpuShader { formats, has_colors }))
    }
}
