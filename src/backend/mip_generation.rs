//! Mip chains of textures, scaled to the layer size of a texture array. Filters average linear values, not sRGB bytes.

use std::sync::LazyLock;

use crate::raster::Real;
use crate::scene::Texture;

/// The layer sizes of the texture arrays in pixels; layers are square. All backends scale textures to these.
pub(super) const ARRAY_SIDES: [u32; 4] = [256, 512, 1024, 2048];

/// The index in [`ARRAY_SIDES`] that a texture is scaled to: the smallest that is large enough, or the largest.
pub(super) fn array_for(texture: &Texture) -> usize {
    let size = texture.width().max(texture.height());
    ARRAY_SIDES.iter().position(|&side| size <= side).unwrap_or(ARRAY_SIDES.len() - 1)
}

/// All mip levels of a texture scaled to a square, from `side` pixels down to one; RGBA bytes, sRGB encoded.
pub(super) fn mip_chain(texture: &Texture, side: u32) -> Vec<Vec<u8>> {
    let mut level = scaled(texture, side);
    let mut side = side as usize;
    let mut chain = vec![encoded(&level)];
    while side > 1 {
        level = halved(&level, side);
        side /= 2;
        chain.push(encoded(&level));
    }
    chain
}

/// The number of levels of a complete chain for a texture of this size.
pub(super) fn mip_level_count(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).max(1).ilog2() + 1
}

/// Decodes sRGB to linear, both from 0 to 1.
pub(super) fn srgb_to_linear<R: Real>(value: R) -> R {
    if value <= R::of(0.04045) {
        value / R::of(12.92)
    } else {
        ((value + R::of(0.055)) / R::of(1.055)).powf(R::of(2.4))
    }
}

type Texel = [f32; 4];

/// Magnifies bilinearly; minifies with a tent filter.
fn scaled(texture: &Texture, side: u32) -> Vec<Texel> {
    let (width, height) = (texture.width() as usize, texture.height() as usize);
    let texels: Vec<Texel> =
        texture.pixels().chunks_exact(4).map(|pixel| decoded([pixel[0], pixel[1], pixel[2], pixel[3]])).collect();
    let columns = weights(width, side as usize);
    let rows = weights(height, side as usize);
    let mut result = Vec::with_capacity(rows.len() * columns.len());
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0; 4];
            for &(y, row_weight) in row {
                for &(x, column_weight) in column {
                    let texel = texels[y * width + x];
                    for channel in 0..4 {
                        sum[channel] += texel[channel] * row_weight * column_weight;
                    }
                }
            }
            result.push(sum);
        }
    }
    result
}

/// The filter weights of a resampling from `from` to `to` pixels: for each new pixel, old pixels and their weights. The filter
/// is a tent as wide as the coarser grid's pixels. Indices wrap around, as texture coordinates do.
fn weights(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let step = from as f64 / to as f64;
    let radius = step.max(1.0);
    let weights_of = |pixel: usize| {
        let center = (pixel as f64 + 0.5) * step - 0.5;
        let first = (center - radius).floor() as i64;
        let last = (center + radius).ceil() as i64;
        let tent = |old: i64| (1.0 - (old as f64 - center).abs() / radius).max(0.0);
        let total: f64 = (first..=last).map(tent).sum();
        let wrapped = |old: i64| old.rem_euclid(from as i64) as usize;
        let weighted = (first..=last).map(|old| (wrapped(old), (tent(old) / total) as f32));
        weighted.filter(|(_, weight)| *weight > 0.0).collect()
    };
    (0..to).map(weights_of).collect()
}

fn halved(level: &[Texel], side: usize) -> Vec<Texel> {
    let half = side / 2;
    let texel = |index: usize| {
        let (x, y) = (index % half * 2, index / half * 2);
        let corners = [y * side + x, y * side + x + 1, (y + 1) * side + x, (y + 1) * side + x + 1];
        std::array::from_fn(|channel| corners.iter().map(|&corner| level[corner][channel]).sum::<f32>() * 0.25)
    };
    (0..half * half).map(texel).collect()
}

fn decoded(pixel: [u8; 4]) -> Texel {
    static LINEAR: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    let [red, green, blue, alpha] = pixel;
    let linear = |byte: u8| LINEAR[usize::from(byte)];
    [linear(red), linear(green), linear(blue), f32::from(alpha) / 255.0]
}

fn encoded(level: &[Texel]) -> Vec<u8> {
    let byte = |value: f32| (value * 255.0 + 0.5) as u8;
    let encode = |&[red, green, blue, alpha]: &Texel| {
        [byte(linear_to_srgb(red)), byte(linear_to_srgb(green)), byte(linear_to_srgb(blue)), byte(alpha)]
    };
    level.iter().flat_map(encode).collect()
}

fn linear_to_srgb(value: f32) -> f32 {
    if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_texture_of_its_layers_size_keeps_every_byte() {
        let pixels: Vec<u8> = (0..=255).cycle().take(8 * 8 * 4).collect();
        let texture = Texture::new("all bytes", 8, 8, pixels.clone()).unwrap();
        let chain = mip_chain(&texture, 8);
        assert_eq!(chain.iter().map(Vec::len).collect::<Vec<_>>(), [256, 64, 16, 4]);
        assert_eq!(chain[0], pixels);
    }

    #[test]
    fn black_and_white_average_to_half_the_linear_value() {
        let pixels = [[0, 0, 0, 255], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]].concat();
        let texture = Texture::new("checker", 2, 2, pixels).unwrap();
        assert_eq!(mip_chain(&texture, 2)[1], [188, 188, 188, 255]);
    }

    #[test]
    fn a_uniform_colour_stays_the_same_at_every_size() {
        for (width, height, side) in [(1, 1, 256), (3, 5, 256), (300, 7, 256), (700, 300, 512)] {
            let pixels = [10, 100, 200, 50].repeat(width as usize * height as usize);
            let texture = Texture::new("plain", width, height, pixels).unwrap();
            for level in mip_chain(&texture, side) {
                assert!(level.chunks(4).all(|pixel| pixel == [10, 100, 200, 50]));
            }
        }
    }
}
