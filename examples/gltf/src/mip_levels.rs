//! Mip levels: an image at half the size, a quarter, and so on.

use drawloom::glam::Vec4;
use image::RgbaImage;

use crate::texture_arrays::ColorSpace;

/// The size of a mip level.
pub(crate) fn mip_size(size: [u32; 2], level: u32) -> [u32; 2] {
    size.map(|side| (side >> level).max(1))
}

/// The number of mip levels of an image.
pub(crate) fn mip_count([width, height]: [u32; 2]) -> u32 {
    width.max(height).ilog2() + 1
}

/// The bytes of an image and of its mip levels. Each pixel is the mean of four, of their radiances if they are colours.
pub(crate) fn with_mip_levels(image: RgbaImage, space: ColorSpace) -> Vec<u8> {
    let size = <[u32; 2]>::from(image.dimensions());
    let mut bytes = image.into_raw();
    let decoded: [f32; 256] = std::array::from_fn(|byte| decode(byte as f32 / 255.0, space));
    let mut first = 0;
    for level in 1..mip_count(size) {
        let ([from_width, from_height], [width, height]) = (mip_size(size, level - 1), mip_size(size, level));
        let end = bytes.len();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let mut sum = Vec4::ZERO;
            for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let [column, row] = [(2 * x + right).min(from_width - 1), (2 * y + down).min(from_height - 1)];
                let pixel = first + (row as usize * from_width as usize + column as usize) * 4;
                let [red, green, blue] = [0, 1, 2].map(|channel| decoded[usize::from(bytes[pixel + channel])]);
                sum += Vec4::new(red, green, blue, f32::from(bytes[pixel + 3]) / 255.0);
            }
            let mean = sum / 4.0;
            let channels = [encode(mean.x, space), encode(mean.y, space), encode(mean.z, space), mean.w];
            bytes.extend(channels.map(|channel| (channel * 255.0).round() as u8));
        }
        first = end;
    }
    bytes
}

fn decode(value: f32, space: ColorSpace) -> f32 {
    match space {
        ColorSpace::Linear => value,
        ColorSpace::Srgb if value <= 0.04045 => value / 12.92,
        ColorSpace::Srgb => ((value + 0.055) / 1.055).powf(2.4),
    }
}

fn encode(value: f32, space: ColorSpace) -> f32 {
    match space {
        ColorSpace::Linear => value,
        ColorSpace::Srgb if value <= 0.0031308 => value * 12.92,
        ColorSpace::Srgb => 1.055 * value.powf(1.0 / 2.4) - 0.055,
    }
}
