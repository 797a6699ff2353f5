//! Textures, and the formats of their texels.

use std::sync::Arc;

use super::{Sampler, SceneError};

/// An image for materials, with its mip levels. Clones share their bytes.
///
/// On the device a texture is what it was given as: its size, its format and its texels. Textures of one
/// [class](TextureClass) share an array, so a scene is drawn with fewest changes of bindings where many textures have
/// one of few sizes, formats and samplers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    name: String,
    class: TextureClass,
    /// Those that it was given with: all of them, or the first one.
    levels: Arc<[Vec<u8>]>,
}

/// What textures have in common that lie in one array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureClass {
    /// In texels.
    pub width: u32,
    /// In texels.
    pub height: u32,
    /// That of each texel.
    pub format: TextureFormat,
    /// The number of mip levels. Each is half as wide and high as the one before, rounded down, and 1 at least.
    pub mip_levels: u32,
    /// How shaders read it.
    pub sampler: Sampler,
}

/// The format of a texture's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum TextureFormat {
    /// A byte, linear, 0 to 1. Shaders read it as red; green and blue are 0, alpha is 1.
    R8Unorm,
    /// Two bytes, linear, 0 to 1.
    Rg8Unorm,
    /// Four bytes, linear, 0 to 1: normals, roughness, masks.
    Rgba8Unorm,
    /// Four bytes; red, green and blue are sRGB encoded, alpha is linear: colours.
    Rgba8Srgb,
    /// A half float.
    R16Float,
    /// Two half floats.
    Rg16Float,
    /// Four half floats: radiance.
    Rgba16Float,
    /// BC1 (DXT1): blocks of 4 × 4 texels in 8 bytes; sRGB. Like the other BC formats it needs the device feature
    /// `TEXTURE_COMPRESSION_BC`.
    Bc1Srgb,
    /// BC3 (DXT5): blocks of 4 × 4 texels in 16 bytes; sRGB.
    Bc3Srgb,
    /// BC4: one channel, linear; blocks of 4 × 4 texels in 8 bytes.
    Bc4Unorm,
    /// BC5: two channels, linear; blocks of 4 × 4 texels in 16 bytes.
    Bc5Unorm,
    /// BC6H: three channels, floats from 0; blocks of 4 × 4 texels in 16 bytes.
    Bc6hUfloat,
    /// BC7: blocks of 4 × 4 texels in 16 bytes; linear.
    Bc7Unorm,
    /// BC7: blocks of 4 × 4 texels in 16 bytes; sRGB.
    Bc7Srgb,
    /// ETC2: blocks of 4 × 4 texels in 16 bytes; linear. Like the other ETC2 formats it needs the device feature
    /// `TEXTURE_COMPRESSION_ETC2`.
    Etc2Rgba8Unorm,
    /// ETC2: blocks of 4 × 4 texels in 16 bytes; sRGB.
    Etc2Rgba8Srgb,
    /// ASTC: blocks of 4 × 4 texels in 16 bytes; linear. Like the other ASTC format it needs the device feature
    /// `TEXTURE_COMPRESSION_ASTC`.
    Astc4x4Unorm,
    /// ASTC: blocks of 4 × 4 texels in 16 bytes; sRGB.
    Astc4x4Srgb,
}

impl TextureFormat {
    /// Width and height of a block in texels; 1 for formats without blocks.
    pub const fn block_side(self) -> u32 {
        if self.is_compressed() { 4 } else { 1 }
    }

    /// The bytes of a block, or of a texel.
    pub const fn block_bytes(self) -> u32 {
        match self {
            Self::R8Unorm => 1,
            Self::Rg8Unorm | Self::R16Float => 2,
            Self::Rgba8Unorm | Self::Rgba8Srgb | Self::Rg16Float => 4,
            Self::Rgba16Float | Self::Bc1Srgb | Self::Bc4Unorm => 8,
            _ => 16,
        }
    }

