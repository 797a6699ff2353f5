//! Decodes the bytes of targets, independently of the crate.

use drawloom::backend::Picture;
use drawloom::glam::DVec3;
use drawloom::process::Format;
use drawloom::quality::NormalFormat;
use half::f16;

use crate::Failure;

/// The linear colour of each pixel.
///
/// # Errors
/// Returns an error if the format has no colours.
pub fn colors(picture: &Picture) -> Result<Vec<[f64; 3]>, Failure> {
    match picture.format {
        Format::Rgba8Srgb => {
            let linear = |byte: u8| {
                let value = f64::from(byte) / 255.0;
                if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
            };
            let pixels = picture.bytes.chunks_exact(4);
            Ok(pixels.map(|pixel| [linear(pixel[0]), linear(pixel[1]), linear(pixel[2])]).collect())
        }
        Format::Rgba16Float => {
            let half = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
            let pixels = picture.bytes.chunks_exact(8);
            Ok(pixels.map(|pixel| [half(&pixel[0..]), half(&pixel[2..]), half(&pixel[4..])]).collect())
        }
        other => Err(format!("{other:?} holds no colours").into()),
    }
}

/// The direction of each pixel's normal; `None` where nothing was drawn.
///
/// # Errors
/// Returns an error if the target's format does not store normals this way.
pub fn directions(picture: &Picture, stored: NormalFormat) -> Result<Vec<Option<DVec3>>, Failure> {
    let byte = |byte: u8| f64::from(byte) / 127.0 - 1.0;
    let short = |high: u8, low: u8| f64::from(u16::from_be_bytes([high, low])) / 32_767.0 - 1.0;
    let half = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
    let ten = |word: u32, shift: u32| f64::from(word >> shift & 0x3ff) / 511.0 - 1.0;
    let decode: &dyn Fn(&[u8]) -> [f64; 2] = match (stored, picture.format) {
        (NormalFormat::Octahedral8, Format::Rg8Unorm) => &|pixel| [byte(pixel[0]), byte(pixel[1])],
        (NormalFormat::Octahedral10, Format::Rgb10a2Unorm) => &|pixel| {
            let word = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
            [ten(word, 0), ten(word, 10)]
        },
        (NormalFormat::Octahedral16, Format::Rgba8Unorm) => {
            &|pixel| [short(pixel[0], pixel[2]), short(pixel[1], pixel[3])]
        }
        (NormalFormat::HalfFloat, Format::Rg16Float) => &|pixel| [half(pixel), half(&pixel[2..])],
        (stored, format) => return Err(format!("{format:?} holds no normals as {stored:?}").into()),
    };
    let cleared = |pixel: &[u8]| pixel.iter().all(|&byte| byte == 0);
    let pixels = picture.bytes.chunks_exact(picture.format.bytes());
    Ok(pixels.map(|pixel| (!cleared(pixel)).then(|| direction(decode(pixel)))).collect())
}

/// The direction of a point of the unfolded octahedron (Cigolle et al. 2014).
fn direction([x, y]: [f64; 2]) -> DVec3 {
    let z = 1.0 - x.abs() - y.abs();
    let folded = |one: f64, other: f64| (1.0 - other.abs()) * 1.0_f64.copysign(one);
    let (x, y) = if z >= 0.0 { (x, y) } else { (folded(x, y), folded(y, x)) };
    DVec3::new(x, y, z).normalize_or_zero()
}
