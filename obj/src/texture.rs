//! Decoding of textures, whose size is known and checked before.

use std::io::{self, BufRead, Read, Seek};

use drawloom::scene::Texture;
use drawloom::text::Escaped;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use crate::limits::Limit;

/// RGBA bytes, rows from top to bottom.
#[derive(Debug)]
pub(crate) struct Pixels {
    pub width: u32,
    pub height: u32,
    pub bytes: Vec<u8>,
    /// Width and height in the file, if it is scaled down.
    pub scaled_from: Option<[u32; 2]>,
}

/// Decodes a PNG, JPEG, TGA or BMP, and scales it to [`Texture::MAX_SIZE`] if it is larger. `while_decoded` limits the
/// bytes that this takes, and `result` those of the result. Of `decoded` it takes those of the file's pixels, also if
/// these turn out to be damaged.
///
/// # Errors
/// Says why it cannot be decoded, or which limit it exceeds.
pub(crate) fn decode(
    name: &str,
    mut file: impl BufRead + Seek,
    while_decoded: Limit,
    result: Limit,
    decoded: &mut Limit,
) -> Result<Pixels, String> {
    let components = match kept_components(&mut file) {
        // The decoder will say so.
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => 0,
        found => found.map_err(message)?,
    };
    file.rewind().map_err(message)?;
    let mut reader = ImageReader::new(file);
    // The guess from the contents comes first, but TGA has no magic number.
    if let Ok(format) = ImageFormat::from_path(name) {
        reader.set_format(format);
    }
    let mut reader = reader.with_guessed_format().map_err(message)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(while_decoded.bytes);
    reader.limits(limits);
    // A decoder that runs into the limit does not know its name.
    let refused = |error: ImageError| match error {
        ImageError::Limits(_) => {
            let Limit { field, bytes, .. } = while_decoded;
            format!("to decode it takes more than `ObjLimits::{field}`, which is {bytes}")
        }
        other => message(other),
    };
    let decoder = reader.into_decoder().map_err(refused)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let rgba_bytes = pixels.saturating_mul(4);
    let has_bytes = decoder.color_type().bytes_per_pixel() == decoder.color_type().channel_count();
    let other_bytes =
        if has_bytes { 0 } else { decoder.total_bytes() }.saturating_add(pixels.saturating_mul(components * 2));
    while_decoded
        .check(rgba_bytes.saturating_add(other_bytes))
        .map_err(|error| format!("{width}x{height}: {error}"))?;
    let [scaled_width, scaled_height] = [width, height].map(|side| side.min(Texture::MAX_SIZE));
    result.check(u64::from(scaled_width) * u64::from(scaled_height) * 4).map_err(message)?;
    decoded.take(rgba_bytes).map_err(message)?;
    let mut bytes = if has_bytes {
        decode_bytes(decoder, rgba_bytes)?
    } else {
        DynamicImage::from_decoder(decoder).map_err(refused)?.into_rgba8().into_raw()
    };
    let is_scaled = [scaled_width, scaled_height] != [width, height];
    if is_scaled {
        scale_down(&mut bytes, [width, height], [scaled_width, scaled_height]);
    }
    let scaled_from = is_scaled.then_some([width, height]);
    Ok(Pixels { width: scaled_width, height: scaled_height, bytes, scaled_from })
}

/// The message of an error on one line, without control characters: some of decoders end with a line feed, or quote the
/// file.
fn message(error: impl ToString) -> String {
    Escaped::new(error.to_string().trim()).to_string()
}

