//! Images: decoded by background jobs of the scheduler, while the loader reads the rest of the file.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;

use drawloom::task::{BackgroundJob, JobPanic, Scheduler};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage, imageops};

use crate::document::{Bytes, Source};
use crate::element::{Element, Kind};
use crate::error::{Problem, excerpt};
use crate::files::read_uri;
use crate::jpeg::keeps_coefficients;
use crate::limits::Limit;
use crate::progress::StepCounter;
use crate::warnings::Warnings;

/// Images that are being decoded, with their names in messages.
pub(crate) struct Decoding(Vec<(usize, String, DecodingJob)>);

type DecodingJob = BackgroundJob<Result<Decoded, String>>;

/// A decoded image, with its name in messages.
#[derive(Debug)]
pub(crate) struct NamedImage {
    pub(crate) name: String,
    pub(crate) pixels: RgbaImage,
}

/// An image that is within the limits.
struct Encoded {
    bytes: Bytes,
    /// What a decoder may allocate beside the pixels.
    spare_bytes: u64,
}

struct Decoded {
    image: RgbaImage,
    /// The size in the file, if it is greater.
    reduced_from: Option<[u32; 2]>,
}

impl Decoding {
    /// Starts to decode the images of these indices. Those that cannot be read or are too large are left out, with a
    /// warning.
    pub(crate) fn start(
        source: &Source,
        images: impl IntoIterator<Item = usize>,
        scheduler: &Scheduler,
        warnings: &mut Warnings,
    ) -> Self {
        let all = Limit::new("all_textures_bytes", source.limits.all_textures_bytes);
        let mut jobs = Vec::new();
        for image in images.into_iter().filter_map(|image| source.get(Kind::Image, image)) {
            let name = image.to_string();
            match encoded(source, &image, &all) {
                Ok(encoded) => jobs.push((image.index, name, scheduler.background(move || decode(&encoded)))),
                // Limits of images are limits of each, too.
                Err(problem) => warnings.add(format!("{name} is left out: {problem}")),
            }
        }
        Self(jobs)
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// Waits for all of them. Returns each by its index; those that cannot be decoded are left out, with a warning.
    pub(crate) fn wait(self, steps: &mut StepCounter<'_>, warnings: &mut Warnings) -> BTreeMap<usize, Arc<NamedImage>> {
        let mut images = BTreeMap::new();
        for (index, name, job) in self.0 {
            match job.wait().unwrap_or_else(|panic: JobPanic| Err(panic.to_string())) {
                Ok(Decoded { image: pixels, reduced_from }) => {
                    if let Some([width, height]) = reduced_from {
                        let [reduced, lower] = <[u32; 2]>::from(pixels.dimensions());
                        warnings.add(format!("{name} of {width}x{height} pixels is reduced to {reduced}x{lower}"));
                    }
                    images.insert(index, Arc::new(NamedImage { name, pixels }));
                }
                Err(reason) => {
                    let problem = Problem::Image { image: name.clone(), reason: excerpt(reason.trim()) };
                    warnings.add(format!("{name} is left out: {problem}"));
                }
            }
            steps.step();
        }
        images
    }
}

/// An image, if its bytes and its pixels are within the limits.
fn encoded(source: &Source, image: &Element<'_>, all: &Limit) -> Result<Encoded, Problem> {
    let of_file = Limit::new("texture_file_bytes", source.limits.texture_file_bytes);
    let bytes = match (image.index("bufferView")?, image.text("uri")?) {
        (Some(view), _) => {
            let bytes = source.view(image, view)?.bytes;
            of_file.take(image, bytes.len() as u64, 1)?;
            bytes
        }
        (None, Some(uri)) => Bytes::new(read_uri(&source.folder, image, uri, &of_file)?),
        (None, None) => return Err(Problem::invalid(image, "has neither a URI nor a buffer view")),
    };
    // Also those of an image that cannot be decoded: they are read.
    all.take(image, bytes.len() as u64, 1)?;
    let failed = |reason: String| Problem::Image { image: image.to_string(), reason: excerpt(reason.trim()) };
    let limit = source.limits.texture_bytes;
    let reader = reader(&bytes, limit).map_err(failed)?;
    let is_jpeg = reader.format() == Some(ImageFormat::Jpeg);
    let decoder = reader.into_decoder().map_err(|error| failed(error.to_string()))?;
    let (size, color) = (<[u32; 2]>::from(decoder.dimensions()), decoder.color_type());
    drop(decoder);
    let taken = bytes_at_once(size, color, is_jpeg.then_some(&bytes));
    Limit::new("texture_bytes", limit).take(image, taken, 1)?;
    all.take(image, pixel_count(size), 4)?;
    Ok(Encoded { bytes, spare_bytes: (limit - taken).max(MIN_SPARE_BYTES) })
}

/// What a decoder may always allocate beside the pixels, for rows and metadata.
const MIN_SPARE_BYTES: u64 = 1 << 20;

/// The greatest number of bytes that an image takes at once while it is decoded and reduced. `jpeg` is its file if that
/// is a JPEG.
fn bytes_at_once(size: [u32; 2], color: ColorType, jpeg: Option<&[u8]>) -> u64 {
    let pixels = pixel_count(size);
    let as_rgba = pixels.saturating_mul(4);
    let decoded = pixels.saturating_mul(color.bytes_per_pixel().into());
    // The decoder of JPEGs copies the file, and may keep up to four coefficients of two bytes for each pixel, in blocks
    // of up to 32 by 32.
    let padded = pixel_count(size.map(|side| side.next_multiple_of(32)));
    let of_decoder = jpeg.map_or(0, |file| {
        let of_coefficients = if keeps_coefficients(file) { padded.saturating_mul(8) } else { 0 };
        of_coefficients.saturating_add(file.len() as u64)
    });
    let converted = if color == ColorType::Rgba8 { as_rgba } else { decoded.saturating_add(as_rgba) };
    let reduced = reduced_size(size).map_or(0, |size| pixel_count(size) * 4);
    decoded.saturating_add(of_decoder).max(converted).max(as_rgba.saturating_add(reduced))
}

fn pixel_count(size: [u32; 2]) -> u64 {
    size.map(u64::from).into_iter().product()
}

fn reader(bytes: &[u8], limit: u64) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(limit);
    reader.limits(limits);
    Ok(reader)
}

fn decode(encoded: &Encoded) -> Result<Decoded, String> {
    let decoder = reader(&encoded.bytes, encoded.spare_bytes)?.into_decoder().map_err(|error| error.to_string())?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?.into_rgba8();
    let size = <[u32; 2]>::from(image.dimensions());
    let Some([width, height]) = reduced_size(size) else { return Ok(Decoded { image, reduced_from: None }) };
    // Other filters convert the image to floats, which takes four times its memory.
    let reduced = imageops::thumbnail(&image, width, height);
    Ok(Decoded { image: reduced, reduced_from: Some(size) })
}

/// What usual devices allow to a side of a texture.
const MAX_SIDE: u32 = 8192;

/// The size of an image as a texture, if it is too large for one.
fn reduced_size(size: [u32; 2]) -> Option<[u32; 2]> {
    let greatest = size[0].max(size[1]);
    let reduced = |side: u32| {
        let side = u64::from(side) * u64::from(MAX_SIDE) / u64::from(greatest);
        side.max(1) as u32
    };
    (greatest > MAX_SIDE).then(|| size.map(reduced))
}
