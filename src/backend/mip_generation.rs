//! Mip levels of textures. Filters average linear values, not sRGB bytes.

use std::borrow::Cow;
use std::sync::LazyLock;

use half::f16;

use crate::raster::Real;
use crate::scene::{Texture, TextureFormat};

/// All mip levels of a texture, in its format: its own, or those that are made from its first one.
pub(super) fn mip_chain(texture: &Texture) -> Vec<Cow<'_, [u8]>> {
    let (class, levels) = (texture.class(), texture.levels());
    let mut chain: Vec<_> = levels.iter().map(|level| Cow::Borrowed(level.as_slice())).collect();
    if chain.len() < class.mip_levels as usize {
        let mut level = decode(class.format, texture.pixels());
        for index in 1..class.mip_levels {
            level = reduced(&level, class.level_size(index - 1), class.level_size(index));
            chain.push(Cow::Owned(encode(class.format, &level)));
        }
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

/// The level of a smaller size: each texel is the mean of what it covers.
fn reduced(level: &[Texel], from: [u32; 2], to: [u32; 2]) -> Vec<Texel> {
    let ([width, _], size) = (from.map(|side| side as usize), to.map(|side| side as usize));
    let mut result = Vec::with_capacity(size[0] * size[1]);
    if from == to.map(|side| 2 * side) {
        for rows in level.chunks_exact(2 * width) {
            let (upper, lower) = rows.split_at(width);
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            result.extend(pairs.map(|(upper, lower)| -> Texel {
                std::array::from_fn(|channel| {
                    (upper[0][channel] + upper[1][channel] + lower[0][channel] + lower[1][channel]) * 0.25
                })
            }));
        }
        return result;
    }
    let [columns, rows] = std::array::from_fn(|axis| coverage(from[axis], to[axis]));
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0; 4];
            for &(y, row_weight) in row {
                for &(x, column_weight) in column {
                    let texel = level[y * width + x];
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

/// Of a row of `from` texels that is reduced to `to`: for each new texel the old ones that it covers, each with its
/// share.
fn coverage(from: u32, to: u32) -> Vec<Vec<(usize, f32)>> {
    let step = f64::from(from) / f64::from(to);
    let covered = |texel: u32| {
        let (start, end) = (f64::from(texel) * step, f64::from(texel + 1) * step);
        let shares = (start as usize..(end.ceil() as usize).min(from as usize)).map(move |old| {
            let overlap = (old as f64 + 1.0).min(end) - (old as f64).max(start);
            (old, (overlap / step) as f32)
        });
        shares.filter(|(_, share)| *share > 0.0).collect()
    };
    (0..to).map(covered).collect()
}

/// The texels of a level, linear. Channels that the format lacks are 0.
fn decode(format: TextureFormat, bytes: &[u8]) -> Vec<Texel> {
    static LINEAR: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    let unorm = |byte: u8| f32::from(byte) / 255.0;
    if format == TextureFormat::Rgba8Srgb {
        let linear = &*LINEAR;
        let color = |byte: u8| linear[usize::from(byte)];
        let texels = bytes.as_chunks().0.iter();
        return texels
            .map(|&[red, green, blue, alpha]| [color(red), color(green), color(blue), unorm(alpha)])
            .collect();
    }
    let texels = bytes.chunks_exact(format.block_bytes() as usize);
    let decoded = texels.map(|bytes| {
        let mut texel = [0.0; 4];
        if has_half_floats(format) {
            let halves = bytes.as_chunks().0.iter().map(|half| f16::from_le_bytes(*half).to_f32());
            texel.iter_mut().zip(halves).for_each(|(channel, half)| *channel = half);
        } else {
            texel.iter_mut().zip(bytes).for_each(|(channel, byte)| *channel = unorm(*byte));
        }
        texel
    });
    decoded.collect()
}

/// The bytes of texels in a format that is not compressed.
fn encode(format: TextureFormat, level: &[Texel]) -> Vec<u8> {
    let unorm = |value: f32| (value * 255.0 + 0.5) as u8;
    let (table, bytes) = (&*SRGB_BYTES, format.block_bytes() as usize);
    let mut result = Vec::with_capacity(level.len() * bytes);
    for texel in level {
        let &[red, green, blue, alpha] = texel;
        if format == TextureFormat::Rgba8Srgb {
            result.extend([table.encode(red), table.encode(green), table.encode(blue), unorm(alpha)]);
        } else if has_half_floats(format) {
            result.extend(texel[..bytes / 2].iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()));
        } else {
            result.extend(texel[..bytes].iter().map(|value| unorm(*value)));
        }
    }
    result
}

fn has_half_floats(format: TextureFormat) -> bool {
    matches!(format, TextureFormat::R16Float | TextureFormat::Rg16Float | TextureFormat::Rgba16Float)
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

    fn chain_of(format: TextureFormat, size: [u32; 2], bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let texture = Texture::with_levels("texture", format, size, vec![bytes]).unwrap();
        mip_chain(&texture).into_iter().map(Cow::into_owned).collect()
    }

    #[test]
    fn a_texture_keeps_every_byte_and_gets_levels_down_to_one_texel() {
        let pixels: Vec<u8> = (0..=255).cycle().take(8 * 8 * 4).collect();
        let chain = chain_of(TextureFormat::Rgba8Srgb, [8, 8], pixels.clone());
        assert_eq!(chain.iter().map(Vec::len).collect::<Vec<_>>(), [256, 64, 16, 4]);
        assert_eq!(chain[0], pixels);
        let own = vec![vec![1; 32], vec![2; 16], vec![3; 16]];
        let blocks = Texture::with_levels("blocks", TextureFormat::Bc7Srgb, [8, 4], own.clone()).unwrap();
        assert_eq!(mip_chain(&blocks).into_iter().map(Cow::into_owned).collect::<Vec<_>>(), own);
    }

    #[test]
    fn a_level_is_the_mean_of_what_it_covers() {
        // 5 texels are reduced to 2, each of which covers two and a half.
        let chain = chain_of(TextureFormat::R8Unorm, [5, 1], vec![0, 100, 200, 50, 150]);
        assert_eq!(chain[1..], [vec![80, 120], vec![100]]);
        let chain = chain_of(TextureFormat::Rg8Unorm, [1, 3], vec![30, 0, 60, 90, 90, 0]);
        assert_eq!(chain[1], [60, 30]);
        let halves = [1.0, 65504.0, 3.0, 0.0].map(|value| f16::from_f32(value).to_le_bytes()).concat();
        let chain = chain_of(TextureFormat::Rg16Float, [2, 1], halves);
        assert_eq!(chain[1], [2.0, 32752.0].map(|value| f16::from_f32(value).to_le_bytes()).concat());
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
        assert_eq!(chain_of(TextureFormat::Rgba8Srgb, [2, 2], pixels.clone())[1], [188, 188, 188, 255]);
        assert_eq!(chain_of(TextureFormat::Rgba8Unorm, [2, 2], pixels)[1], [128, 128, 128, 255]);
    }

    #[test]
    fn a_uniform_colour_stays_the_same_at_every_size() {
        for (width, height) in [(1, 1), (3, 5), (300, 7), (64, 64), (64, 2), (1, 33)] {
            let color = [10, 100, 200, 50];
            let pixels = color.repeat(width as usize * height as usize);
            for level in chain_of(TextureFormat::Rgba8Srgb, [width, height], pixels) {
                assert!(level.chunks(4).all(|pixel| pixel == color));
            }
        }
    }
}
