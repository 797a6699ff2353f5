//! The geometry buffer (L 4.1).

use std::borrow::Cow;

use super::geometry_buffer_twin::GeometryBufferTwin;
use super::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess, Twin};
use crate::command::{Blending, MaterialShare, Selection};

/// Stores what lighting needs of the nearest opaque surface at each pixel, in the targets of L 4.1 and one for radiance:
///
/// | target | what | format, unless set otherwise |
/// | --- | --- | --- |
/// | `depth` | reversed depth, 0 where nothing is | [`Format::Depth32Float`] |
/// | `normal` | in the world, octahedral (Cigolle et al. 2014): see [`GeometryFormats::normals_wgsl`] | [`Format::Rg16Float`] |
/// | `diffuse` | the share of light reflected, 0 to 1 | [`Format::Rgba8Srgb`] |
/// | `radiance` | what the surface gives off by itself and reflects of the ambient light, and the scene's background | [`Format::Rgba16Float`] |
///
/// The seven steps of L 4.1 are: set the viewport, the targets, the depth state and the rasterizer state; clear the depth; draw
/// each object; finish. The viewport is the picture's, and the states are the pipelines'.
#[derive(Clone, Debug)]
pub struct GeometryBuffer {
    name: String,
    shader: String,
    formats: GeometryFormats,
    share: MaterialShare,
    has_depth: bool,
}

/// What the geometry buffer's targets are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometryFormats {
    /// Of `normal`: two channels or more. `NormalFormat::Octahedral16.into()` is one; [`GeometryFormats::normals_wgsl`] says how far
    /// off normals are in each.
    pub normal: Format,
    /// Of `diffuse`: three channels or more.
    pub diffuse: Format,
    /// Of `radiance`: three channels or more. A format that ends at 1 ends bright light there, before tone mapping.
    pub radiance: Format,
}

impl Default for GeometryFormats {
    fn default() -> Self {
        Self { normal: Format::Rg16Float, diffuse: Format::Rgba8Srgb, radiance: Format::Rgba16Float }
    }
}

impl GeometryFormats {
    /// The first target whose format lacks a channel that it needs.
    pub(super) fn misfit(&self) -> Option<(&'static str, Format)> {
        let targets = [("normal", self.normal, 2), ("diffuse", self.diffuse, 3), ("radiance", self.radiance, 3)];
        let misfit = targets.into_iter().find(|(_, format, channels)| format.channels() < *channels);
        misfit.map(|(target, format, _)| (target, format))
    }
}

impl GeometryBuffer {
    /// One that draws every opaque object.
    pub fn new(formats: GeometryFormats) -> Self {
        Self::of_share(formats, MaterialShare::ALL)
    }

    /// One that draws the objects of a share of the materials (L 5). The first share clears the targets, the others draw over
    /// it: all of them are recorded at the same time.
    pub fn of_share(formats: GeometryFormats, share: MaterialShare) -> Self {
        let name = if share.of <= 1 {
            String::from("geometry buffer")
        } else {
            format!("geometry buffer {} of {}", share.index + 1, share.of)
        };
        let shader =
            [include_str!("surface.wgsl"), &formats.normals_wgsl(), include_str!("geometry_buffer.wgsl")].concat();
        Self { name, shader, formats, share, has_depth: false }
    }

    /// The same after a [`DepthPrePass`](super::DepthPrePass): it draws only what has just the depth that is there.
    pub fn after_depth_pre_pass(self) -> Self {
        Self { has_depth: true, ..self }
    }
}

impl RenderProcess for GeometryBuffer {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        let GeometryFormats { normal, diffuse, radiance } = self.formats;
        let nothing = ClearColor::Value([0.0; 4]);
        let targets = [
            ("normal", normal, nothing),
            ("diffuse", diffuse, nothing),
            ("radiance", radiance, ClearColor::Background),
        ];
        let first = self.share.index == 0;
        for (target, format, clear) in targets {
            if first {
                declare.clears_color(target, format, clear);
            } else {
                declare.draws_over(target);
            }
        }
        if self.has_depth {
            declare.matches_depth("depth");
        } else if first {
            declare.clears_depth("depth", Format::Depth32Float);
        } else {
            declare.draws_depth("depth");
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            fragment: Some("fragment"),
            selection: Selection { blending: Blending::Opaque, materials: self.share },
            writes_depth: !self.has_depth,
            parameters: Cow::Borrowed(&[]),
        })
    }

    fn twin(&self) -> Option<Twin> {
        Some(Twin::objects(GeometryBufferTwin { formats: self.formats }))
    }
}
