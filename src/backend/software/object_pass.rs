//! A pass that draws objects.

use super::number::Number;
use super::pass::{DrawingPass, MOST_COLORS, OpenPass, OpenTile};
use super::pieces::{Face, Run, SetUp};
use crate::process::{ObjectPixel, ObjectTwin, ObjectValues, PassValues, VARYINGS};
use crate::raster::{Triangle, Vector4};
use crate::scene::Blend;
use crate::task::JobPanic;

/// A pass that draws objects.
pub(super) struct ObjectPass<'a, R: Number> {
    pub(super) drawing: DrawingPass<'a, R>,
    pub(super) twin: &'a dyn ObjectTwin<R>,
    /// Whether what is drawn hides what comes behind it.
    pub(super) writes_depth: bool,
    /// Each drawn by one job before its pixels are.
    pub(super) pieces: &'a [Vec<Run>],
    /// An object relative to the camera.
    pub(super) object_of: &'a (dyn Fn(u32) -> Option<ObjectValues<R>> + Sync),
}

/// Pieces whose triangles are held at once: a frame of any size takes no more memory than these.
const AT_ONCE: usize = 256;

impl<R: Number> ObjectPass<'_, R> {
    /// Draws it.
    ///
    /// # Errors
    /// If the twin panics.
    pub(super) fn run(&self) -> Result<(), JobPanic> {
        self.drawing.attachments.open(|open| {
            // What is not interpolated need not be kept.
            if self.twin.draws_pixels() { self.draw::<VARYINGS>(open) } else { self.draw::<0>(open) }
        })
    }

    fn draw<const V: usize>(&self, open: &OpenPass<'_, R>) -> Result<(), JobPanic> {
        let Self { drawing, twin, pieces, object_of, .. } = self;
        let DrawingPass { crew, view, attachments, .. } = drawing;
        let sampled = open.sampled();
        let values = drawing.values(&sampled);
        crew.each(open.tiles.len(), |tile| open.tiles[tile].lock().clear(attachments.depth.as_ref()))?;
        for pieces in pieces.chunks(AT_ONCE) {
            let set_up = |piece: usize| -> SetUp<R, V> {
                SetUp::new(*twin, &view.values, &open.tiling, &pieces[piece], object_of)
            };
            let set_up = crew.map(pieces.len(), set_up)?;
            crew.each(open.tiles.len(), |tile| {
                let mut place = open.tiles[tile].lock();
                let bounds = place.bounds;
                for (triangle, face) in set_up.iter().flat_map(|piece| piece.of_tile(tile, bounds)) {
                    self.draw_triangle(&mut place, &values, triangle, face);
                }
            })?;
        }
        Ok(())
    }

    fn draw_triangle<const V: usize>(
        &self,
        tile: &mut OpenTile<'_, R>,
        values: &PassValues<'_, R>,
        triangle: &Triangle<R, V>,
        face: Face,
    ) {
        let matches = self.drawing.attachments.depth.as_ref().is_some_and(|depth| depth.matches);
        // What mixes with what is behind it must not hide what is drawn after it.
        let writes_depth = self.writes_depth && face.blend == Blend::None;
        let (draws_pixels, colors) = (self.twin.draws_pixels(), tile.color_count());
        let mut targets = [Vector4::zero(); MOST_COLORS];
        triangle.rasterize(tile.bounds, |place, depth| {
            // Reversed: what is nearer is greater.
            let is_seen = tile.depth(place).is_none_or(|there| if matches { depth == there } else { depth > there });
            if !is_seen {
                return;
            }
            if draws_pixels {
                targets = [Vector4::zero(); MOST_COLORS];
                let pixel = pixel_of(triangle, place, face.material);
                if !self.twin.fragment(values, &pixel, &mut targets[..colors]) {
                    return;
                }
                tile.draw(place, face.blend, &targets[..colors]);
            }
            if writes_depth {
                tile.set_depth(place, depth);
            }
        });
    }
}

fn pixel_of<R: Number, const V: usize>(triangle: &Triangle<R, V>, place: [usize; 2], material: u32) -> ObjectPixel<R> {
    let found = triangle.interpolate(place);
    let all = |numbers: [R; V]| std::array::from_fn(|index| numbers.get(index).copied().unwrap_or_default());
    ObjectPixel { place, varyings: all(found.value), across: all(found.dpdx), down: all(found.dpdy), material }
}
