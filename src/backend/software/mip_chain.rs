//! Texture sampling, as on devices.

use std::borrow::Cow;
use std::sync::LazyLock;

use half::f16;

use crate::backend::mip_generation::{mip_chain, srgb_to_linear};
use crate::raster::{Real, Vector, Vector2, Vector4};
use crate::scene::{AddressMode, Filter, Texture, TextureClass, TextureFormat};

/// All mip levels of a texture.
pub(super) struct MipChain {
    class: TextureClass,
    levels: Vec<Vec<u8>>,
}

/// The linear value of each byte of red, green and blue.
static LINEAR_OF_BYTES: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f64 / 255.0)));

impl MipChain {
    /// `None` of a texture that is compressed: the CPU does not decode it.
    pub(super) fn of(texture: &Texture) -> Option<Self> {
        let class = texture.class();
        let levels = || mip_chain(texture).into_iter().map(Cow::into_owned).collect();
        (!class.format.is_compressed()).then(|| Self { class, levels: levels() })
    }

    /// Samples as the texture's sampler says. At the level of detail, the longer of the steps to the next column and to
    /// the next row is one texel long (Vulkan, "Level-of-Detail Operation").
    pub(super) fn sample<R: Real>(&self, uv: Vector2<R>, dpdx: Vector2<R>, dpdy: Vector2<R>) -> Vector4<R> {
        // Numbers that are not finite count as 0, as on devices: they would not lead to a pixel.
        let finite = |value: R| if value.is_finite() { value } else { R::zero() };
        let uv = uv.map(finite);
        let size = Vector([self.class.width, self.class.height].map(|side| R::of(f64::from(side))));
        let length = |step: Vector2<R>| {
            let step = step.with(size, |step, side| step * side);
            step.dot(step)
        };
        let longest = finite(length(dpdx).max(length(dpdy)).sqrt());
        let (sampler, last) = (self.class.sampler, self.levels.len() - 1);
        let filter = if longest > R::one() { sampler.min_filter } else { sampler.mag_filter };
        let level = longest.max(R::one()).log2().min(R::of(last as f64));
        match sampler.mip_filter {
            Some(Filter::Linear) => {}
            Some(Filter::Nearest) => {
                return self.sample_level(filter, (level + R::of(0.5)).floor().as_f64() as usize, uv);
            }
            None => return self.sample_level(filter, 0, uv),
        }
        let finer = level.floor();
        let fraction = level - finer;
        let finer = finer.as_f64() as usize;
        let one = self.sample_level(filter, finer, uv);
        if fraction == R::zero() {
            return one;
        }
        one.with(self.sample_level(filter, finer + 1, uv), |one, other| one + (other - one) * fraction)
    }

    /// The nearest texel, or a mixture of the four nearest ones.
    fn sample_level<R: Real>(&self, filter: Filter, level: usize, uv: Vector2<R>) -> Vector4<R> {
        let size = self.class.level_size(level as u32);
        let [columns, rows] = std::array::from_fn(|axis| {
            nearest_texels(uv[axis], self.class.sampler.address_modes[axis], size[axis], filter == Filter::Linear)
        });
        let mut sum = Vector::zero();
        for (row, row_weight) in rows {
            for (column, weight) in columns {
                sum = sum + self.texel(level, row * size[0] as usize + column) * (weight * row_weight);
            }
        }
        sum
    }

    /// A texel, linear. Channels that the format lacks are 0, and alpha is 1.
    fn texel<R: Real>(&self, level: usize, index: usize) -> Vector4<R> {
        let (format, length) = (self.class.format, self.class.format.block_bytes() as usize);
        let bytes = &self.levels[level][index * length..][..length];
        let mut texel = [0.0, 0.0, 0.0, 1.0];
        match format {
            TextureFormat::R16Float | TextureFormat::Rg16Float | TextureFormat::Rgba16Float => {
                let halves = bytes.as_chunks().0.iter().map(|half| f16::from_le_bytes(*half).to_f64());
                texel.iter_mut().zip(halves).for_each(|(channel, half)| *channel = half);
            }
            _ => texel.iter_mut().zip(bytes).for_each(|(channel, byte)| *channel = f64::from(*byte) / 255.0),
        }
        if format == TextureFormat::Rgba8Srgb {
            let linear = &*LINEAR_OF_BYTES;
            texel.iter_mut().zip(&bytes[..3]).for_each(|(channel, byte)| *channel = linear[usize::from(*byte)]);
        }
        Vector(texel.map(R::of))
    }
}