    /// Whether its texels are coded in blocks. Mip levels of such a texture are not made here: it brings its own.
    pub const fn is_compressed(self) -> bool {
        !matches!(
            self,
            Self::R8Unorm
                | Self::Rg8Unorm
                | Self::Rgba8Unorm
                | Self::Rgba8Srgb
                | Self::R16Float
                | Self::Rg16Float
                | Self::Rgba16Float
        )
    }
}

impl TextureClass {
    /// Width and height of a mip level in texels.
    pub(crate) fn level_size(self, level: u32) -> [u32; 2] {
        [self.width, self.height].map(|side| side.checked_shr(level).unwrap_or(0).max(1))
    }

    /// The rows of a mip level, and the bytes of each: rows of blocks, if the format has blocks.
    pub(crate) fn level_rows(self, level: u32) -> (u32, u32) {
        let side = self.format.block_side();
        let [columns, rows] = self.level_size(level).map(|texels| texels.div_ceil(side));
        (rows, columns.saturating_mul(self.format.block_bytes()))
    }

    /// The bytes of a texture with all its levels.
    pub fn bytes(self) -> u64 {
        let bytes_of = |level| {
            let (rows, row_bytes) = self.level_rows(level);
            u64::from(rows) * u64::from(row_bytes)
        };
        (0..self.mip_levels.min(self.complete_levels())).map(bytes_of).fold(0, u64::saturating_add)
    }

    /// The number of levels down to one texel.
    fn complete_levels(self) -> u32 {
        self.width.max(self.height).max(1).ilog2() + 1
    }
}

impl Texture {
    /// The largest width and height that a texture may be given with. One that is larger than the device allows is
    /// counted as [`TextureLimit`](crate::view::IssueReason::TextureLimit), and its materials are drawn without it.
    pub const MAX_SIZE: u32 = 32_768;

    /// A texture of RGBA bytes, sRGB encoded, rows from top to bottom without padding. Its mip levels are made here.
    ///
    /// # Errors
    /// If width or height is 0 or above [`Texture::MAX_SIZE`], or the number of bytes is not `width * height * 4`.
    pub fn new(name: impl Into<String>, width: u32, height: u32, pixels: Vec<u8>) -> Result<Self, SceneError> {
        Self::with_levels(name, TextureFormat::Rgba8Srgb, [width, height], vec![pixels])
    }

    /// A texture of any format, width and height in texels: with its mip levels from the largest on, each in rows from
    /// top to bottom without padding, as the format has them. Numbers are little-endian.
    ///
    /// The levels need not go down to one texel. Of one level alone, the others are made here, unless the format [is
    /// compressed](TextureFormat::is_compressed).
    ///
    /// ```
    /// use drawloom::scene::{Texture, TextureFormat};
    ///
    /// let normals = Texture::with_levels("normals", TextureFormat::Rgba8Unorm, [2, 1], vec![vec![128; 8]])?;
    /// assert_eq!(normals.class().mip_levels, 2);
    /// # Ok::<(), drawloom::scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// If width or height is 0 or above [`Texture::MAX_SIZE`]; if it is compressed, and they are no multiples of the
    /// side of its blocks; if there is no level, or more than lead to one texel; or if one has another number of bytes
    /// than its size needs.
    pub fn with_levels(
        name: impl Into<String>,
        format: TextureFormat,
        [width, height]: [u32; 2],
        levels: Vec<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        let (mip_levels, sampler) = (levels.len() as u32, Sampler::default());
        let mut class = TextureClass { width, height, format, mip_levels, sampler };
        let (sides, side) = (1..=Self::MAX_SIZE, format.block_side());
        let has_size = [width, height].iter().all(|size| sides.contains(size) && size % side == 0);
        let fits = |(level, bytes): (u32, &Vec<u8>)| {
            let (rows, row_bytes) = class.level_rows(level);
            bytes.len() as u64 == u64::from(rows) * u64::from(row_bytes)
        };
        let has_levels = !levels.is_empty() && levels.len() as u32 <= class.complete_levels();
        if !has_size || !has_levels || !(0..).zip(&levels).all(fits) {
            let (texture, bytes) = (name.into(), levels.iter().map(Vec::len).collect());
            return Err(SceneError::InvalidTexture { texture, format, width, height, bytes });
        }
        if levels.len() == 1 && !format.is_compressed() {
            class.mip_levels = class.complete_levels();
        }
        Ok(Self { name: name.into(), class, levels: levels.into() })
    }

