//! Pictures: read from a texture, compared, and saved.

use std::path::Path;
use std::sync::mpsc;

use drawloom::wgpu;
use drawloom_output::PictureFile;

use crate::contender::{Contender, Failure};
use crate::layout::Layout;

/// A pixel's channels are at most this where no object is.
const BACKGROUND: u8 = 8;
/// The brightest channel of an object exceeds the others by this, out of 255.
const MIXED: u8 = 12;
/// Tolerances of [`Difference`]. Both renderers round the edges of cubes that are few pixels wide.
const SILHOUETTE_TOLERANCE: f64 = 0.05;
const COLOR_TOLERANCE: f64 = 0.05;

/// Reads a texture of pixels of four bytes.
///
/// # Errors
/// Returns an error if it cannot be read.
pub fn read(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<Vec<u8>, Failure> {
    let wgpu::Extent3d { width, height, .. } = texture.size();
    let row = width * 4;
    let bytes_per_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(bytes_per_row) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: None };
    let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    queue.submit([encoder.finish()]);
    let (sender, receiver) = mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver waits below.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    receiver.recv()??;
    let padded = buffer.get_mapped_range(..)?;
    Ok(padded.chunks_exact(bytes_per_row as usize).flat_map(|padded| &padded[..row as usize]).copied().collect())
}

/// Compares the contenders' pictures of the same frame, camera by camera, and saves them into `folder`, if there is
/// one.
///
/// # Errors
/// Returns an error if a contender draws nothing, or covers other pixels or with other colours than the first one.
pub fn compare(contenders: &mut [Box<dyn Contender>], layout: &Layout, folder: Option<&Path>) -> Result<(), Failure> {
    for camera in 0..layout.cameras {
        let mut first = Vec::new();
        for contender in contenders.iter_mut() {
            let name = contender.name();
            let picture = contender.picture(camera)?;
            if let Some(folder) = folder {
                let file = format!("{}-{}-{camera}-{name}.png", layout.name, layout.objects);
                PictureFile::new(folder.join(file))?.write([layout.picture; 2], &picture)?;
            }
            let colors: Vec<_> = picture.chunks_exact(4).map(Color::of).collect();
            if first.is_empty() {
                first = colors;
                continue;
            }
            let difference = Difference::new(&first, &colors);
            if difference.is_large() {
                return Err(format!("{name} draws another picture for camera {camera}: {difference:?}").into());
            }
        }
    }
    Ok(())
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Color {
    Background,
    /// The brightest channel.
    Channel(usize),
    /// The edge of two objects, of which no channel is clearly the brightest.
    Mixed,
}

impl Color {
    fn of(pixel: &[u8]) -> Self {
        let mut channels = [0, 1, 2].map(|channel| (pixel[channel], channel));
        channels.sort_unstable();
        let [_, (second, _), (brightest, channel)] = channels;
        match brightest {
            ..=BACKGROUND => Self::Background,
            _ if brightest - second < MIXED => Self::Mixed,
            _ => Self::Channel(channel),
        }
    }
}

/// How two pictures differ, as shares of the pixels that the first one covers.
#[derive(Debug)]
struct Difference {
    /// Pixels that only one of them covers.
    silhouette: f64,
    /// Pixels that they cover with different colours.
    color: f64,
}

impl Difference {
    fn new(one: &[Color], other: &[Color]) -> Self {
        let covered = one.iter().filter(|&&color| color != Color::Background).count();
        let share = |differs: fn(Color, Color) -> bool| {
            one.iter().zip(other).filter(|&(&one, &other)| differs(one, other)).count() as f64 / covered as f64
        };
        Self {
            silhouette: share(|one, other| (one == Color::Background) != (other == Color::Background)),
            color: share(|one, other| one != other && matches!((one, other), (Color::Channel(_), Color::Channel(_)))),
        }
    }

    /// Without a covered pixel the shares are not finite.
    fn is_large(&self) -> bool {
        !(self.silhouette <= SILHOUETTE_TOLERANCE && self.color <= COLOR_TOLERANCE)
    }
}
