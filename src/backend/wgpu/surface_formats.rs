//! Which formats a window's surface, the pictures in it and what is drawn over them have.

use super::resources::texture_format;
use crate::process::Format;

/// The formats in which a surface's texture is made and drawn into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceFormats {
    pub(super) surface: wgpu::TextureFormat,
    /// The one of an overlay, which wants one without sRGB.
    pub(super) overlay: wgpu::TextureFormat,
    /// Whether the renderer draws into the texture, in its own format.
    pub(super) is_direct: bool,
}

impl SurfaceFormats {
    /// The best of the formats that a surface offers, for pictures of the format `picture`; `None` if there is none.
    ///
    /// | the surface offers | texture | renderer |
    /// | --- | --- | --- |
    /// | `picture` | `picture` | draws into it |
    /// | the same without sRGB, and views of other formats | that | draws into a view of it |
    /// | others | the first of 8 bits, or the first | draws into a texture of its own, which is converted |
    pub(super) fn choose(offered: &[wgpu::TextureFormat], has_view_formats: bool, picture: Format) -> Option<Self> {
        let drawn = texture_format(picture);
        let same_bytes = |format: &&wgpu::TextureFormat| format.remove_srgb_suffix() == drawn.remove_srgb_suffix();
        let exact = offered.iter().find(|format| **format == drawn);
        // Overlays look right in 8 bits.
        let has_8_bits = |format: &&wgpu::TextureFormat| {
            matches!(format.remove_srgb_suffix(), wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm)
        };
        let direct = exact.or_else(|| offered.iter().find(same_bytes));
        let surface = *direct.or_else(|| offered.iter().find(has_8_bits)).or(offered.first())?;
        let is_direct = surface == drawn || (has_view_formats && same_bytes(&&surface));
        Some(Self {
            surface,
            overlay: if has_view_formats { surface.remove_srgb_suffix() } else { surface },
            is_direct,
        })
    }

    /// Whether what is written counts as linear, so that it must not be sRGB encoded yet.
    pub(super) fn is_linear(&self) -> bool {
        self.surface == wgpu::TextureFormat::Rgba16Float || self.surface.is_srgb()
    }
}

/// The format of pictures that need no conversion for a surface that offers these formats, if there is one.
pub(super) fn picture_format(offered: &[wgpu::TextureFormat]) -> Format {
    let find = |format: &wgpu::TextureFormat| match format.remove_srgb_suffix() {
        wgpu::TextureFormat::Bgra8Unorm => Some(Format::Bgra8Srgb),
        wgpu::TextureFormat::Rgba8Unorm => Some(Format::Rgba8Srgb),
        _ => None,
    };
    offered.iter().find_map(find).unwrap_or(Format::Rgba8Srgb)
}

#[cfg(test)]
mod tests {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgb10a2Unorm, Rgba8Unorm, Rgba8UnormSrgb, Rgba16Float};

    use super::*;

    #[test]
    fn pictures_are_drawn_into_the_surface_where_formats_allow() {
        let choose = |offered: &[_], has_view_formats| {
            let formats = SurfaceFormats::choose(offered, has_view_formats, Format::Bgra8Srgb).unwrap();
            (formats.surface, formats.overlay, formats.is_direct)
        };
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], true), (Bgra8UnormSrgb, Bgra8Unorm, true));
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], false), (Bgra8UnormSrgb, Bgra8UnormSrgb, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], true), (Bgra8Unorm, Bgra8Unorm, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], false), (Bgra8Unorm, Bgra8Unorm, false));
        assert_eq!(choose(&[Rgba16Float, Rgba8Unorm], true), (Rgba8Unorm, Rgba8Unorm, false));
        assert_eq!(choose(&[Rgba16Float], true), (Rgba16Float, Rgba16Float, false));
        assert_eq!(SurfaceFormats::choose(&[], true, Format::Bgra8Srgb), None);
    }

    #[test]
    fn pictures_have_the_first_format_that_needs_no_conversion() {
        assert_eq!(picture_format(&[Rgba16Float, Bgra8Unorm, Rgba8Unorm]), Format::Bgra8Srgb);
        assert_eq!(picture_format(&[Rgba8UnormSrgb, Bgra8Unorm]), Format::Rgba8Srgb);
        assert_eq!(picture_format(&[Rgb10a2Unorm]), Format::Rgba8Srgb);
    }
}