/// The two texels of a row of `size` that are nearest to a coordinate, each with its share; if `is_linear` is false, the
/// nearest one has all.
fn nearest_texels<R: Real>(coordinate: R, mode: AddressMode, size: u32, is_linear: bool) -> [(usize, R); 2] {
    let period = if mode == AddressMode::Mirror { R::of(2.0) } else { R::one() };
    // The fraction is taken before scaling, so that far coordinates lose no more precision.
    let within = match mode {
        AddressMode::Clamp => coordinate.max(R::of(-1.0)).min(R::of(2.0)),
        AddressMode::Repeat | AddressMode::Mirror => coordinate - (coordinate / period).floor() * period,
    };
    let middle = if is_linear { R::of(0.5) } else { R::zero() };
    let point = within * R::of(f64::from(size)) - middle;
    let first = point.floor();
    let share = if is_linear { point - first } else { R::zero() };
    let texel = |step: i64| {
        let (index, size) = (first.as_f64() as i64 + step, i64::from(size));
        let inside = match mode {
            AddressMode::Clamp => index.clamp(0, size - 1),
            AddressMode::Repeat => index.rem_euclid(size),
            AddressMode::Mirror => {
                let index = index.rem_euclid(2 * size);
                index.min(2 * size - 1 - index)
            }
        };
        inside as usize
    };
    [(texel(0), R::one() - share), (texel(1), share)]
}

#[cfg(test)]
pub(super) mod tests {
    use fastrand::Rng;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::Sampler;

    /// The unit roundoff of f32.
    const UNIT: f64 = 1.0 / 16_777_216.0;

    pub(in crate::backend::software) fn noise(side: u32) -> Texture {
        let mut pixels = vec![0; side as usize * side as usize * 4];
        Rng::with_seed(1).fill(&mut pixels);
        Texture::new("noise", side, side, pixels).unwrap()
    }

    fn texel<R: Real>(chain: &MipChain, uv: [f64; 2], gradients: [[f64; 2]; 2]) -> [f64; 4] {
        let [uv, across, down] = [uv, gradients[0], gradients[1]].map(|vector| Vector(vector.map(R::of)));
        chain.sample(uv, across, down).0.map(R::as_f64)
    }

