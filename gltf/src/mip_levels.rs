//! Mip levels: an image at half the size, a quarter, and so on.

use drawloom::glam::Vec4;
use image::RgbaImage;

/// How the channels of an image are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ColorSpace {
    /// Colours.
    Srgb,
    /// Numbers.
    Linear,
}

/// The size of a mip level.
pub(crate) fn mip_size(size: [u32; 2], level: u32) -> [u32; 2] {
    size.map(|side| (side >> level).max(1))
}

/// The number of mip levels of an image.
pub(crate) fn mip_count([width, height]: [u32; 2]) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// The bytes of an image with its mip levels.
pub(crate) fn byte_count(size: [u32; 2]) -> u64 {
    let of_level = |level| mip_size(size, level).map(u64::from).into_iter().product::<u64>() * 4;
    (0..mip_count(size)).map(of_level).sum()
}

/// The bytes of a layer and of its mip levels, with an image and those of the image in the upper left.
pub(crate) fn mip_levels_within(image: &RgbaImage, layer: [u32; 2], space: ColorSpace) -> Vec<u8> {
    let size = <[u32; 2]>::from(image.dimensions());
    let bytes = with_mip_levels(image, space);
    if size == layer {
        return bytes;
    }
    let mut of_layer = vec![0; byte_count(layer) as usize];
    let (mut from, mut to) = (0, 0);
    // A layer has at least as many levels as the image.
    for level in 0..mip_count(size) {
        let ([width, height], [layer_width, layer_height]) = (mip_size(size, level), mip_size(layer, level));
        let (row, row_of_layer) = (width as usize * 4, layer_width as usize * 4);
        for number in 0..height as usize {
            of_layer[to + number * row_of_layer..][..row].copy_from_slice(&bytes[from + number * row..][..row]);
        }
        from += row * height as usize;
        to += row_of_layer * layer_height as usize;
    }
    of_layer
}

/// The bytes of an image and of its mip levels. Each pixel is the mean of four, of their radiances if they are colours.
fn with_mip_levels(image: &RgbaImage, space: ColorSpace) -> Vec<u8> {
    let size = <[u32; 2]>::from(image.dimensions());
    let mut bytes = Vec::with_capacity(byte_count(size) as usize);
    bytes.extend_from_slice(image.as_raw());
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