/// The number of components of a JPEG that is progressive, or whose first scan lacks some of them. Its decoder keeps 16
/// bits of each until the last scan is read. 0 for any other file, which is decoded row by row.
///
/// # Errors
/// If reading fails, or a JPEG ends before its first scan.
fn kept_components(file: &mut (impl BufRead + Seek)) -> io::Result<u64> {
    if !file.fill_buf()?.starts_with(b"\xff\xd8") {
        return Ok(0);
    }
    file.consume(2);
    let mut of_frame = 0;
    loop {
        let marker = next_marker(file)?;
        // Its own two bytes count.
        let length = u16::from_be_bytes(read_array(file)?);
        let mut read = 2;
        match marker {
            // The header of a frame, sequential up to 0xc1: bits, height, width, and number of components.
            0xc0 | 0xc1 | 0xc2 | 0xc6 | 0xca | 0xce => {
                let [_, _, _, _, _, components] = read_array(file)?;
                if marker > 0xc1 {
                    return Ok(u64::from(components));
                }
                of_frame = components;
                read += 6;
            }
            // The first scan: its number of components.
            0xda => {
                let [of_scan] = read_array(file)?;
                return Ok(if of_scan == of_frame { 0 } else { u64::from(of_frame) });
            }
            _ => {}
        }
        file.seek_relative(i64::from(length) - read)?;
    }
}

