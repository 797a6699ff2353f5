//! The knobs of shadow maps.

use super::QualityError;

/// How shadow maps are drawn and read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowQuality {
    /// Width and height of a map, 1 pixel or more.
    ///
    /// Error: pixels of the picture that are lit and should not be, or the other way round: along a shadow's edge, as wide as a
    /// pixel of the map. Cost: pixels drawn, and 4 bytes each.
    pub side: u32,
    /// Shadows fade over 2·`filter` + 1 pixels of the map, 0 to [`ShadowQuality::MAX_FILTER`]; 0 still blends each pixel with its
    /// neighbour. Cost: (2·`filter` + 2)² pixels of the map read for one of the picture.
    pub filter: u32,
    /// How far a shadow is moved off the surface that casts it, as a multiple of what a pixel's width and the surface's slope ask
    /// for, 0 or more. Less than 1 makes lit surfaces shadow themselves in stripes; more lets light through under objects.
    pub bias: f32,
    /// Maps are drawn in every so many-th frame, 1 or more; and at once where lights with a map come or go, where there is another
    /// quality or plan, or where a directional light's map is off what cameras see by then by a quarter of its radius, or a quarter smaller.
    /// In between a light that has a map stays where it was with it, and ends where it did.
    ///
    /// Error: shadows are up to `interval` − 1 frames old, so those of what moves at v m/s lag by (`interval` − 1)·v·Δt metres. Cost:
    /// the maps' share of a frame, divided by this.
    pub interval: u32,
    /// Into what angle of a hemispherical light's map an edge is drawn straight at most, in degrees, above 0 and up to 90: longer
    /// ones are halved. Straight, it is off by 38 pixels of a map of 1024 at 45°, 7.7 at 20°, 1.9 at 10°, 0.48 at 5° and 0.08 at
    /// 2° (Brabec et al. 2002). Cost: each halving draws four triangles for one.
    pub widest_edge: f32,
}

impl ShadowQuality {
    /// The widest [`ShadowQuality::filter`]: 100 pixels of the map are read for one of the picture.
    pub const MAX_FILTER: u32 = 4;

    pub(super) fn check(&self) -> Result<(), QualityError> {
        let Self { side, filter, bias, interval, widest_edge } = *self;
        let check = |holds, knob, value: String, range| {
            if holds { Ok(()) } else { Err(QualityError::OutOfRange { knob, value, range }) }
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