    /// All pixels of a level, weighted by a tent filter two pixels wide around the point, which repeats.
    fn expected(levels: &[Cow<'_, [u8]>], level: usize, uv: [f64; 2]) -> [f64; 4] {
        let side = 256_usize >> level;
        let tent = |index: usize, point: f64| {
            let distance = (index as f64 + 0.5) / side as f64 - point;
            (1.0 - (distance - distance.round()).abs() * side as f64).max(0.0)
        };
        // A level of one pixel is its own neighbour.
        let weight = |index: usize, point: f64| if side == 1 { 1.0 } else { tent(index, point) };
        let mut sum = [0.0; 4];
        for (index, pixel) in levels[level].chunks_exact(4).enumerate() {
            let weight = weight(index % side, uv[0]) * weight(index / side, uv[1]);
            let color = |byte: u8| {
                let value = f64::from(byte) / 255.0;
                if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
            };
            for channel in 0..3 {
                sum[channel] += weight * color(pixel[channel]);
            }
            sum[3] += weight * f64::from(pixel[3]) / 255.0;
        }
        sum
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// In f32, the point in a level's pixels is off by u·(|uv| + 2·side), and so is each weight; a step of one
        /// pixel changes the result by 1 at most in each direction. The level is off by 8u and a few u of its
        /// logarithm, whose logarithm is 9 at most: 20u; sums and products add 10u.
        #[test]
        fn it_is_trilinear(
            uv in prop::array::uniform2(-3.0..3.0_f32),
            longest in -2.0..10.0_f64,
            around in 0.0..6.3_f64,
            shorter in 0.0..1.0_f64,
            is_down in any::<bool>(),
        ) {
            let texture = noise(256);
            let levels = mip_chain(&texture);
            let chain = MipChain::of(&texture).unwrap();
            let uv = uv.map(f64::from);
            let length = longest.exp2() / 256.0;
            let long = [around.cos() * length, around.sin() * length].map(|value| f64::from(value as f32));
            let mut gradients = [long, [shorter * long[1], -shorter * long[0]].map(|value| f64::from(value as f32))];
            if is_down {
                gradients.swap(0, 1);
            }
            let level = (long[0].hypot(long[1]) * 256.0).log2().clamp(0.0, 8.0);
            let [finer, coarser] = [level.floor(), level.ceil()].map(|level| expected(&levels, level as usize, uv));
            let double = texel::<f64>(&chain, uv, gradients);
            let single = texel::<f32>(&chain, uv, gradients);
            for channel in 0..4 {
                let between = finer[channel] + (coarser[channel] - finer[channel]) * level.fract();
                prop_assert!((double[channel] - between).abs() < 1e-9, "{level} {double:?} {between}");
                let bound = UNIT * (2.0 * (3.0 * 256.0 + 2.0 * 256.0) + 30.0);
                prop_assert!((single[channel] - double[channel]).abs() <= bound, "{single:?} {double:?}");
            }
        }
    }

    #[test]
    fn beyond_the_edges_a_texture_is_what_its_sampler_says() {
        let row = |mode| -> Vec<u8> {
            let texels = (0..3).flat_map(|red| [red, 0, 0, 255]).collect();
            let texture = Texture::with_levels("row", TextureFormat::Rgba8Unorm, [3, 1], vec![texels]).unwrap();
            let sampler = Sampler { address_modes: [mode; 2], ..Sampler::NEAREST };
            let chain = MipChain::of(&texture.sampled_by(sampler)).unwrap();
            (-6..9)
                .map(|column| {
                    let uv = [(f64::from(column) + 0.3) / 3.0, -7.6];
                    (texel::<f64>(&chain, uv, [[0.0; 2]; 2])[0] * 255.0).round() as u8
                })
                .collect()
        };
        assert_eq!(row(AddressMode::Repeat), [0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(row(AddressMode::Mirror), [0, 1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1, 2]);
        assert_eq!(row(AddressMode::Clamp), [0, 0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn the_centre_of_a_pixel_samples_that_pixel() {
        let texture = noise(256);
        let chain = MipChain::of(&texture).unwrap();
        let pixels: Vec<_> = texture.pixels().chunks_exact(4).collect();
        for [x, y] in [[0, 0], [255, 0], [17, 200], [255, 255]] {
            let uv = [x, y].map(|index| (index as f64 + 0.5) / 256.0 - 2.0);
            let found = texel::<f64>(&chain, uv, [[0.0; 2]; 2]);
            let [red, .., alpha] = pixels[y * 256 + x] else { unreachable!() };
            assert_eq!([found[0], found[3]], [LINEAR_OF_BYTES[usize::from(*red)], f64::from(*alpha) / 255.0]);
        }
    }

    #[test]
    fn coordinates_that_are_not_finite_sample_a_colour() {
        let chain = MipChain::of(&noise(8)).unwrap();
        for strange in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e38, -1e38, -1e-30] {
            for [uv, across] in [[[strange, 0.3], [0.0; 2]], [[0.3, 0.3], [strange, 0.1]]] {
                let found =
                    [texel::<f32>(&chain, uv, [across, [0.0; 2]]), texel::<f64>(&chain, uv, [across, [0.0; 2]])];
                assert!(found.iter().flatten().all(|value| (0.0..=1.0).contains(value)), "{strange} {found:?}");
            }
        }
    }
}