/// The next marker of a JPEG. Decoders skip what is between segments, so this does, too.
fn next_marker(file: &mut impl BufRead) -> io::Result<u8> {
    loop {
        file.skip_until(0xff)?;
        let mut marker = 0xff;
        while marker == 0xff {
            let buffer = file.fill_buf()?;
            let fill_bytes = buffer.iter().take_while(|byte| **byte == 0xff).count();
            if buffer.is_empty() {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            if let Some(&behind) = buffer.get(fill_bytes) {
                marker = behind;
            }
            let read = buffer.len().min(fill_bytes + 1);
            file.consume(read);
        }
        if marker != 0 {
            return Ok(marker);
        }
    }
}

fn read_array<const LENGTH: usize>(file: &mut impl Read) -> io::Result<[u8; LENGTH]> {
    let mut bytes = [0; LENGTH];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Decodes channels of 8 bits into the memory of the result.
fn decode_bytes(decoder: impl ImageDecoder, rgba_bytes: u64) -> Result<Vec<u8>, String> {
    let channels = usize::from(decoder.color_type().channel_count());
    let size = usize::try_from(rgba_bytes).map_err(message)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(size).map_err(|_| message(io::Error::from(io::ErrorKind::OutOfMemory)))?;
    bytes.resize(size, 0);
    decoder.read_image(&mut bytes[..size / 4 * channels]).map_err(message)?;
    to_rgba(&mut bytes, channels);
    Ok(bytes)
}

/// Converts pixels of `channels` channels, which lie at the start, to RGBA, from the last one to the first.
fn to_rgba(bytes: &mut [u8], channels: usize) {
    for pixel in (0..bytes.len() / 4).rev() {
        let from = &bytes[pixel * channels..][..channels];
        let rgba = match *from {
            [gray] => [gray, gray, gray, 255],
            [gray, alpha] => [gray, gray, gray, alpha],
            [red, green, blue] => [red, green, blue, 255],
            [red, green, blue, alpha, ..] => [red, green, blue, alpha],
            [] => continue,
        };
        bytes[pixel * 4..][..4].copy_from_slice(&rgba);
    }
}

/// Replaces RGBA pixels by a smaller picture, whose pixels are the means of those that they cover. A pixel is written
/// where none is read afterwards, so this takes no memory.
fn scale_down(bytes: &mut Vec<u8>, [width, height]: [u32; 2], [scaled_width, scaled_height]: [u32; 2]) {
    let covered = |index: u32, from: u32, to: u32| {
        let start = |index: u32| (u64::from(index) * u64::from(from) / u64::from(to)) as usize;
        start(index)..start(index + 1)
    };
    for row in 0..scaled_height {
        let rows = covered(row, height, scaled_height);
        for column in 0..scaled_width {
            let columns = covered(column, width, scaled_width);
            let mut sums = [0_u64; 4];
            for line in rows.clone() {
                let first = line * width as usize;
                for pixel in bytes[(first + columns.start) * 4..(first + columns.end) * 4].as_chunks::<4>().0 {
                    sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u64::from(*value));
                }
            }
            let count = (rows.len() * columns.len()) as u64;
            let mean = sums.map(|sum| ((sum + count / 2) / count) as u8);
            bytes[(row as usize * scaled_width as usize + column as usize) * 4..][..4].copy_from_slice(&mean);
        }
    }
    bytes.truncate(scaled_width as usize * scaled_height as usize * 4);
    bytes.shrink_to_fit();
}

/// By how much JPEG changes texels of a mask that are far from its edges.
const NOISE: u8 = 16;

/// A texel is near an edge if a clear one and a solid one are within this many texels of it along each axis. The
/// filters of common programs blur an edge as far as that.
const EDGE_DISTANCE: usize = 2;

/// A mask may have one outlier for each of this many texels: a texel that is neither clear nor solid, nor near an edge.
const TEXELS_PER_OUTLIER: usize = 64;

fn is_clear(alpha: u8) -> bool {
    alpha < NOISE
}

fn is_solid(alpha: u8) -> bool {
    alpha > u8::MAX - NOISE
}

impl Pixels {
    /// White pixels of the same opacity.
    pub(crate) fn into_white(mut self) -> Self {
        self.bytes.as_chunks_mut::<4>().0.iter_mut().for_each(|[colors @ .., _]| *colors = [255; 3]);
        self
    }

    /// Makes a mask of a picture of `map_d`: the alpha is its own if that is not 255 everywhere, else its luminance.
    pub(crate) fn into_mask(mut self) -> Self {
        let is_opaque = self.opacities().0 == 255;
        for pixel in self.bytes.as_chunks_mut::<4>().0.iter_mut().filter(|_| is_opaque) {
            let [red, green, blue, _] = pixel.map(u32::from);
            pixel[3] = ((77 * red + 150 * green + 29 * blue) >> 8) as u8;
        }
        self
    }

    /// Takes the opacity of a mask, which may have another size. The picture is as wide and as high as the larger of
    /// the two afterwards, if that takes at most `max_bytes` and there is memory for it: foliage may have one colour
    /// and a large mask. Otherwise it keeps its size, and the result is `false`.
    pub(crate) fn set_opacity(&mut self, mask: &Self, max_bytes: u64) -> bool {
        let is_enlarged = self.enlarge([self.width.max(mask.width), self.height.max(mask.height)], max_bytes);
        let sources = nearest([mask.width, mask.height], [self.width, self.height]);
        for (pixel, source) in self.bytes.as_chunks_mut::<4>().0.iter_mut().zip(sources) {
            pixel[3] = mask.bytes[source * 4 + 3];
        }
        is_enlarged
    }

    /// Repeats pixels until the picture has a size, if it takes at most `max_bytes` then and there is memory for it.
    fn enlarge(&mut self, [width, height]: [u32; 2], max_bytes: u64) -> bool {
        if [self.width, self.height] == [width, height] {
            return true;
        }
        let size = Some(u64::from(width) * u64::from(height) * 4).filter(|&size| size <= max_bytes);
        let Some(size) = size.and_then(|size| usize::try_from(size).ok()) else { return false };
        let mut enlarged = Vec::new();
        if enlarged.try_reserve_exact(size).is_err() {
            return false;
        }
        let pixels = self.bytes.as_chunks::<4>().0;
        for source in nearest([self.width, self.height], [width, height]) {
            enlarged.extend_from_slice(&pixels[source]);
        }
        *self = Self { width, height, bytes: enlarged, scaled_from: self.scaled_from };
        true
    }

    /// Whether a mask cuts holes: part of it is clear, and nearly all the rest is solid. Between them, texels may be
    /// anything where an edge is near, as filters and JPEG leave them there. A smooth transition, or glass, is wider.
    pub(crate) fn cuts_holes(&self) -> bool {
        let (width, height) = (self.width as usize, self.height as usize);
        let alpha = |x: usize, y: usize| self.bytes[(y * width + x) * 4 + 3];
        // Textures repeat.
        let around = |center: usize, side: usize| {
            (0..=2 * EDGE_DISTANCE).map(move |step| (center + side * EDGE_DISTANCE + step - EDGE_DISTANCE) % side)
        };
        let is_at_edge = |x: usize, y: usize| {
            let (mut clear, mut solid) = (false, false);
            for alpha in around(y, height).flat_map(|y| around(x, width).map(move |x| alpha(x, y))) {
                (clear, solid) = (clear || is_clear(alpha), solid || is_solid(alpha));
                if clear && solid {
                    return true;
                }
            }
            false
        };
        let max_outliers = width * height / TEXELS_PER_OUTLIER;
        let (mut outliers, mut has_holes) = (0, false);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let alpha = alpha(x, y);
            has_holes |= is_clear(alpha);
            if !is_clear(alpha) && !is_solid(alpha) && !is_at_edge(x, y) {
                outliers += 1;
                if outliers > max_outliers {
                    return false;
                }
            }
        }
        has_holes
    }

    /// Whether a mask hides nothing: it is white, perhaps with the noise of JPEG.
    pub(crate) fn hides_nothing(&self) -> bool {
        self.opacities().0 > u8::MAX - NOISE
    }

    /// The least and the greatest opacity.
    pub(crate) fn opacities(&self) -> (u8, u8) {
        let alphas = self.bytes.as_chunks::<4>().0.iter().map(|pixel| pixel[3]);
        alphas.fold((255, 0), |(low, high), alpha| (low.min(alpha), high.max(alpha)))
    }
}

