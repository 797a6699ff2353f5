//! Mip chains of textures, scaled to the layer size of a texture array. Filters average linear values, not sRGB bytes.

use std::sync::LazyLock;

use crate::raster::Real;
use crate::scene::{Assets, Texture};

/// The layer sizes of the texture arrays in pixels; layers are square. All backends scale textures to these.
pub(super) const ARRAY_SIDES: [u32; 4] = [256, 512, 1024, Texture::MAX_DETAIL];

/// The index in [`ARRAY_SIDES`] that a texture is scaled to: the smallest that is large enough, or the largest.
pub(super) fn array_for(texture: &Texture) -> usize {
    let size = texture.width().max(texture.height());
    ARRAY_SIDES.iter().position(|&side| size <= side).unwrap_or(ARRAY_SIDES.len() - 1)
}

/// The slots of the textures that have more pixels, in one direction at least, than what they are scaled to.
pub(super) fn reduced_textures(assets: &Assets) -> impl Iterator<Item = usize> {
    let reduced = assets.textures.iter().filter(|(_, texture)| {
        let side = ARRAY_SIDES[array_for(texture)];
        texture.width() > side || texture.height() > side
    });
    reduced.map(|(handle, _)| handle.index() as usize)
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
    let texels: Vec<Texel> = texture.pixels().as_chunks().0.iter().copied().map(decoded).collect();
    if [texture.width(), texture.height()] == [side; 2] {
        // Every weight would be 1.
        return texels;
    }
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

/// The filter weights of a resampling from `from` to `to` pixels: for each new pixel, old pixels and their weights. The
/// filter is a tent as wide as the coarser grid's pixels. Indices wrap around, as texture coordinates do.
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
    let mut result = Vec::with_capacity(half * half);
    for rows in level.chunks_exact(2 * side) {
        let (upper, lower) = rows.split_at(side);
        let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
        result.extend(pairs.map(|(upper, lower)| -> Texel {
            std::array::from_fn(|channel| {
                (upper[0][channel] + upper[1][channel] + lower[0][channel] + lower[1][channel]) * 0.25
            })
        }));
    }
    result
}

fn decoded(pixel: [u8; 4]) -> Texel {
    static LINEAR: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    let [red, green, blue, alpha] = pixel;
    let linear = |byte: u8| LINEAR[usize::from(byte)];
    [linear(red), linear(green), linear(blue), f32::from(alpha) / 255.0]
}

fn encoded(level: &[Texel]) -> Vec<u8> {
    let (bytes, alpha) = (&*SRGB_BYTES, |value: f32| (value * 255.0 + 0.5) as u8);
    let mut result = Vec::with_capacity(level.len() * 4);
    for &[red, green, blue, opacity] in level {
        result.extend([bytes.encode(red), bytes.encode(green), bytes.encode(blue), alpha(opacity)]);
    }
    result
}

static SRGB_BYTES: LazyLock<SrgbBytes> = LazyLock::new(SrgbBytes::new);

/// Linear values as sRGB bytes, by search in a table: a power for each channel of each pixel would take most of the
/// time of a chain.
struct SrgbBytes {
    /// The smallest value of each byte.
    smallest: [f32; 256],
    /// The byte of each multiple of 1 / [`CELLS`](Self::CELLS).
    first: Vec<u8>,
}

impl SrgbBytes {
    /// A byte covers more than half a cell, so the byte of a value is at most two above that of its cell.
    const CELLS: usize = 4096;

    fn new() -> Self {
        let smallest = std::array::from_fn(|byte| {
            // Positive floats are ordered as their bits are.
            let (mut below, mut reached) = (0, 1.0_f32.to_bits());
            while byte > 0 && reached - below > 1 {
                let middle = below.midpoint(reached);
                let bound =
                    if usize::from(srgb_byte(f32::from_bits(middle))) < byte { &mut below } else { &mut reached };
                *bound = middle;
            }
            if byte == 0 { 0.0 } else { f32::from_bits(reached) }
        });
        let first = (0..=Self::CELLS).map(|cell| srgb_byte(cell as f32 / Self::CELLS as f32)).collect();
        Self { smallest, first }
    }

    fn encode(&self, value: f32) -> u8 {
        let cell = (value * Self::CELLS as f32) as usize;
        let mut byte = self.first[cell.min(Self::CELLS)];
        while byte < u8::MAX && self.smallest[usize::from(byte) + 1] <= value {
            byte += 1;
        }
        byte
    }
}

fn srgb_byte(value: f32) -> u8 {
    let encoded = if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
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
    fn the_table_has_the_bytes_of_the_formula() {
        let mut random = fastrand::Rng::with_seed(8);
        let around = SRGB_BYTES.smallest.into_iter().flat_map(|value| [value.next_down(), value, value.next_up()]);
        let others = (0..200_000).map(|_| random.f32());
        for value in around.chain(others).chain([0.0, -0.0, 1.0, 1.0_f32.next_up(), 2.0]) {
            assert_eq!(SRGB_BYTES.encode(value), srgb_byte(value), "{value:e}");
        }
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
