//! The formats of the geometry buffer's targets.

use crate::process::{Format, Target, targets};

/// The formats of the geometry buffer's targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometryFormats {
    /// Of `normal`: two channels or more, such as `NormalFormat::Octahedral16.into()`.
    /// [`GeometryFormats::normal_encoding_wgsl`] lists the error of each.
    pub normal: Format,
    /// Of `diffuse`: three channels or more.
    pub diffuse: Format,
    /// Of `radiance`: three channels or more. A format whose values end at 1 clips bright light before tone mapping.
    pub radiance: Format,
    /// Of `depth`: one with depth, and with a [stencil](crate::process::Stencil) if processes of the engine use one.
    pub depth: Format,
}

impl Default for GeometryFormats {
    fn default() -> Self {
        Self {
            normal: Format::Rg16Float,
            diffuse: Format::Rgba8Srgb,
            radiance: Format::Rgba16Float,
            depth: Format::Depth32Float,
        }
    }
}

impl GeometryFormats {
    /// The first target whose format lacks what it needs.
    pub(super) fn first_unsuitable(&self) -> Option<(Target, Format)> {
        let targets = [
            (targets::NORMAL, self.normal, 2),
            (targets::DIFFUSE, self.diffuse, 3),
            (targets::RADIANCE, self.radiance, 3),
        ];
        let lacks = |(target, format, channels): &(Target, Format, usize)| {
            // Lights are added to radiance.
            let is_blended = *target == targets::RADIANCE;
            format.is_depth_stencil()
                || format.is_integer()
                || format.channels() < *channels
                || (is_blended && !format.can_be_blended())
        };
        let unsuitable = targets.into_iter().find(lacks).map(|(target, format, _)| (target, format));
        unsuitable.or_else(|| (!self.depth.has_depth()).then_some((targets::DEPTH, self.depth)))
    }
}