/// For each pixel of a picture, row by row, the index of the pixel at the same place of a picture of another size.
fn nearest([source_width, source_height]: [u32; 2], [width, height]: [u32; 2]) -> impl Iterator<Item = usize> {
    let scaled = |index: u32, from: u32, to: u32| (u64::from(index) * u64::from(from) / u64::from(to)) as usize;
    let rows = (0..height).map(move |row| scaled(row, source_height, height) * source_width as usize);
    rows.flat_map(move |row| (0..width).map(move |column| row + scaled(column, source_width, width)))
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, Cursor};

    use super::*;
    use image::{ExtendedColorType, ImageEncoder};

    fn png(size: [u32; 2], color: ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        image::codecs::png::PngEncoder::new(&mut file).write_image(bytes, size[0], size[1], color).unwrap();
        file
    }

    fn decode_within(file: Vec<u8>, bytes: u64) -> Result<Pixels, String> {
        decode_named("a.png", file, bytes)
    }

    fn decode_named(name: &str, file: Vec<u8>, bytes: u64) -> Result<Pixels, String> {
        let [texture, all] =
            [("texture_bytes", bytes), ("all_textures_bytes", 1 << 20)].map(|(field, bytes)| Limit::new(field, bytes));
        decode(name, Cursor::new(file), texture, all, &mut Limit::new("decoded_bytes", 1 << 20))
    }

    #[test]
    fn every_number_of_channels_and_bits_becomes_rgba() {
        let bytes: Vec<u8> = (0..48).map(|value| value * 5).collect();
        for (color, channels, depth) in [
            (ExtendedColorType::L8, 1, 1),
            (ExtendedColorType::La8, 2, 1),
            (ExtendedColorType::Rgb8, 3, 1),
            (ExtendedColorType::Rgba8, 4, 1),
            (ExtendedColorType::L16, 1, 2),
            (ExtendedColorType::Rgba16, 4, 2),
        ] {
            let bytes = &bytes[..6 * channels * depth];
            let file = png([3, 2], color, bytes);
            let expected = image::load_from_memory(&file).unwrap().into_rgba8().into_raw();
            let decoded = decode_within(file, 1000).unwrap();
            assert_eq!((decoded.width, decoded.height, decoded.bytes), (3, 2, expected), "{color:?}");
        }
    }

    #[test]
    fn the_size_is_checked_before_decoding() {
        let file = png([30, 20], ExtendedColorType::L8, &[7; 600]);
        assert!(decode_within(file.clone(), 2400).is_ok());
        let error = decode_within(file.clone(), 2399).map(drop).unwrap_err();
        assert_eq!(error, "30x20: it takes 2400 bytes or more, and `ObjLimits::texture_bytes` is 2399");
        // Up to the pixels, which are missing.
        let header = file.windows(4).position(|tag| tag == b"IDAT").unwrap() + 4;
        let error = decode_within(file[..header].to_vec(), 2399).map(drop).unwrap_err();
        assert!(error.contains("texture_bytes"), "{error}");
        let file = png([10, 10], ExtendedColorType::L16, &[7; 200]);
        assert!(decode_within(file.clone(), 600).is_ok() && decode_within(file, 599).is_err());
        // 18 bytes that claim 65,535 × 65,535 pixels.
        let header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 32, 0];
        let error = decode_named("a.tga", header.to_vec(), 256 << 20).map(drop).unwrap_err();
        assert!(error.contains("`ObjLimits::texture_bytes` is 268435456"), "{error}");
    }

    #[test]
    fn the_message_of_a_decoder_is_one_line() {
        let error = decode_named("a.jpg", vec![0xf8], 1 << 20).map(drop).unwrap_err();
        assert!(!error.contains(char::is_control) && error.starts_with("Format error decoding Jpeg"), "{error:?}");
    }

    fn components(file: &[u8]) -> u64 {
        kept_components(&mut Cursor::new(file)).unwrap_or(0)
    }

    #[test]
    fn the_coefficients_that_the_decoder_of_a_jpeg_keeps_count() {
        let mut file = Vec::new();
        let encoder = image::codecs::jpeg::JpegEncoder::new(&mut file);
        encoder.write_image(&[7; 600 * 3], 30, 20, ExtendedColorType::Rgb8).unwrap();
        assert_eq!(components(&file), 0);
        // A scan for each component.
        let scan = file.windows(2).position(|marker| marker == [0xff, 0xda]).unwrap();
        let split = [&file[..scan + 4], &[1], &file[scan + 5..]].concat();
        assert_eq!(components(&split), 3);
        let header = file.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
        file[header + 1] = 0xc2;
        assert_eq!(components(&file), 3);
        let error = decode_named("a.jpg", file.clone(), 5999).map(drop).unwrap_err();
        assert_eq!(error, "30x20: it takes 6000 bytes or more, and `ObjLimits::texture_bytes` is 5999");
        for end in 0..file.len() {
            components(&file[..end]);
        }
        assert_eq!(components(b"\xff\xd8\xff\xe0\0\0\xff\xe0\0\0"), 0);
        // What decoders skip in front of a marker, also where it ends a buffer.
        for skipped in [&[0xff; 9][..], &[0], &[0xff, 0], &[7, 0xff, 0xff, 0, 0xff]] {
            let skipping = [&file[..header], skipped, &file[header..]].concat();
            assert_eq!(components(&skipping), 3, "{skipped:?}");
            let in_static_groups = BufReader::with_capacity(header + 4, Cursor::new(&skipping));
            assert_eq!(kept_components(&mut { in_static_groups }).unwrap(), 3, "{skipped:?}");
            let error = decode_named("a.jpg", skipping, 5999).map(drop).unwrap_err();
            assert!(error.contains("it takes 6000 bytes"), "{skipped:?}: {error}");
        }
    }

    #[test]
    fn scaling_takes_the_means_of_what_each_pixel_covers() {
        for (from, to) in [([7, 5], [3, 5]), ([6, 4], [3, 2]), ([9, 1], [8, 1]), ([1, 9], [1, 2])] {
            let value = |x: u32, y: u32, channel: u32| (x * 31 + y * 57 + channel * 101) as u8;
            let mut bytes = Vec::new();
            for y in 0..from[1] {
                for x in 0..from[0] {
                    bytes.extend([0, 1, 2, 3].map(|channel| value(x, y, channel)));
                }
            }
            scale_down(&mut bytes, from, to);
            assert_eq!(bytes.len() as u32, to[0] * to[1] * 4);
            for y in 0..to[1] {
                for x in 0..to[0] {
                    for channel in 0..4 {
                        let covered = |index: u32, axis: usize| {
                            (0..from[axis]).filter(move |&at| {
                                let (start, end) = (index * from[axis] / to[axis], (index + 1) * from[axis] / to[axis]);
                                start <= at && at < end
                            })
                        };
                        let values: Vec<f64> = covered(y, 1)
                            .flat_map(|y| covered(x, 0).map(move |x| f64::from(value(x, y, channel))))
                            .collect();
                        let mean = values.iter().sum::<f64>() / values.len() as f64;
                        let found = bytes[((y * to[0] + x) * 4 + channel) as usize];
                        assert!((f64::from(found) - mean).abs() <= 0.5, "{from:?} {to:?} {x} {y} {channel}");
                    }
                }
            }
        }
    }
}
