//! How many small contributions of light are added.

/// How lights and blended objects are added to the target `radiance`, which has half floats.
///
/// A sum of n terms in a format is rounded n times, each time by up to the format's step at the sum so far. A term
/// below half of that step vanishes, and if a device truncates, a term below the whole of it. So a half float stops
/// growing at some 2,000 to 4,000 equal terms: 1,000 lights that add up to one lose up to a third, and 10,000 nearly
/// all. The error of each value is that of [`max_light_error`](Self::max_light_error) and
/// [`max_blended_error`](Self::max_blended_error).
///
/// Emitted and ambient light is stored in half floats too: once, with an error of 2⁻¹⁰ of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RadianceSum {
    /// One by one, in half floats.
    ///
    /// Cost: 8 bytes per pixel, read and written for every light that reaches it.
    #[default]
    HalfFloat,
    /// One by one, in floats: lights in a target of their own, blended objects in another. Each target is added to
    /// `radiance` once.
    ///
    /// Cost: 16 bytes per pixel, read and written for every light that reaches it, and up to two targets of that size.
    /// It needs a device that [blends floats](crate::backend::BackendExtras::can_blend_floats). Without one, lights are
    /// summed as by [`Self::Shader`], and blended objects as by [`Self::HalfFloat`], which frames count as
    /// [`HalfFloatBlending`](crate::view::IssueReason::HalfFloatBlending).
    Float,
    /// Lights by a shader that adds them in batches of 32, these in batches of 32, and then to `radiance` once. On
    /// every device. Blended objects as by [`Self::Float`].
    ///
    /// Cost: every pixel tests the lights that may reach its tile of 32 × 32 pixels, which a pass before it marks: for
    /// many small lights, that is slower than [`Self::Float`]. No bytes per light, and one per pixel. Mesa's llvmpipe
    /// ends a pixel's loops after 65,535 iterations: of more than 50,000 lights that reach one tile it leaves out the
    /// last.
    Shader,
}

impl RadianceSum {
    /// The maximum error of the light that this number of lights adds to a pixel, as a fraction of what the pixel's
    /// radiance becomes: in addition to the error of each light by itself.
    ///
    /// Let h be 2⁻¹⁰ and u 2⁻²³: what an addition in half floats and in floats loses of the sum if a device truncates,
    /// and twice what it loses if it rounds to nearest. No partial sum exceeds the last one, so
    ///
    /// - n blends in half floats lose nh, and h for the conversion of each light. None loses more than its own light,
    ///   so all lose at most 1;
    /// - n blends in floats lose nu, the conversion of each light u, and the addition to `radiance` h;
    /// - in a shader each light is one of up to 32 terms, their sum one of up to 32, and that one of n/1024. The last
    ///   two additions, the division by π and the product with the diffuse colour make 5u more.
    ///
    /// Beside it, a half float is off by up to 2⁻²⁴ per addition to it, in absolute terms: its smallest step. A sum
    /// above 60,000 counts as 60,000.
    pub fn max_light_error(self, lights: u32) -> f64 {
        let n = f64::from(lights);
        match self {
            _ if lights == 0 => 0.0,
            Self::HalfFloat => ((n + 1.0) * HALF).min(1.0),
            Self::Float => (n + 1.0) * SINGLE + HALF,
            Self::Shader => (n.min(32.0) + (n / 32.0).min(32.0) + n / 1024.0 + 5.0) * SINGLE + HALF,
        }
    }

    /// The maximum error of the radiance of a pixel that this number of blended objects covers: as a fraction of the
    /// radiance that it would have if they were opaque to nothing and all added, on a device that [blends
    /// floats](crate::backend::BackendExtras::can_blend_floats). On others every value has the error of
    /// [`Self::HalfFloat`].
    ///
    /// No partial sum exceeds that radiance. A blend has two products, of colour and opacity and of transmittance and
    /// sum, an addition, and the conversion of its colour: 4h in half floats, 4u in floats, where the opacity that is
    /// left is off by 3u in addition. The addition to `radiance` loses h, and 2u for its product.
    pub fn max_blended_error(self, objects: u32) -> f64 {
        let n = f64::from(objects);
        match self {
            _ if objects == 0 => 0.0,
            Self::HalfFloat => (4.0 * n * HALF).min(1.0),
            Self::Float | Self::Shader => (7.0 * n + 2.0) * SINGLE + HALF,
        }
    }
}

/// What a half float may lose when it is rounded, as a fraction of it.
const HALF: f64 = 1.0 / 1024.0;

/// What a float may lose when it is rounded, as a fraction of it.
const SINGLE: f64 = 1.0 / 8_388_608.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shader_keeps_a_thousandth_for_more_lights_than_half_floats_count() {
        for lights in [1, 100, 10_000, 100_000] {
            assert!(RadianceSum::Shader.max_light_error(lights) < 1e-3);
        }
        assert!(RadianceSum::Float.max_light_error(100) < 1e-3 && RadianceSum::Float.max_light_error(10_000) < 3e-3);
        assert_eq!(RadianceSum::HalfFloat.max_light_error(10_000), 1.0);
        for sum in [RadianceSum::HalfFloat, RadianceSum::Float, RadianceSum::Shader] {
            let errors = [0, 1, 31, 32, 33, 1024, 1025, u32::MAX].map(|count| sum.max_light_error(count));
            assert!(errors[0] == 0.0 && errors.is_sorted(), "{errors:?}");
        }
    }
}
