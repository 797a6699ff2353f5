//! The targets that a pass draws into and samples.

use std::sync::Arc;

use parking_lot::Mutex;

use super::pixel_formats::{blended, stored};
use super::precision::Precision;
use super::target_mip_levels::MipLevel;
use super::targets::{SoftwareTarget, TargetReader, TiledTexture};
use super::tiles::{Tile, Tiling, index_in_tile};
use crate::backend::BackendError;
use crate::process::{BlendEquation, Format, SampledTexture};
use crate::raster::{PixelBounds, Vector4};
use crate::scene::Blend;

/// The targets that a pass draws into and samples.
pub(super) struct Attachments<R> {
    pub(super) colors: Vec<ColorAttachment<R>>,
    pub(super) depth: Option<DepthAttachment<R>>,
    /// In the order declared, each with its layers.
    pub(super) sampled: Vec<Vec<SoftwareTarget<R>>>,
}

/// A colour target that a pass draws into.
pub(super) struct ColorAttachment<R> {
    pub(super) target: SoftwareTarget<R>,
    /// The colour that it is cleared to first, if it is cleared.
    pub(super) clear: Option<[R; 4]>,
    /// How everything that is drawn mixes with it; `None` if materials, or the kind of draws, decide.
    pub(super) equation: Option<BlendEquation>,
}

/// The depth target that a pass tests.
pub(super) struct DepthAttachment<R> {
    pub(super) target: SoftwareTarget<R>,
    /// What it is cleared to first, if it is cleared.
    pub(super) clear: Option<R>,
    /// Whether the pass may write it; a draw may still not write it.
    pub(super) is_writable: bool,
    /// Whether only pixels whose depth equals the stored depth are drawn.
    pub(super) tests_equal: bool,
}

/// The most colour targets of a pass.
pub(super) const MAX_COLOR_ATTACHMENTS: usize = 8;

impl<R: Precision> Attachments<R> {
    /// Checks whether a pass can have these attachments.
    ///
    /// # Errors
    /// If there are too many colour targets, or a target that is written is used twice.
    pub(super) fn check(&self, label: &str) -> Result<(), BackendError> {
        let refused = |message: &str| BackendError::Validation { label: label.to_owned(), message: message.to_owned() };
        if self.colors.len() > MAX_COLOR_ATTACHMENTS {
            return Err(refused("a pass draws into 8 colour targets at most"));
        }
        let depth = self.depth.as_ref();
        let colors = self.colors.iter().map(|color| &color.target);
        let written: Vec<_> =
            colors.chain(depth.filter(|depth| depth.is_writable).map(|depth| &depth.target)).collect();
        let is_same = |one: &SoftwareTarget<R>, other: &SoftwareTarget<R>| Arc::ptr_eq(&one.texture, &other.texture);
        let repeats =
            |(index, target): (usize, &&SoftwareTarget<R>)| written[..index].iter().any(|other| is_same(target, other));
        let reads = |target: &&SoftwareTarget<R>| self.sampled.iter().flatten().any(|other| is_same(target, other));
        if written.iter().enumerate().any(repeats) || written.iter().any(reads) {
            return Err(refused("a target that is drawn into is used twice"));
        }
        Ok(())
    }

    /// The tiles of the picture that the pass draws; none for a pass without a target.
    fn tiling(&self) -> Tiling {
        let depth = self.depth.iter().map(|depth| &depth.target);
        let mut targets = self.colors.iter().map(|color| &color.target).chain(depth);
        targets.next().map_or(Tiling::new([0, 0]), |target| target.texture.tiling)
    }

