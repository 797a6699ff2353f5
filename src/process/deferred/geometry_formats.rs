//! The formats of the geometry buffer's targets.

use crate::process::Format;

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
}

impl Default for GeometryFormats {
    fn default() -> Self {
        Self { normal: Format::Rg16Float, diffuse: Format::Rgba8Srgb, radiance: Format::Rgba16Float }
    }
}

impl GeometryFormats {
    /// The first target whose format lacks a channel that it needs.
    pub(super) fn first_unsuitable(&self) -> Option<(&'static str, Format)> {
        let targets = [("normal", self.normal, 2), ("diffuse", self.diffuse, 3), ("radiance", self.radiance, 3)];
        let unsuitable = targets.into_iter().find(|(_, format, channels)| format.channels() < *channels);
        unsuitable.map(|(target, format, _)| (target, format))
    }
}
