//! Blends colours and converts them to the formats of targets.

use std::array::from_fn;
use std::sync::LazyLock;

use half::f16;

use super::precision::Precision;
use crate::backend::mip_generation::srgb_to_linear;
use crate::process::{BlendComponent, BlendEquation, BlendFactor, Format};
use crate::raster::Vector4;

/// Blends a colour with the one in the target, and converts the result to the format.
///
/// In formats from 0 to 1, colours are clamped before and after blending, as Vulkan and D3D specify. NaN becomes 0.
pub(super) fn blended<R: Precision>(
    format: Format,
    equation: BlendEquation,
    color: Vector4<R>,
    destination: [R; 4],
) -> [R; 4] {
    let Vector4 { 0: source } = color.map(|value| clamped(format, value));
    if equation == BlendEquation::REPLACE || !format.can_be_blended() {
        return stored(format, source);
    }
    let mix = |component, channel: usize| {
        let factor_of = |factor| factor_of(factor, channel, &source, &destination);
        let products = |of_source, of_destination| {
            (source[channel] * factor_of(of_source), destination[channel] * factor_of(of_destination))
        };
        match component {
            BlendComponent::Add { source, destination } => {
                let (source, destination) = products(source, destination);
                source + destination
            }
            BlendComponent::Subtract { source, destination } => {
                let (source, destination) = products(source, destination);
                source - destination
            }
            BlendComponent::ReverseSubtract { source, destination } => {
                let (source, destination) = products(source, destination);
                destination - source
            }
            BlendComponent::Min if destination[channel] < source[channel] => destination[channel],
            BlendComponent::Max if destination[channel] > source[channel] => destination[channel],
            BlendComponent::Min | BlendComponent::Max => source[channel],
        }
    };
    let component_of = |channel: usize| if channel == 3 { equation.alpha } else { equation.color };
    stored(format, from_fn(|channel| mix(component_of(channel), channel)))
}

fn factor_of<R: Precision>(factor: BlendFactor, channel: usize, source: &[R; 4], destination: &[R; 4]) -> R {
    match factor {
        BlendFactor::Zero => R::zero(),
        BlendFactor::One => R::one(),
        BlendFactor::Source => source[channel],
        BlendFactor::OneMinusSource => R::one() - source[channel],
        BlendFactor::SourceAlpha => source[3],
        BlendFactor::OneMinusSourceAlpha => R::one() - source[3],
        BlendFactor::Destination => destination[channel],
        BlendFactor::OneMinusDestination => R::one() - destination[channel],
        BlendFactor::DestinationAlpha => destination[3],
        BlendFactor::OneMinusDestinationAlpha => R::one() - destination[3],
    }
}

/// A colour as a target of this format holds it.
pub(super) fn stored<R: Precision>(format: Format, color: [R; 4]) -> [R; 4] {
    let clamped = color.map(|value| clamped(format, value));
    if !R::ROUNDS {
        return clamped;
    }
    from_fn(|channel| R::of(rounded(encoding_of(format, channel), clamped[channel].as_f64())))
}

/// Appends the bytes of a pixel, as a device has them in memory.
pub(super) fn append_bytes<R: Precision>(format: Format, color: [R; 4], bytes: &mut Vec<u8>) {
    let color: [f64; 4] = color.map(|value| clamped(format, value).as_f64());
    if format == Format::Rgb10a2Unorm {
        let [red, green, blue, opacity] = color;
        let word = step_of(red, 1023.0) | step_of(green, 1023.0) << 10 | step_of(blue, 1023.0) << 20;
        bytes.extend((word | step_of(opacity, 3.0) << 30).to_le_bytes());
        return;
    }
    let first = bytes.len();
    for (channel, value) in color.into_iter().enumerate().take(format.channels()) {
        match encoding_of(format, channel) {
            ChannelEncoding::Steps(steps) => bytes.push(step_of(value, steps) as u8),
            ChannelEncoding::Srgb => bytes.push(srgb_byte_of(value)),
            ChannelEncoding::Half => bytes.extend(half_of(value).to_le_bytes()),
            ChannelEncoding::Float => bytes.extend((value as f32).to_le_bytes()),
            ChannelEncoding::Integer => bytes.extend((value as u32).to_le_bytes()),
        }
    }
    if matches!(format, Format::Bgra8Unorm | Format::Bgra8Srgb) {
        bytes.swap(first, first + 2);
    }
}

