//! A pass that is being drawn: its targets, opened for reading and writing.

use std::sync::Arc;

use parking_lot::Mutex;

use super::crew::Crew;
use super::formats::{mixed, stored};
use super::frame::ViewState;
use super::number::Number;
use super::targets::{SampledTarget, Target, Texture};
use super::tiles::{Tile, Tiling, place_in_tile};
use crate::backend::BackendError;
use crate::process::{Format, Materials, PassValues, Sampled};
use crate::raster::{PixelBounds, Vector4};
use crate::scene::Blend;

/// A pass that is about to be drawn.
pub(super) struct DrawingPass<'a, R: Number> {
    pub(super) crew: &'a Crew,
    pub(super) view: &'a ViewState<R>,
    pub(super) materials: &'a dyn Materials<R>,
    pub(super) attachments: &'a Attachments<R>,
}

impl<R: Number> DrawingPass<'_, R> {
    /// What its twin reads.
    pub(super) fn values<'a>(&'a self, sampled: &'a [&'a dyn Sampled<R>]) -> PassValues<'a, R> {
        let ViewState { values, lights, .. } = self.view;
        PassValues { view: values, lights, materials: self.materials, sampled }
    }
}

/// What a pass draws into and reads from.
pub(super) struct Attachments<R> {
    pub(super) colors: Vec<ColorTarget<R>>,
    pub(super) depth: Option<DepthTarget<R>>,
    /// In the order declared.
    pub(super) sampled: Vec<Target<R>>,
}

/// A colour target.
pub(super) struct ColorTarget<R> {
    pub(super) target: Target<R>,
    /// What it is cleared to first.
    pub(super) clear: Option<[R; 4]>,
}

/// The depth target.
pub(super) struct DepthTarget<R> {
    pub(super) target: Target<R>,
    /// Whether it is cleared first, to infinitely far away.
    pub(super) clears: bool,
    /// Whether the pass may write it at all; a draw may still leave it alone.
    pub(super) is_writable: bool,
    /// Whether only what has just the depth that is there is drawn.
    pub(super) matches: bool,
}

/// No pass has more colour targets.
pub(super) const MOST_COLORS: usize = 8;

impl<R: Number> Attachments<R> {
    /// Whether a pass can have them.
    ///
    /// # Errors
    /// If it has too many, or uses one target twice and writes it.
    pub(super) fn check(&self, label: &str) -> Result<(), BackendError> {
        let refused = |message: &str| BackendError::Validation { label: label.to_owned(), message: message.to_owned() };
        if self.colors.len() > MOST_COLORS {
            return Err(refused("a pass draws into 8 colour targets at most"));
        }
        let depth = self.depth.as_ref();
        let colors = self.colors.iter().map(|color| &color.target);
        let written: Vec<_> =
            colors.chain(depth.filter(|depth| depth.is_writable).map(|depth| &depth.target)).collect();
        let is = |one: &Target<R>, other: &Target<R>| Arc::ptr_eq(&one.texture, &other.texture);
        let repeats = |(place, target): (usize, &&Target<R>)| written[..place].iter().any(|other| is(target, other));
        let reads = |target: &&Target<R>| self.sampled.iter().any(|other| is(target, other));
        if written.iter().enumerate().any(repeats) || written.iter().any(reads) {
            return Err(refused("a target that is drawn into is used twice"));
        }
        Ok(())
    }

    /// The squares of the picture that the pass draws; none for a pass without a target.
    fn tiling(&self) -> Tiling {
        let depth = self.depth.iter().map(|depth| &depth.target);
        let mut targets = self.colors.iter().map(|color| &color.target).chain(depth);
        targets.next().map_or(Tiling::new([0, 0]), |target| target.texture.tiling)
    }

