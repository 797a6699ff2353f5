//! A pass that draws objects.

use super::attachments::{MAX_COLOR_ATTACHMENTS, OpenAttachments, TileAttachments};
use super::pass_context::PassContext;
use super::precision::Precision;
use super::software_pass::DepthWrites;
use super::triangle_setup::{TriangleRange, TriangleSetup, TriangleState};
use crate::process::{
    DeclaredAttribute, FaceCulling, ObjectCpuShader, ObjectPixel, PassInputs, ShaderObject, VARYINGS,
};
use crate::raster::{Triangle, Vector4};
use crate::scene::Blend;
use crate::task::JobPanic;

/// A pass that draws objects.
pub(super) struct ObjectPass<'a, R: Precision> {
    pub(super) context: PassContext<'a, R>,
    pub(super) shader: &'a dyn ObjectCpuShader<R>,
    /// The attributes of vertices that the process reads.
    pub(super) attributes: &'a [DeclaredAttribute],
    /// Which sides of the objects are drawn.
    pub(super) face_culling: FaceCulling,
    /// Which objects occlude what is behind them.
    pub(super) depth: DepthWrites,
    /// One job sets up the triangles of a chunk.
    pub(super) chunks: &'a [Vec<TriangleRange>],
    /// An object relative to the camera.
    pub(super) object_of: &'a (dyn Fn(u32) -> Option<ShaderObject<R>> + Sync),
}

/// Chunks whose triangles are in memory at once, which bounds the memory of a frame of any size.
const CHUNKS_IN_MEMORY: usize = 256;

impl<R: Precision> ObjectPass<'_, R> {
    /// Draws it.
    ///
    /// # Errors
    /// If the CPU shader panics.
    pub(super) fn draw(&self) -> Result<(), JobPanic> {
        self.context.attachments.open(|open| {
            let has_masks = || self.chunks.iter().flatten().any(TriangleRange::is_masked);
            let draws_pixels = self.shader.draws_pixels() || self.shader.draws_masked_pixels() && has_masks();
            // Without a fragment shader no varyings are kept.
            if draws_pixels { self.draw_tiles::<VARYINGS>(open) } else { self.draw_tiles::<0>(open) }
        })
    }

    fn draw_tiles<const V: usize>(&self, open: &OpenAttachments<'_, R>) -> Result<(), JobPanic> {
        let Self { context, shader, chunks, object_of, .. } = self;
        let PassContext { executor, attachments, .. } = context;
        let sampled = open.sampled();
        let inputs = context.inputs(&sampled);
        executor.for_each(open.tiles.len(), |tile| open.tiles[tile].lock().clear(attachments.depth.as_ref()))?;
        for chunks in chunks.chunks(CHUNKS_IN_MEMORY) {
            let set_up = |chunk: usize| -> TriangleSetup<R, V> {
                let drawn = (&*chunks[chunk], self.face_culling);
                TriangleSetup::new(*shader, self.attributes, &inputs, &open.tiling, drawn, object_of)
            };
            let setups = executor.map(chunks.len(), set_up)?;
            executor.for_each(open.tiles.len(), |index| {
                let mut tile = open.tiles[index].lock();
                let bounds = tile.bounds;
                for (triangle, state) in setups.iter().flat_map(|setup| setup.of_tile(index, bounds)) {
                    self.draw_triangle(&mut tile, &inputs, triangle, state);
                }
            })?;
        }
        Ok(())
    }

    fn draw_triangle<const V: usize>(
        &self,
        tile: &mut TileAttachments<'_, R>,
        inputs: &PassInputs<'_, R>,
        triangle: &Triangle<R, V>,
        state: TriangleState,
    ) {
        let tests_equal = self.context.attachments.depth.as_ref().is_some_and(|depth| depth.tests_equal);
        let writes_depth = match self.depth {
            DepthWrites::Never => false,
            DepthWrites::WhereOpaque => state.blend == Blend::None,
            DepthWrites::Always => true,
        };
        let draws_pixels = if state.is_masked { self.shader.draws_masked_pixels() } else { self.shader.draws_pixels() };
        let colors = tile.color_count();
        let mut targets = [Vector4::zero(); MAX_COLOR_ATTACHMENTS];
        triangle.rasterize(tile.bounds, |pixel, depth| {
            // Depth is reversed: nearer is greater.
            let passes = |stored| if tests_equal { depth == stored } else { depth > stored };
            if !tile.depth(pixel).is_none_or(passes) {
                return;
            }
            if draws_pixels {
                targets = [Vector4::zero(); MAX_COLOR_ATTACHMENTS];
                let object_pixel = object_pixel(triangle, pixel, state);
                if !self.shader.fragment(inputs, &object_pixel, &mut targets[..colors]) {
                    return;
                }
                tile.draw(pixel, state.blend, &targets[..colors]);
            }
            if writes_depth {
                tile.set_depth(pixel, depth);
            }
        });
    }
}

fn object_pixel<R: Precision, const V: usize>(
    triangle: &Triangle<R, V>,
    coordinates: [usize; 2],
    state: TriangleState,
) -> ObjectPixel<R> {
    let found = triangle.interpolate(coordinates);
    let padded = |numbers: [R; V]| std::array::from_fn(|index| numbers.get(index).copied().unwrap_or_default());
    ObjectPixel {
        coordinates,
        varyings: padded(found.value),
        dpdx: padded(found.dpdx),
        dpdy: padded(found.dpdy),
        material: state.material,
        object: state.object,
    }
}
