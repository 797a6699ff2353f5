//! `normal_encoding.wgsl` in Rust.

use crate::process::deferred::shading::normal_encoding::{NormalEncoding, STEPS_OF_TWO_BYTES};
use crate::process::{GeometryFormats, direction_from_octahedral, octahedral_from_direction};
use crate::raster::{Real, Vector, Vector2, Vector3, Vector4};

/// The normal encoding for CPU shaders.
impl GeometryFormats {
    /// The value that a shader writes to the target `normal`, for a normal of any length. A normal without direction is
    /// stored as +Z.
    pub fn encode_normal<R: Real>(&self, normal: Vector3<R>) -> Vector4<R> {
        let sum = normal[0].abs() + normal[1].abs() + normal[2].abs();
        let has_direction = sum > R::zero() && sum.is_finite();
        let point = if has_direction { octahedral_from_direction(normal) } else { Vector::zero() };
        let of_two = |Vector([x, y]): Vector2<R>| Vector([x, y, R::zero(), R::one()]);
        let whole_of = |steps| point.map(|coordinate| (coordinate * R::of(steps)).round() + R::of(steps));
        match NormalEncoding::of(self.normal) {
            NormalEncoding::Signed => of_two(point),
            NormalEncoding::Steps { steps, largest } => of_two(whole_of(steps).map(|whole| whole / R::of(largest))),
            NormalEncoding::TwoBytes => {
                let whole = whole_of(STEPS_OF_TWO_BYTES);
                let high = whole.map(|whole| (whole / R::of(256.0)).floor());
                let low = whole - high * R::of(256.0);
                Vector([high[0], high[1], low[0], low[1]]).map(|byte| byte / R::of(255.0))
            }
        }
    }