/// How a channel is stored.
#[derive(Clone, Copy)]
enum ChannelEncoding {
    /// 0 to 1 in this number of steps.
    Steps(f64),
    /// 0 to 1 in 255 steps, sRGB encoded.
    Srgb,
    Half,
    Float,
    /// A whole number. In f32 it is exact up to 2²⁴.
    Integer,
}

fn encoding_of(format: Format, channel: usize) -> ChannelEncoding {
    match format {
        Format::Rgba8Srgb | Format::Bgra8Srgb if channel < 3 => ChannelEncoding::Srgb,
        Format::Rgb10a2Unorm if channel < 3 => ChannelEncoding::Steps(1023.0),
        Format::Rgb10a2Unorm => ChannelEncoding::Steps(3.0),
        Format::Rgba8Srgb | Format::Rgba8Unorm | Format::Rg8Unorm | Format::R8Unorm => ChannelEncoding::Steps(255.0),
        Format::Bgra8Srgb | Format::Bgra8Unorm => ChannelEncoding::Steps(255.0),
        Format::Rgba16Float | Format::Rg16Float | Format::R16Float => ChannelEncoding::Half,
        Format::Rgba32Float | Format::Rgba32FloatBlendable | Format::R32Float => ChannelEncoding::Float,
        Format::Depth32Float | Format::Depth32FloatStencil8 => ChannelEncoding::Float,
        Format::R32Uint => ChannelEncoding::Integer,
        Format::Stencil8 => ChannelEncoding::Steps(255.0),
    }
}

/// Clamps a number to the format's range; NaN becomes 0.
fn clamped<R: Precision>(format: Format, value: R) -> R {
    if format.is_signed() {
        return if value.is_nan() { R::zero() } else { value };
    }
    let most = if format.is_integer() { R::of(f64::from(u32::MAX)) } else { R::one() };
    // False for NaN.
    if value > R::zero() { value.min(most) } else { R::zero() }
}

fn rounded(encoding: ChannelEncoding, value: f64) -> f64 {
    match encoding {
        ChannelEncoding::Steps(steps) => f64::from(step_of(value, steps)) / steps,
        ChannelEncoding::Srgb => f64::from(LINEAR_OF_BYTES[usize::from(srgb_byte_of(value))]),
        ChannelEncoding::Half => half_of(value).to_f64(),
        ChannelEncoding::Float => value,
        ChannelEncoding::Integer => value.trunc(),
    }
}

/// The nearest half float. For a greater number than the greatest half float, a device may store that or infinity. Here
/// it is that: blending an opaque colour over it multiplies it by 0, which would make NaN of infinity.
fn half_of(value: f64) -> f16 {
    let end = f16::MAX.to_f64();
    f16::from_f32(value.clamp(-end, end) as f32)
}

/// The nearest of 0 to `steps`.
fn step_of(value: f64, steps: f64) -> u32 {
    (value * steps + 0.5) as u32
}

/// The nearest sRGB byte.
fn srgb_byte_of(value: f64) -> u8 {
    BYTE_THRESHOLDS.partition_point(|&threshold| f64::from(threshold) <= value) as u8
}

/// The linear value of each sRGB byte.
static LINEAR_OF_BYTES: LazyLock<[f32; 256]> =
    LazyLock::new(|| from_fn(|byte| srgb_to_linear(byte as f64 / 255.0) as f32));