    /// Locks the targets while `work` runs, and hands it their tiles.
    pub(super) fn open<T>(&self, work: impl FnOnce(&OpenAttachments<'_, R>) -> T) -> T {
        let mut colors: Vec<_> = self.colors.iter().map(|color| color.target.texture.tiles.write()).collect();
        let writable = self.depth.as_ref().filter(|depth| depth.is_writable);
        let mut writable = writable.map(|depth| depth.target.texture.tiles.write());
        let tested = self.depth.as_ref().filter(|depth| !depth.is_writable).map(|depth| &depth.target);
        // A pass may test and sample the same depth target: it is locked once.
        let mut read: Vec<(&Arc<TiledTexture<R>>, _, _)> = Vec::new();
        for SoftwareTarget { texture, .. } in tested.into_iter().chain(self.sampled.iter().flatten()) {
            if !read.iter().any(|(other, ..)| Arc::ptr_eq(other, texture)) {
                read.push((texture, texture.tiles.read(), texture.mip_levels.read()));
            }
        }
        let pixels_of = |target: &SoftwareTarget<R>| -> (&[Tile<R>], &[MipLevel<R>]) {
            let found = read.iter().find(|(texture, ..)| Arc::ptr_eq(texture, &target.texture));
            found.map_or((&[], &[]), |(_, tiles, mip_levels)| (tiles, mip_levels))
        };

        let tiling = self.tiling();
        let mut color_tiles: Vec<_> =
            colors.iter_mut().zip(&self.colors).map(|(tiles, color)| tiles[color.target.tiles()].iter_mut()).collect();
        let depth_range = self.depth.as_ref().map_or(0..0, |depth| depth.target.tiles());
        let mut depth_tiles = writable.as_mut().map(|tiles| tiles[depth_range.clone()].iter_mut());
        let mut tested_tiles = tested.map(|target| pixels_of(target).0[depth_range].iter());
        let tiles = (0..tiling.count()).map(|tile| {
            let depth = match (&mut depth_tiles, &mut tested_tiles) {
                (Some(tiles), _) => tiles.next().map(|tile| TileDepth::Written(tile.numbers_mut())),
                (None, Some(tiles)) => tiles.next().map(|tile| TileDepth::Tested(tile.numbers())),
                (None, None) => None,
            };
            Mutex::new(TileAttachments {
                bounds: tiling.bounds(tile),
                colors: color_tiles.iter_mut().filter_map(Iterator::next).map(|tile| tile.numbers_mut()).collect(),
                color_attachments: &self.colors,
                depth,
            })
        });
        let tiles = tiles.collect();
        let reader = |layers: &Vec<SoftwareTarget<R>>| {
            let layer = |target: &SoftwareTarget<R>| {
                let (tiles, mip_levels) = pixels_of(target);
                target.layer_reader(tiles, mip_levels)
            };
            TargetReader::new(layers.iter().map(layer).collect())
        };
        let sampled = self.sampled.iter().map(reader).collect();
        work(&OpenAttachments { tiling, tiles, sampled })
    }
}

/// The attachments of a pass while they are locked.
pub(super) struct OpenAttachments<'a, R> {
    pub(super) tiling: Tiling,
    /// Each is locked by the job that draws it.
    pub(super) tiles: Vec<Mutex<TileAttachments<'a, R>>>,
    sampled: Vec<TargetReader<'a, R>>,
}

impl<R: Precision> OpenAttachments<'_, R> {
    /// What CPU shaders read.
    pub(super) fn sampled(&self) -> Vec<&dyn SampledTexture<R>> {
        self.sampled.iter().map(|target| target as &dyn SampledTexture<R>).collect()
    }
}

/// One tile of a pass's attachments.
pub(super) struct TileAttachments<'a, R> {
    pub(super) bounds: PixelBounds,
    colors: Vec<&'a mut [R]>,
    color_attachments: &'a [ColorAttachment<R>],
    depth: Option<TileDepth<'a, R>>,
}

enum TileDepth<'a, R> {
    Tested(&'a [R]),
    Written(&'a mut [R]),
}

impl<R: Precision> TileAttachments<'_, R> {
    /// Clears the targets that the pass clears.
    pub(super) fn clear(&mut self, depth: Option<&DepthAttachment<R>>) {
        for (numbers, color) in self.colors.iter_mut().zip(self.color_attachments) {
            let Some(clear) = color.clear else { continue };
            let format = color.target.texture.planned.format;
            let clear = stored(format, clear);
            for pixel in numbers.chunks_exact_mut(format.channels()) {
                pixel.copy_from_slice(&clear[..pixel.len()]);
            }
        }
        let clear = depth.and_then(|depth| depth.clear);
        if let (Some(TileDepth::Written(numbers)), Some(clear)) = (&mut self.depth, clear) {
            numbers.fill(clear);
        }
    }

    /// The stored depth at a pixel of the tile; `None` if the pass has no depth target.
    #[inline]
    pub(super) fn depth(&self, pixel: [usize; 2]) -> Option<R> {
        match &self.depth {
            None => None,
            Some(TileDepth::Tested(numbers)) => Some(numbers[index_in_tile(pixel)]),
            Some(TileDepth::Written(numbers)) => Some(numbers[index_in_tile(pixel)]),
        }
    }

    /// Stores depth if the pass may write it.
    #[inline]
    pub(super) fn set_depth(&mut self, pixel: [usize; 2], depth: R) {
        if let Some(TileDepth::Written(numbers)) = &mut self.depth {
            numbers[index_in_tile(pixel)] = depth;
        }
    }

    /// Draws a pixel of the tile into the colour targets. `blend` applies to those without a blend equation.
    #[inline]
    pub(super) fn draw(&mut self, pixel: [usize; 2], blend: Blend, colors: &[Vector4<R>]) {
        for ((numbers, target), &color) in self.colors.iter_mut().zip(self.color_attachments).zip(colors) {
            let format = target.target.texture.planned.format;
            let channels = format.channels();
            let stored = &mut numbers[index_in_tile(pixel) * channels..][..channels];
            let equation = target.equation.unwrap_or_else(|| blend.into());
            let color = blend_into(format, equation, color, stored);
            // A loop: a call to copy that few numbers takes longer.
            stored.iter_mut().zip(color).for_each(|(number, color)| *number = color);
        }
    }

    /// The number of colour targets.
    pub(super) fn color_count(&self) -> usize {
        self.colors.len()
    }
}

fn blend_into<R: Precision>(format: Format, equation: BlendEquation, color: Vector4<R>, destination: &[R]) -> [R; 4] {
    if equation == BlendEquation::REPLACE {
        return stored(format, color.0);
    }
    let mut whole = [R::zero(), R::zero(), R::zero(), R::one()];
    whole.iter_mut().zip(destination).for_each(|(number, destination)| *number = *destination);
    blended(format, equation, color, whole)
}
