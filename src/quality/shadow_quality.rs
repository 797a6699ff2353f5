//! Shadow map settings.

use super::QualityError;

/// Shadow map settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowQuality {
    /// The width and height of a map in pixels, at least 1.
    ///
    /// Error: along shadow edges, pixels of the picture that are wrongly lit or wrongly in shadow, in a band as wide as
    /// a pixel of the map. Cost: pixels drawn, and 4 bytes each.
    pub side: u32,
    /// The radius of percentage-closer filtering, 0 to [`ShadowQuality::MAX_FILTER`]: shadows fade over 2·`filter` + 1
    /// pixels of the map; 0 is bilinear filtering. Cost: (2·`filter` + 2)² pixels of the map are read for each pixel of
    /// the picture.
    pub filter: u32,
    /// The depth bias, as a multiple of what a pixel's width and the surface's slope require, at least 0. Below 1, lit
    /// surfaces shadow themselves in stripes (shadow acne); above, light leaks through under objects (peter-panning).
    pub bias: f32,
    /// Maps are drawn every `interval` frames, at least 1, those of different lights in turns: a map is a view that is
    /// [redrawn](crate::scene::Redraw) in this interval of frames. They are also drawn at once if a light with a map is
    /// added or removed, or if the quality or the plan changes; those of a directional light for a main camera, if one
    /// no longer fits what that sees: if its centre is off by a quarter of its radius, or its radius is a quarter too
    /// small; those of other lights, if their range grows by more than an eighth. In between, a light with a map keeps
    /// its position, direction and range.
    ///
    /// Error: shadows are up to `interval` − 1 frames old, so those of objects that move at v m/s lag by (`interval` −
    /// 1)·v·Δt metres. Cost: the maps' share of a frame, divided by this.
    pub interval: u32,
    /// The largest angle, in degrees, under which a hemispherical light sees an edge that its map draws as a straight
    /// line, above 0 and up to 90: longer edges are subdivided. The error of a straight edge is 39 pixels of a map of
    /// 1024 at 45°, 7.8 at 20°, 1.95 at 10°, 0.49 at 5° and 0.08 at 2° (Brabec et al. 2002); that of a mask's holes,
    /// which lie between edges, is up to a third larger. Cost: each subdivision level multiplies triangles by four.
    pub widest_edge: f32,
}

impl ShadowQuality {
    /// The largest [`ShadowQuality::filter`]: it reads 100 pixels of the map for each pixel of the picture.
    pub const MAX_FILTER: u32 = 4;

    /// Checks all settings.
    ///
    /// # Errors
    /// Returns [`QualityError::OutOfRange`] if a setting is out of range.
    pub(super) fn check(&self) -> Result<(), QualityError> {
        let Self { side, filter, bias, interval, widest_edge } = *self;
        let check = |holds, setting, value: String, range| {
            if holds { Ok(()) } else { Err(QualityError::OutOfRange { setting, value, range }) }
        };
        check(side > 0, "shadows.side", side.to_string(), "1 pixel or more")?;
        check(filter <= Self::MAX_FILTER, "shadows.filter", filter.to_string(), "0 to 4")?;
        check(bias >= 0.0 && bias.is_finite(), "shadows.bias", bias.to_string(), "0 or more, and finite")?;
        check(interval > 0, "shadows.interval", interval.to_string(), "1 frame or more")?;
        let is_angle = widest_edge > 0.0 && widest_edge <= 90.0;
        check(is_angle, "shadows.widest_edge", widest_edge.to_string(), "above 0 and up to 90 degrees")
    }
}

impl Default for ShadowQuality {
    fn default() -> Self {
        Self { side: 1024, filter: 1, bias: 1.0, interval: 1, widest_edge: 5.0 }
    }
}