/// The linear value from which on the next sRGB byte is nearest.
static BYTE_THRESHOLDS: LazyLock<[f32; 255]> =
    LazyLock::new(|| from_fn(|byte| srgb_to_linear((byte as f64 + 0.5) / 255.0) as f32));

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::backend::Picture;
    use crate::raster::Vector;
    use crate::scene::Blend;

    fn srgb(light: f64) -> f64 {
        if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
    }

    #[test]
    fn every_srgb_byte_is_itself() {
        for byte in 0..=255 {
            assert_eq!(srgb_byte_of(f64::from(LINEAR_OF_BYTES[usize::from(byte)])), byte);
            assert_eq!(step_of(f64::from(byte) / 255.0, 255.0), u32::from(byte));
        }
        assert_eq!(stored::<f32>(Format::Rgba8Srgb, [f32::INFINITY, -1.0, f32::NAN, 2.0]), [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn an_opaque_colour_hides_colours_beyond_half_floats() {
        let bright = stored::<f32>(Format::Rgba16Float, [1e30, 65_505.0, -1e30, 1.0]);
        assert_eq!(bright, [65_504.0, 65_504.0, -65_504.0, 1.0]);
        let pane = Vector([0.25, 0.5, 0.75, 1.0]);
        assert_eq!(blended::<f32>(Format::Rgba16Float, Blend::Alpha.into(), pane, bright), [0.25, 0.5, 0.75, 1.0]);
    }

    proptest! {
        /// The thresholds are f32: a value within their rounding of one may go either way.
        #[test]
        fn bytes_are_the_nearest(light in 0.0..1.0_f64) {
            let off = (srgb(light) * 255.0 - f64::from(srgb_byte_of(light))).abs();
            prop_assert!(off <= 0.5 + 1e-4, "{light} {off}");
            prop_assert!((light * 255.0 - f64::from(step_of(light, 255.0))).abs() <= 0.5);
        }

        #[test]
        fn blending_follows_the_blend_equations(
            color in prop::array::uniform4(-2.0..2.0_f64),
            there in prop::array::uniform4(-2.0..2.0_f64),
        ) {
            let mix = |blend: Blend| blended(Format::Rgba16Float, blend.into(), Vector(color), there);
            let alpha = color[3];
            for channel in 0..4 {
                let share = if channel == 3 { 1.0 } else { alpha };
                prop_assert_eq!(mix(Blend::None)[channel], color[channel]);
                prop_assert_eq!(mix(Blend::Additive)[channel], color[channel] + there[channel]);
                prop_assert_eq!(mix(Blend::Subtractive)[channel], there[channel] - color[channel]);
                let over = color[channel] * share + there[channel] * (1.0 - alpha);
                prop_assert!((mix(Blend::Alpha)[channel] - over).abs() < 1e-12);
            }
            let sum = blended(Format::Rgba8Unorm, BlendEquation::ADDITIVE, Vector(color), there.map(f64::abs).map(|one| one.min(1.0)));
            prop_assert!(sum.iter().all(|value| (0.0..=1.0).contains(value)));
        }
    }

    #[test]
    fn texels_are_what_is_stored() {
        let formats = [
            Format::R8Unorm,
            Format::Rg8Unorm,
            Format::Rgba8Unorm,
            Format::Rgba8Srgb,
            Format::Bgra8Unorm,
            Format::Bgra8Srgb,
            Format::Rgb10a2Unorm,
            Format::Rgba16Float,
            Format::Rg16Float,
            Format::R16Float,
            Format::Rgba32Float,
            Format::Rgba32FloatBlendable,
            Format::R32Float,
            Format::R32Uint,
            Format::Depth32Float,
        ];
        for format in formats {
            for color in [[0.0, 0.25, 0.5, 1.0], [1.0, 0.002, 0.7, 0.3], [0.9, 0.1, 0.04, 0.0]] {
                let color = stored::<f32>(format, color);
                let mut bytes = Vec::new();
                append_bytes(format, color, &mut bytes);
                let texel = Picture { width: 1, height: 1, format, bytes }.texel([0, 0]);
                for channel in 0..4 {
                    let expected = match channel {
                        _ if channel < format.channels() => color[channel],
                        3 => 1.0,
                        _ => 0.0,
                    };
                    assert!((texel[channel] - expected).abs() < 1e-6, "{format:?}: {texel:?} instead of {color:?}");
                }
            }
        }
    }

    #[test]
    fn bytes_follow_the_format() {
        let bytes = |format| {
            let mut bytes = Vec::new();
            append_bytes(format, [0.5_f64, 1.0, f64::NAN, 0.25], &mut bytes);
            bytes
        };
        assert_eq!(bytes(Format::Rgba8Srgb), [188, 255, 0, 64]);
        assert_eq!(bytes(Format::Rgba8Unorm), [128, 255, 0, 64]);
        assert_eq!(bytes(Format::Rg8Unorm), [128, 255]);
        assert_eq!(bytes(Format::Rgb10a2Unorm), (512_u32 | 1023 << 10 | 1 << 30).to_le_bytes());
        assert_eq!(bytes(Format::Rg16Float), [0x00, 0x38, 0x00, 0x3c]);
        assert_eq!(bytes(Format::R32Float), 0.5_f32.to_le_bytes());
    }
}
