//! Compares the pictures of all techniques.

use std::sync::mpsc;

use drawloom::wgpu;

use crate::technique::{Contender, Failure};

/// Reads a texture of four bytes per pixel.
///
/// # Errors
/// Returns an error if it cannot be read.
pub fn read(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<Vec<u8>, Failure> {
    let size = texture.size();
    let row = size.width * 4;
    if !row.is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT) {
        return Err(format!("a picture {} pixels wide needs padding", size.width).into());
    }
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
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

/// Has each contender draw a frame, and compares its pictures with those of the first. The hand-written techniques
/// round positions to f32, so a pixel at an edge may differ.
///
/// # Errors
/// Returns an error if one does not draw all objects, or draws another picture.
pub fn compare(contenders: &mut [Contender], has_pictures: bool) -> Result<(), Failure> {
    let mut first = Vec::new();
    for contender in contenders {
        let name = [contender.name, contender.threads()].join(" ");
        contender.run(|technique, world| {
            technique.frame(world.as_scene_ref())?;
            technique.wait()
        })?;
        let drawn = contender.technique().drawn();
        let scene = contender.world.as_scene_ref();
        let (views, all) = (scene.cameras.len(), scene.object_count() * scene.cameras.len());
        if drawn != all {
            return Err(format!("{name} draws {drawn} objects of {all}").into());
        }
        let cameras = 0..if has_pictures { views } else { 0 };
        let pictures = cameras.map(|camera| contender.technique().picture(camera)).collect::<Result<Vec<_>, _>>()?;
        if first.is_empty() {
            first = pictures.concat();
            if has_pictures && first.iter().all(|&byte| byte == 0) {
                return Err(format!("{name} draws nothing").into());
            }
            continue;
        }
        let differ =
            first.iter().zip(pictures.concat()).filter(|(one, other)| one.abs_diff(*other) > TOLERANCE).count();
        if differ > first.len() / BYTES_PER_DIFFERENCE {
            return Err(format!("{name} draws another picture: {differ} of {} bytes differ", first.len()).into());
        }
    }
    Ok(())
}

/// Bytes that differ by at most this count as the same.
const TOLERANCE: u8 = 2;
/// One in this many bytes may differ by more.
const BYTES_PER_DIFFERENCE: usize = 500;
