//! How a layer is composited over the picture.

use drawloom::process::Format;

/// How a layer is composited over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerSettings {
    /// How a pixel of the layer and one of the picture are combined.
    pub blend: LayerBlend,
    /// How much of the layer: 0 leaves the picture as it is, and 1 is all of it. Not above 1 where it multiplies.
    pub strength: f32,
    /// Where a pixel's part of the layer is looked up.
    pub reprojection: LayerReprojection,
    /// The format of the step's target: see [`PostStep`](drawloom::process::PostStep).
    pub format: Format,
}

/// How a pixel of a layer and one of the picture are combined. Where there is no layer, the picture stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerBlend {
    /// Light: it is added.
    #[default]
    Add,
    /// Occlusion: the picture is multiplied with it.
    Multiply,
}

/// Where a pixel's part of a layer is looked up, which is of an earlier frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerReprojection {
    /// At the pixel's own place: when the camera turns, the layer lags behind the picture.
    None,
    /// Where the pixel's surface was in the frame that the layer is of, by the target `depth`; where that frame did not
    /// show it, at the layer's nearest edge. Surfaces that moved themselves, and those that something else hid in that
    /// frame, have the layer of another surface.
    #[default]
    ByDepth,
    /// The same, but where that frame did not show the surface, at the pixel's own place.
    ByDepthOrSamePlace,
    /// The same, but where that frame did not show the surface, there is no layer.
    ByDepthOrNone,
}

impl Default for LayerSettings {
    /// Light that is added in full, reprojected, into [`Format::Rgba16Float`].
    fn default() -> Self {
        Self {
            blend: LayerBlend::default(),
            strength: 1.0,
            reprojection: LayerReprojection::default(),
            format: Format::Rgba16Float,
        }
    }
}