    /// Opens the targets for as long as `work` takes.
    pub(super) fn open<T>(&self, work: impl FnOnce(&OpenPass<'_, R>) -> T) -> T {
        let mut colors: Vec<_> = self.colors.iter().map(|color| color.target.texture.tiles.write()).collect();
        let writable = self.depth.as_ref().filter(|depth| depth.is_writable);
        let mut writable = writable.map(|depth| depth.target.texture.tiles.write());
        let tested = self.depth.as_ref().filter(|depth| !depth.is_writable).map(|depth| &depth.target);
        // Depth may be tested and sampled at once, and is to be locked once.
        let mut read: Vec<(&Arc<Texture<R>>, _)> = Vec::new();
        for Target { texture, .. } in tested.into_iter().chain(&self.sampled) {
            if !read.iter().any(|(other, _)| Arc::ptr_eq(other, texture)) {
                read.push((texture, texture.tiles.read()));
            }
        }
        let tiles_of = |target: &Target<R>| -> &[Tile<R>] {
            let found = read.iter().find(|(texture, _)| Arc::ptr_eq(texture, &target.texture));
            found.map_or(&[], |(_, tiles)| tiles)
        };

        let tiling = self.tiling();
        let mut color_tiles: Vec<_> =
            colors.iter_mut().zip(&self.colors).map(|(tiles, color)| tiles[color.target.tiles()].iter_mut()).collect();
        let depth_range = self.depth.as_ref().map_or(0..0, |depth| depth.target.tiles());
        let mut depth_tiles = writable.as_mut().map(|tiles| tiles[depth_range.clone()].iter_mut());
        let mut tested_tiles = tested.map(|target| tiles_of(target)[depth_range].iter());
        let tiles = (0..tiling.count()).map(|tile| {
            let depth = match (&mut depth_tiles, &mut tested_tiles) {
                (Some(tiles), _) => tiles.next().map(|tile| TileDepth::Written(tile.numbers_mut())),
                (None, Some(tiles)) => tiles.next().map(|tile| TileDepth::Tested(tile.numbers())),
                (None, None) => None,
            };
            Mutex::new(OpenTile {
                bounds: tiling.bounds(tile),
                colors: color_tiles.iter_mut().filter_map(Iterator::next).map(|tile| tile.numbers_mut()).collect(),
                formats: &self.colors,
                depth,
            })
        });
        let tiles = tiles.collect();
        let sampled = self.sampled.iter().map(|target| target.sampled(tiles_of(target))).collect();
        work(&OpenPass { tiling, tiles, sampled })
    }
}

/// A pass whose targets are open.
pub(super) struct OpenPass<'a, R> {
    pub(super) tiling: Tiling,
    /// Each is locked once a round, by the job that draws it.
    pub(super) tiles: Vec<Mutex<OpenTile<'a, R>>>,
    sampled: Vec<SampledTarget<'a, R>>,
}

impl<R: Number> OpenPass<'_, R> {
    /// What twins read.
    pub(super) fn sampled(&self) -> Vec<&dyn Sampled<R>> {
        self.sampled.iter().map(|target| target as &dyn Sampled<R>).collect()
    }
}

/// A square of a pass.
pub(super) struct OpenTile<'a, R> {
    pub(super) bounds: PixelBounds,
    colors: Vec<&'a mut [R]>,
    formats: &'a [ColorTarget<R>],
    depth: Option<TileDepth<'a, R>>,
}

enum TileDepth<'a, R> {
    Tested(&'a [R]),
    Written(&'a mut [R]),
}

impl<R: Number> OpenTile<'_, R> {
    /// Clears what the pass clears.
    pub(super) fn clear(&mut self, depth: Option<&DepthTarget<R>>) {
        for (numbers, color) in self.colors.iter_mut().zip(self.formats) {
            let Some(clear) = color.clear else { continue };
            let format = color.target.texture.planned.format;
            let clear = stored(format, clear);
            for pixel in numbers.chunks_exact_mut(format.channels()) {
                pixel.copy_from_slice(&clear[..pixel.len()]);
            }
        }
        if let (Some(TileDepth::Written(numbers)), true) = (&mut self.depth, depth.is_some_and(|depth| depth.clears)) {
            numbers.fill(R::zero());
        }
    }

    /// The depth at a pixel of the square; `None` where the pass has no depth target.
    #[inline]
    pub(super) fn depth(&self, place: [usize; 2]) -> Option<R> {
        match &self.depth {
            None => None,
            Some(TileDepth::Tested(numbers)) => Some(numbers[place_in_tile(place)]),
            Some(TileDepth::Written(numbers)) => Some(numbers[place_in_tile(place)]),
        }
    }

    /// Stores depth, where the pass may write it.
    #[inline]
    pub(super) fn set_depth(&mut self, place: [usize; 2], depth: R) {
        if let Some(TileDepth::Written(numbers)) = &mut self.depth {
            numbers[place_in_tile(place)] = depth;
        }
    }

    /// Draws a pixel of the square into the colour targets.
    #[inline]
    pub(super) fn draw(&mut self, place: [usize; 2], blend: Blend, colors: &[Vector4<R>]) {
        for ((numbers, target), &color) in self.colors.iter_mut().zip(self.formats).zip(colors) {
            let format = target.target.texture.planned.format;
            let channels = format.channels();
            let pixel = &mut numbers[place_in_tile(place) * channels..][..channels];
            let color = over(format, blend, color, pixel);
            // A loop: to call for so few numbers to be copied takes longer.
            pixel.iter_mut().zip(color).for_each(|(number, color)| *number = color);
        }
    }

    /// How many colour targets there are.
    pub(super) fn color_count(&self) -> usize {
        self.colors.len()
    }
}

fn over<R: Number>(format: Format, blend: Blend, color: Vector4<R>, there: &[R]) -> [R; 4] {
    if blend == Blend::None {
        return stored(format, color.0);
    }
    let mut whole = [R::zero(), R::zero(), R::zero(), R::one()];
    whole.iter_mut().zip(there).for_each(|(number, there)| *number = *there);
    mixed(format, blend, color, whole)
}
