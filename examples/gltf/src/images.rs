//! Images: decoded by background jobs of the scheduler, while the loader reads the rest of the file.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use drawloom::scene::Texture;
use drawloom::task::{BackgroundJob, Scheduler};
use image::{ImageReader, Limits, RgbaImage};
use indicatif::ProgressBar;

use crate::document::Source;
use crate::error::Problem;
use crate::files::read_uri;

/// Images that are being decoded.
pub(crate) struct Decoding(Vec<(usize, BackgroundJob<Result<RgbaImage, Problem>>)>);

impl Decoding {
    /// Starts to decode the images of these indices.
    ///
    /// # Errors
    /// If one has neither a URI nor bytes.
    pub(crate) fn start(
        source: &Source,
        images: impl IntoIterator<Item = usize>,
        scheduler: &Scheduler,
    ) -> Result<Self, Problem> {
        let pixels = Arc::new(AtomicU64::new(0));
        let mut jobs = Vec::new();
        for image in images {
            let encoded = Encoded::find(source, image)?;
            let pixels = Arc::clone(&pixels);
            jobs.push((image, scheduler.background(move || encoded.decode(image, &pixels))));
        }
        Ok(Self(jobs))
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// Waits for all of them. Returns each by its index.
    ///
    /// # Errors
    /// If one cannot be read or decoded, or is too large. The others are decoded to no purpose.
    pub(crate) fn wait(self, progress: &ProgressBar) -> Result<BTreeMap<usize, Arc<RgbaImage>>, Problem> {
        let mut images = BTreeMap::new();
        for (image, job) in self.0 {
            let panicked = |panic: drawloom::task::JobPanic| Problem::Image { image, reason: panic.to_string() };
            images.insert(image, Arc::new(job.wait().map_err(panicked)??));
            progress.inc(1);
        }
        Ok(images)
    }
}

/// The greatest number of pixels that all images have.
const MAX_PIXELS: u64 = 1 << 28;

/// An image before it is decoded.
enum Encoded {
    Bytes(Arc<[u8]>, Range<usize>),
    Uri { folder: PathBuf, uri: String },
}

impl Encoded {
    fn find(source: &Source, image: usize) -> Result<Self, Problem> {
        // The crate's own wrapper panics if an image in a buffer has no media type.
        let json = &source.document.as_json().images[image];
        if let Some(view) = json.buffer_view.and_then(|view| source.document.views().nth(view.value())) {
            let (buffer, range) = source.view(&view)?;
            return Ok(Self::Bytes(Arc::clone(buffer), range));
        }
        match &json.uri {
            Some(uri) => Ok(Self::Uri { folder: source.folder.clone(), uri: uri.clone() }),
            None => Err(Problem::invalid(format!("image {image}"), "has neither a URI nor a buffer view")),
        }
    }

    fn decode(self, image: usize, pixels: &AtomicU64) -> Result<RgbaImage, Problem> {
        let read;
        let bytes = match &self {
            Self::Bytes(buffer, range) => &buffer[range.clone()],
            Self::Uri { folder, uri } => {
                read = read_uri(folder, &format!("image {image}"), uri)?;
                &read[..]
            }
        };
        let failed = |error: image::ImageError| Problem::Image { image, reason: error.to_string() };
        let reader = || -> Result<_, Problem> {
            let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
            let mut reader = reader.map_err(|error| failed(error.into()))?;
            let mut limits = Limits::default();
            (limits.max_image_width, limits.max_image_height) = (Some(Texture::MAX_SIZE), Some(Texture::MAX_SIZE));
            reader.limits(limits);
            Ok(reader)
        };
        let (width, height) = reader()?.into_dimensions().map_err(failed)?;
        if width > Texture::MAX_SIZE || height > Texture::MAX_SIZE {
            let (element, limit) = (format!("image {image}"), u64::from(Texture::MAX_SIZE));
            return Err(Problem::TooMany { element, what: "pixels a side", count: width.max(height).into(), limit });
        }
        let count = u64::from(width) * u64::from(height);
        // Relaxed: only the sum counts.
        let count = count + pixels.fetch_add(count, Ordering::Relaxed);
        if count > MAX_PIXELS {
            let element = format!("image {image}, with those decoded before it,");
            return Err(Problem::TooMany { element, what: "pixels", count, limit: MAX_PIXELS });
        }
        Ok(reader()?.decode().map_err(failed)?.into_rgba8())
    }
}
