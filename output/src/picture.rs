//! A picture that is written whole or not at all.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use image::{ColorType, ImageFormat, ImageResult};

use crate::error::OutputError;
use crate::file::OutputFile;

/// A file for a picture: PNG, JPEG, TGA or BMP, by its extension.
#[derive(Clone, Debug)]
pub struct PictureFile {
    file: OutputFile,
    format: ImageFormat,
}

impl PictureFile {
    /// Checks the extension, and that the file can be written.
    ///
    /// # Errors
    /// If pictures are not written in that format, or the file cannot be written.
    pub fn new(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let path = path.into();
        let extension = path.extension().map(|extension| extension.to_string_lossy().into_owned());
        let format = extension.as_ref().and_then(ImageFormat::from_extension).filter(|format| {
            matches!(format, ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tga | ImageFormat::Bmp)
        });
        let Some(format) = format else { return Err(OutputError::PictureFormat { path, extension }) };
        Ok(Self { file: OutputFile::new(path)?, format })
    }

    /// Its path, as it was named.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Replaces the file by a picture of `size` pixels, with `rgba` from its upper left row by row, a byte for each of
    /// red, green, blue and alpha. JPEG has no alpha; it is left out.
    ///
    /// # Errors
    /// If `rgba` is no such picture, the format has none of this size, or the file cannot be written.
    pub fn write(&self, size: [u32; 2], rgba: &[u8]) -> Result<(), OutputError> {
        match self.format {
            ImageFormat::Jpeg => self.write_opaque(size, rgba),
            _ => self.write_as(ColorType::Rgba8, size, rgba),
        }
    }

    /// As [`write`](Self::write), without alpha in any format.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_opaque(&self, size: [u32; 2], rgba: &[u8]) -> Result<(), OutputError> {
        let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
        self.write_as(ColorType::Rgb8, size, &rgb)
    }

    fn write_as(&self, color: ColorType, size: [u32; 2], bytes: &[u8]) -> Result<(), OutputError> {
        let encoded = encode(bytes, size, color, self.format);
        let failed = |error| OutputError::Failed { path: self.path().to_owned(), source: io::Error::other(error) };
        self.file.write_all(encoded.map_err(failed)?)
    }
}

fn encode(bytes: &[u8], [width, height]: [u32; 2], color: ColorType, format: ImageFormat) -> ImageResult<Vec<u8>> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels * u64::from(color.bytes_per_pixel()) != bytes.len() as u64 {
        let text = format!("{} bytes are no picture of {width}x{height} pixels", bytes.len());
        return Err(image::ImageError::IoError(io::Error::new(io::ErrorKind::InvalidInput, text)));
    }
    let mut encoded = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut encoded, bytes, width, height, color, format)?;
    Ok(encoded.into_inner())
}
