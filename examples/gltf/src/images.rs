//! Images: decoded by background jobs of the scheduler, while the loader reads the rest of the file.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;

use drawloom::scene::Texture;
use drawloom::task::{BackgroundJob, JobPanic, Scheduler};
use image::imageops::{self, FilterType};
use image::{DynamicImage, ImageDecoder, ImageReader, Limits, RgbaImage};
use indicatif::ProgressBar;

use crate::document::{Bytes, Source};
use crate::element::{Element, Kind};
use crate::error::Problem;
use crate::files::read_uri;
use crate::limits::Limit;
use crate::text::excerpt;
use crate::warnings::Warnings;

/// Images that are being decoded, with their names in messages.
pub(crate) struct Decoding(Vec<(usize, String, DecodingJob)>);

type DecodingJob = BackgroundJob<Result<Decoded, String>>;

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
        let limit = source.limits.texture_bytes;
        let mut jobs = Vec::new();
        for image in images.into_iter().filter_map(|image| source.get(Kind::Image, image)) {
            let name = image.to_string();
            match encoded(source, &image, &all) {
                Ok(bytes) => jobs.push((image.index, name, scheduler.background(move || decode(&bytes, limit)))),
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
    pub(crate) fn wait(self, progress: &ProgressBar, warnings: &mut Warnings) -> BTreeMap<usize, Arc<RgbaImage>> {
        let mut images = BTreeMap::new();
        for (index, image, job) in self.0 {
            match job.wait().unwrap_or_else(|panic: JobPanic| Err(panic.to_string())) {
                Ok(Decoded { image: pixels, reduced_from }) => {
                    if let Some([width, height]) = reduced_from {
                        let [reduced, lower] = <[u32; 2]>::from(pixels.dimensions());
                        warnings.add(format!("{image} of {width}x{height} pixels is reduced to {reduced}x{lower}"));
                    }
                    images.insert(index, Arc::new(pixels));
                }
                Err(reason) => {
                    let problem = Problem::Image { image: image.clone(), reason: excerpt(reason.trim()) };
                    warnings.add(format!("{image} is left out: {problem}"));
                }
            }
            progress.inc(1);
        }
        images
    }
}

/// The bytes of an image, if they and its pixels are within the limits.
fn encoded(source: &Source, image: &Element<'_>, all: &Limit) -> Result<Bytes, Problem> {
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
    let failed = |reason: String| Problem::Image { image: image.to_string(), reason: excerpt(reason.trim()) };
    let decoder = reader(&bytes, source.limits.texture_bytes).map_err(failed)?;
    let decoder = decoder.into_decoder().map_err(|error| failed(error.to_string()))?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let bytes_a_pixel = u64::from(decoder.color_type().bytes_per_pixel());
    let channels = decoder.color_type().channel_count();
    drop(decoder);
    let has_bytes = bytes_a_pixel == u64::from(channels);
    Limit::new("texture_bytes", source.limits.texture_bytes).take(
        image,
        pixels,
        if has_bytes { 4 } else { 4 + bytes_a_pixel },
    )?;
    all.take(image, pixels.saturating_mul(4).saturating_add(bytes.len() as u64), 1)?;
    Ok(bytes)
}

fn reader(bytes: &[u8], limit: u64) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(limit);
    reader.limits(limits);
    Ok(reader)
}

fn decode(bytes: &[u8], limit: u64) -> Result<Decoded, String> {
    let decoder = reader(bytes, limit)?.into_decoder().map_err(|error| error.to_string())?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?.into_rgba8();
    let (width, height) = image.dimensions();
    let greatest = width.max(height);
    if greatest <= Texture::MAX_SIZE {
        return Ok(Decoded { image, reduced_from: None });
    }
    let reduced = |side: u32| {
        let side = u64::from(side) * u64::from(Texture::MAX_SIZE) / u64::from(greatest);
        side.max(1) as u32
    };
    let reduced = imageops::resize(&image, reduced(width), reduced(height), FilterType::Triangle);
    Ok(Decoded { image: reduced, reduced_from: Some([width, height]) })
}
