//! Materials and textures.

use glam::Vec3;

use super::SceneError;
use crate::handle::Handle;

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What it is called in reports.
    pub name: String,
    /// The share of light reflected diffusely, linear; above 1 a surface reflects more light than it gets.
    pub diffuse: Vec3,
    /// Multiplies `diffuse` where there is one.
    pub texture: Option<Handle<Texture>>,
    /// Radiance given off, linear; 0 for most.
    pub emission: Vec3,
    /// 0 lets everything through, 1 nothing. Only blended materials use it.
    pub opacity: f32,
    /// How it mixes with what is behind it.
    pub blend: Blend,
    /// Whether triangles that face away are drawn too.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::from("default"),
            diffuse: Vec3::splat(0.8),
            texture: None,
            emission: Vec3::ZERO,
            opacity: 1.0,
            blend: Blend::None,
            double_sided: false,
        }
    }
}

impl Material {
    /// Whether its colours are finite and not negative, and its opacity is from 0 to 1.
    pub(super) fn is_valid(&self) -> bool {
        let finite = self.diffuse.is_finite() && self.emission.is_finite() && self.opacity.is_finite();
        let positive = self.diffuse.min_element() >= 0.0 && self.emission.min_element() >= 0.0;
        finite && positive && (0.0..=1.0).contains(&self.opacity)
    }
}

/// How a surface mixes with what is behind it (M listing 10.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Blend {
    /// It hides what is behind it.
    #[default]
    None = 0,
    /// Over what is behind it, by its opacity.
    Alpha = 1,
    /// Added to what is behind it.
    Additive = 2,
    /// Taken from what is behind it.
    Subtractive = 3,
}

/// A picture that a material can carry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    name: String,
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl Texture {
    /// The largest width and height: what every wgpu adapter can hold.
    pub const LARGEST: u32 = 8192;

    /// A texture of RGBA bytes, sRGB encoded, rows from top to bottom without padding.
    ///
    /// # Errors
    /// If width or height is 0 or above [`Texture::LARGEST`], or the number of bytes is not `width * height * 4`.
    pub fn new(name: impl Into<String>, width: u32, height: u32, pixels: Vec<u8>) -> Result<Self, SceneError> {
        let name = name.into();
        let sides = 1..=Self::LARGEST;
        let fits = |bytes: usize| bytes == width as usize * height as usize * 4;
        if !sides.contains(&width) || !sides.contains(&height) || !fits(pixels.len()) {
            return Err(SceneError::InvalidTexture { texture: name, width, height, bytes: pixels.len() });
        }
        Ok(Self { name, width, height, pixels })
    }

    /// What it is called in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// In pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// In pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// RGBA bytes, sRGB encoded, rows from top to bottom.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }
}
