//! Pictures read back from a device.

#[cfg(any(feature = "wgpu", feature = "software"))]
use half::f16;

#[cfg(any(feature = "wgpu", feature = "software"))]
use super::mip_generation::srgb_to_linear;
use crate::process::Format;

/// The pixels of a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// The format of a pixel.
    pub format: Format,
    /// Rows from top to bottom, without padding.
    pub bytes: Vec<u8>,
}

impl Picture {
    /// Whether it has the bytes that its size and format say, and any.
    pub fn is_whole(&self) -> bool {
        let bytes = (self.width as usize).checked_mul(self.height as usize);
        let bytes = bytes.and_then(|pixels| pixels.checked_mul(self.format.bytes()));
        bytes == Some(self.bytes.len()) && !self.bytes.is_empty()
    }

    /// A pixel as shaders sample it: linear, and where the format lacks channels, those of opaque black. Whole numbers
    /// are rounded to f32.
    ///
    /// # Panics
    /// If the picture has no such pixel.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub fn texel(&self, [x, y]: [u32; 2]) -> [f32; 4] {
        assert!(x < self.width && y < self.height, "pixel {x}, {y} of {}x{}", self.width, self.height);
        let pixel = y as usize * self.width as usize + x as usize;
        decoded(self.format, &self.bytes[pixel * self.format.bytes()..][..self.format.bytes()])
    }

    /// # Errors
    /// The error of an upload, if it is not [whole](Self::is_whole) or is no picture of colours or numbers.
    #[cfg(feature = "wgpu")]
    pub(crate) fn check_upload(&self) -> Result<(), super::BackendError> {
        let Self { width, height, format, ref bytes } = *self;
        if self.is_whole() && !format.is_depth_stencil() {
            return Ok(());
        }
        Err(super::BackendError::InvalidPicture { width, height, format, bytes: bytes.len() })
    }
}

/// The numbers of a pixel.
#[cfg(any(feature = "wgpu", feature = "software"))]
fn decoded(format: Format, bytes: &[u8]) -> [f32; 4] {
    let unit = |index: usize| f32::from(bytes[index]) / 255.0;
    let linear = |index: usize| srgb_to_linear(unit(index));
    let half = |index: usize| f16::from_le_bytes([bytes[index * 2], bytes[index * 2 + 1]]).to_f32();
    let word = |index: usize| u32::from_le_bytes(std::array::from_fn(|byte| bytes[index * 4 + byte]));
    let single = |index: usize| f32::from_bits(word(index));
    match format {
        Format::R8Unorm => [unit(0), 0.0, 0.0, 1.0],
        Format::Rg8Unorm => [unit(0), unit(1), 0.0, 1.0],
        Format::Rgba8Unorm => [unit(0), unit(1), unit(2), unit(3)],
        Format::Rgba8Srgb => [linear(0), linear(1), linear(2), unit(3)],
        Format::Bgra8Unorm => [unit(2), unit(1), unit(0), unit(3)],
        Format::Bgra8Srgb => [linear(2), linear(1), linear(0), unit(3)],
        Format::Rgb10a2Unorm => {
            let ten = |shift: u32| (word(0) >> shift & 1023) as f32 / 1023.0;
            [ten(0), ten(10), ten(20), (word(0) >> 30) as f32 / 3.0]
        }
        Format::Rgba16Float => [half(0), half(1), half(2), half(3)],
        Format::Rg16Float => [half(0), half(1), 0.0, 1.0],
        Format::R16Float => [half(0), 0.0, 0.0, 1.0],
        Format::Rgba32Float | Format::Rgba32FloatBlendable => [single(0), single(1), single(2), single(3)],
        Format::R32Float | Format::Depth32Float | Format::Depth32FloatStencil8 => [single(0), 0.0, 0.0, 1.0],
        Format::R32Uint => [word(0) as f32, 0.0, 0.0, 1.0],
        Format::Stencil8 => [f32::from(bytes[0]), 0.0, 0.0, 1.0],
    }
}