    /// The world-space normal of a texel of the target `normal`, of unit length.
    pub fn decode_normal<R: Real>(&self, texel: Vector4<R>) -> Vector3<R> {
        let first = Vector([texel[0], texel[1]]);
        let of_whole = |whole: R, steps| (whole - R::of(steps)) / R::of(steps);
        direction_from_octahedral(match NormalEncoding::of(self.normal) {
            NormalEncoding::Signed => first,
            NormalEncoding::Steps { steps, largest } => {
                first.map(|stored| of_whole((stored * R::of(largest)).round(), steps))
            }
            NormalEncoding::TwoBytes => {
                let [high_x, high_y, low_x, low_y] = texel.map(|stored| (stored * R::of(255.0)).round()).0;
                let whole = Vector([high_x, high_y]) * R::of(256.0) + Vector([low_x, low_y]);
                whole.map(|whole| of_whole(whole, STEPS_OF_TWO_BYTES))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::process::Format;
    use crate::quality::NormalFormat;

    const ALL: [NormalFormat; 4] =
        [NormalFormat::Octahedral8, NormalFormat::Octahedral10, NormalFormat::Octahedral16, NormalFormat::HalfFloat];

    fn formats(normal: Format) -> GeometryFormats {
        GeometryFormats { normal, ..GeometryFormats::default() }
    }

    /// A channel as a device stores it: the nearest byte, or the worst half float that rounding allows.
    fn rounded(format: Format, channel: f64) -> f64 {
        let steps = match format {
            Format::Rg8Unorm | Format::Rgba8Unorm => 255.0,
            Format::Rgb10a2Unorm => 1023.0,
            // Eleven bits, never finer than 2^-24, and cut short.
            _ => {
                let step = (channel.abs().log2().floor().max(-14.0) - 10.0).exp2();
                return (channel / step).trunc() * step;
            }
        };
        assert!((0.0..=1.0).contains(&channel), "{channel}");
        (channel * steps).round() / steps
    }

    fn read_back<R: Real>(format: Format, normal: DVec3) -> DVec3 {
        let stored = formats(format).encode_normal(Vector3::<R>::of(normal));
        let texel = stored.map(|channel| R::of(rounded(format, channel.as_f64())));
        DVec3::from(formats(format).decode_normal(texel).0.map(Real::as_f64))
    }

    fn off(one: DVec3, other: DVec3) -> f64 {
        one.cross(other).length().atan2(one.dot(other)).to_degrees()
    }

    /// Directions spread evenly (a Fibonacci spiral); those halfway between the steps of each format, on every face of
    /// the octahedron; and its edges and corners.
    fn directions() -> Vec<DVec3> {
        let spiral = (0..50_000).map(|index| {
            let z = 1.0 - (f64::from(index) + 0.5) / 25_000.0;
            let (sine, cosine) = (f64::from(index) * 2.399_963_229_728_653).sin_cos();
            DVec3::new(cosine, sine, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        });
        let between = [127.0, 511.0, 32_767.0, 4096.0].into_iter().flat_map(|steps: f64| {
            let third = (steps / 3.0).floor();
            let near =
                (-20..20).flat_map(move |x| (-20..20).map(move |y| [third + f64::from(x), third + f64::from(y)]));
            near.map(move |steps_away| steps_away.map(|step| (step + 0.5) / steps))
        });
        let between = between.flat_map(|[x, y]| [[x, y], [0.0, x], [1.0 - x, x]]);
        let faces = between.flat_map(|[x, y]| {
            let signs = (0..8).map(|face| [1, 2, 4].map(|bit| if face & bit == 0 { 1.0 } else { -1.0 }));
            signs.map(move |[right, up, out]| DVec3::new(x * right, y * up, (1.0 - x - y) * out))
        });
        spiral.chain(faces).map(DVec3::normalize).collect()
    }

    #[test]
    fn normals_are_within_their_bound_in_f32_and_f64() {
        for normals in ALL {
            let format = Format::from(normals);
            let worst = |read: fn(Format, DVec3) -> DVec3| {
                directions().into_iter().map(|normal| off(read(format, normal), normal)).fold(0.0, f64::max)
            };
            for worst in [worst(read_back::<f32>), worst(read_back::<f64>)] {
                assert!(worst <= normals.max_error_degrees(), "{normals:?}: {worst}");
                // Otherwise the bound would be too loose.
                assert!(worst >= normals.max_error_degrees() * 0.4, "{normals:?}: {worst}");
            }
        }
    }

    #[test]
    fn normals_along_an_axis_are_exact() {
        for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            for format in ALL.map(Format::from) {
                assert!(off(read_back::<f64>(format, axis), axis) < 1e-12, "{format:?} {axis}");
                assert!(off(read_back::<f32>(format, axis), axis) < 1e-5, "{format:?} {axis}");
            }
        }
    }

    #[test]
    fn length_does_not_matter_and_a_normal_without_direction_is_up() {
        let across = DVec3::new(1.0, -2.0, -3.0).normalize();
        let broken = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        let broken = broken.map(|number| DVec3::new(number, 0.5, -0.5)).into_iter().chain([DVec3::ZERO, -DVec3::ZERO]);
        for format in ALL.map(Format::from) {
            for normal in broken.clone() {
                assert!(off(read_back::<f32>(format, normal), DVec3::Z) < 1e-5, "{format:?} {normal}");
                assert!(off(read_back::<f64>(format, normal), DVec3::Z) < 1e-12, "{format:?} {normal}");
            }
            for length in [1e-30, 1e-3, 7.0, 1e30] {
                let bound =
                    2.0 * ALL.iter().find(|&&normals| Format::from(normals) == format).unwrap().max_error_degrees();
                assert!(off(read_back::<f32>(format, across * length), across) <= bound, "{format:?} {length}");
            }
        }
    }

    /// A shader that reads only the first two channels of a format of bytes is off by a step.
    #[test]
    fn the_high_bytes_approximate_the_normal() {
        for normal in directions() {
            let two = formats(Format::Rgba8Unorm).encode_normal(Vector3::<f64>::of(normal));
            let one = formats(Format::Rgba8Srgb).encode_normal(Vector3::<f64>::of(normal));
            for axis in 0..2 {
                assert!((two[axis] - one[axis]).abs() <= 1.0 / 255.0, "{normal}: {two:?} {one:?}");
            }
        }
    }

    #[test]
    fn the_wgsl_has_the_same_constants() {
        for (format, constants) in [
            (Format::Rg16Float, ["NORMAL_ENCODING: u32 = 0u;", ""]),
            (
                Format::Rg8Unorm,
                ["NORMAL_ENCODING: u32 = 1u;", "NORMAL_STEPS: f32 = 127.0;\nconst NORMAL_LARGEST: f32 = 255.0;"],
            ),
            (Format::Rgb10a2Unorm, ["NORMAL_STEPS: f32 = 511.0;", "NORMAL_LARGEST: f32 = 1023.0;"]),
            (Format::Rgba8Unorm, ["NORMAL_ENCODING: u32 = 2u;", "NORMAL_STEPS: f32 = 32767.0;"]),
        ] {
            let text = formats(format).normal_encoding_wgsl();
            assert!(constants.iter().all(|constant| text.contains(constant)), "{format:?}: {text}");
        }
    }
}