    /// The same texture with another sampler.
    pub fn sampled_by(mut self, sampler: Sampler) -> Self {
        // Equal samplers share an array.
        self.class.sampler = Sampler { anisotropy: sampler.anisotropy.clamp(1, 16), ..sampler };
        self
    }

    /// The name in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its size, its format, the number of its mip levels, and its sampler.
    pub fn class(&self) -> TextureClass {
        self.class
    }

    /// In texels.
    pub fn width(&self) -> u32 {
        self.class.width
    }

    /// In texels.
    pub fn height(&self) -> u32 {
        self.class.height
    }

    /// The bytes of the first level, rows from top to bottom.
    pub fn pixels(&self) -> &[u8] {
        &self.levels[0]
    }

    /// The levels that it was given with.
    pub fn levels(&self) -> &[Vec<u8>] {
        &self.levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_that_do_not_fit_are_an_error_that_names_them() {
        let texture = |format, size, levels: &[usize]| {
            let levels = levels.iter().map(|bytes| vec![0; *bytes]).collect();
            Texture::with_levels("strange", format, size, levels).map(|texture| texture.class().mip_levels)
        };
        let (plain, blocks) = (TextureFormat::Rg8Unorm, TextureFormat::Bc7Srgb);
        assert_eq!(texture(plain, [5, 3], &[30]), Ok(3));
        assert_eq!(texture(plain, [5, 3], &[30, 4]), Ok(2), "its own levels");
        assert_eq!(texture(plain, [5, 3], &[30, 4, 2]), Ok(3));
        assert_eq!(texture(plain, [1, 4], &[8, 4, 2]), Ok(3), "a side of one texel stays");
        assert_eq!(texture(blocks, [8, 4], &[32]), Ok(1), "no level is made");
        assert_eq!(texture(blocks, [8, 4], &[32, 16, 16, 16]), Ok(4), "a level has a block at least");
        for (format, size, levels) in [
            (plain, [0, 3], &[0][..]),
            (plain, [5, 0], &[0]),
            (plain, [Texture::MAX_SIZE + 1, 1], &[2 * (Texture::MAX_SIZE as usize + 1)]),
            (plain, [5, 3], &[]),
            (plain, [5, 3], &[29]),
            (plain, [5, 3], &[30, 5]),
            (plain, [5, 3], &[30, 4, 2, 2]),
            (blocks, [6, 4], &[32]),
            (blocks, [8, 4], &[31]),
        ] {
            let bytes = levels.to_vec();
            let [width, height] = size;
            let texture_name = String::from("strange");
            assert_eq!(
                texture(format, size, levels),
                Err(SceneError::InvalidTexture { texture: texture_name, format, width, height, bytes })
            );
        }
    }

    #[test]
    fn a_class_has_the_bytes_of_all_its_levels() {
        let sampler = Sampler::default();
        let class = |width, height, format, mip_levels| TextureClass { width, height, format, mip_levels, sampler };
        assert_eq!(class(4, 4, TextureFormat::Rgba8Srgb, 3).bytes(), 64 + 16 + 4);
        assert_eq!(class(4, 1, TextureFormat::Rgba16Float, 3).bytes(), 32 + 16 + 8);
        assert_eq!(class(8, 8, TextureFormat::Bc1Srgb, 4).bytes(), 32 + 8 + 8 + 8);
        assert_eq!(class(5, 3, TextureFormat::R8Unorm, 3).level_size(40), [1, 1]);
    }
}
