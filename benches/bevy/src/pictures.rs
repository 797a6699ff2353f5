//! Pictures: read from a texture, compared, and saved.

use std::path::Path;
use std::sync::mpsc;

use drawloom::wgpu;

use crate::contender::{Contender, Failure};
use crate::layout::{Layout, PICTURE};

/// A pixel's channels are at most this where no object is.
const BACKGROUND: u8 = 8;
/// The share of pixels that only one of two renderers may cover. Both round the edges of cubes that are few pixels wide.
const TOLERANCE: f64 = 0.01;

/// Reads a texture of [`PICTURE`]² pixels of four bytes.
///
/// # Errors
/// Returns an error if it cannot be read.
pub fn read(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<Vec<u8>, Failure> {
    let bytes_per_row = PICTURE * 4;
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(bytes_per_row * PICTURE),
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
    Ok(buffer.get_mapped_range(..)?.to_vec())
}

/// Compares which pixels the contenders cover, camera by camera, and saves the pictures into `folder`, if there is one.
///
/// # Errors
/// Returns an error if a contender draws nothing, or covers other pixels than the first one.
pub fn compare(contenders: &mut [Box<dyn Contender>], layout: &Layout, folder: Option<&Path>) -> Result<(), Failure> {
    for camera in 0..layout.cameras {
        let mut first = Vec::new();
        for contender in contenders.iter_mut() {
            let name = contender.name();
            let picture = contender.picture(camera)?;
            if let Some(folder) = folder {
                let file = format!("{}-{}-{camera}-{name}.png", layout.name, layout.objects);
                image::save_buffer(folder.join(file), &picture, PICTURE, PICTURE, image::ColorType::Rgba8)?;
            }
            let covered: Vec<_> =
                picture.chunks_exact(4).map(|pixel| pixel[..3].iter().any(|&channel| channel > BACKGROUND)).collect();
            if !covered.contains(&true) {
                return Err(format!("{name} draws nothing for camera {camera}").into());
            }
            if first.is_empty() {
                first = covered;
                continue;
            }
            let differ = first.iter().zip(&covered).filter(|(one, other)| one != other).count();
            if differ as f64 > TOLERANCE * covered.len() as f64 {
                return Err(format!("{name} draws another picture for camera {camera}: {differ} pixels differ").into());
            }
        }
    }
    Ok(())
}
