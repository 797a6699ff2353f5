//! The view that a result is of, as shaders read it.

use drawloom::backend::Picture;
use drawloom::glam::Vec3;
use drawloom::process::Format;
use drawloom::scene::Camera;
use drawloom::view::{GpuView, RenderView};

/// The words of `layer_view` in `layer_lookup.wgsl`: a matrix, the two halves of a position, whether there is a result,
/// and the projection.
const WORDS: usize = 24;

/// The view that a result is of, as a row of words for `layer_view` in `layer_lookup.wgsl`. It is a texture of whole
/// numbers, because each view has its own, and devices may have no storage buffers left; and so that positions are
/// exact, and nothing flushes a denormal. `None` stands for no result.
pub(crate) fn view_picture(camera: Option<&Camera>) -> Picture {
    let view = camera.and_then(|camera| GpuView::new(&RenderView::new(camera), Vec3::ZERO, 0));
    let mut words = [0_u32; WORDS];
    if let Some(view) = view {
        let matrix = view.clip_from_relative.to_cols_array().map(f32::to_bits);
        words[..16].copy_from_slice(&matrix);
        words[16..19].copy_from_slice(&view.position_low);
        words[19..22].copy_from_slice(&view.position_high.map(i32::cast_unsigned));
        words[22..].copy_from_slice(&[1, view.projection]);
    }
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Picture { width: WORDS as u32, height: 1, format: Format::R32Uint, bytes }
}
