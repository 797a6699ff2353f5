//! The targets of a frame's views.

use std::ops::Range;
use std::sync::Arc;

use parking_lot::RwLock;

use super::executor::Executor;
use super::pixel_formats::append_bytes;
use super::precision::Precision;
use super::submission::ReadTargets;
use super::target_mip_levels::{MipLevel, generate};
use super::tiles::{Tile, Tiling};
use crate::backend::{BackendError, Picture};
use crate::process::{Access, FramePlan, PlannedTarget, SampledTexture};
use crate::raster::{Real, Vector, Vector4};
use crate::task::JobPanic;
use crate::view::{PerView, RenderView};

/// The greatest width and height of a picture, in pixels.
pub(super) const MAX_PICTURE_SIZE: u32 = 16_384;

/// A target's pixels, in tiles: of one view, or, in layers, of all views of a kind.
pub(super) struct TiledTexture<R> {
    pub(super) planned: PlannedTarget,
    pub(super) tiling: Tiling,
    layers: usize,
    /// Layer after layer.
    pub(super) tiles: RwLock<Vec<Tile<R>>>,
    /// Its mip levels from level 1 on, of a target that has some, and so has one layer.
    pub(super) mip_levels: RwLock<Vec<MipLevel<R>>>,
}

/// A target of one view: a layer of a texture.
pub(super) struct SoftwareTarget<R> {
    pub(super) texture: Arc<TiledTexture<R>>,
    pub(super) layer: usize,
}

impl<R> Clone for SoftwareTarget<R> {
    fn clone(&self) -> Self {
        Self { texture: Arc::clone(&self.texture), layer: self.layer }
    }
}

/// The targets of one frame.
pub(super) struct SoftwareTargets<R> {
    /// Of each view its own targets, and its layers of shared ones: each with its index among the plan's, in ascending
    /// order.
    views: PerView<Vec<(usize, SoftwareTarget<R>)>>,
    /// The targets that all views of a kind share, by their indices among the plan's.
    layered: Vec<Option<Arc<TiledTexture<R>>>>,
    /// See [`FramePlan::histories`].
    histories: Vec<(usize, usize)>,
    /// For passes that sample a view that the frame does not have: a pixel of zeros for each format.
    placeholder: Vec<Arc<TiledTexture<R>>>,
}

impl<R> Default for SoftwareTargets<R> {
    fn default() -> Self {
        Self { views: PerView::default(), layered: Vec::new(), histories: Vec::new(), placeholder: Vec::new() }
    }
}

impl<R> SoftwareTargets<R> {
    /// A view's target by its name.
    ///
    /// # Errors
    /// If the view has no such target: the error lists those that it has.
    pub(super) fn find(&self, view: usize, name: &str) -> Result<&SoftwareTarget<R>, BackendError> {
        let targets = self.views.get(view).map_or(&[][..], |targets| targets);
        let names = targets.iter().map(|(_, target)| target.texture.planned.name.as_str());
        find(targets, name).ok_or_else(|| BackendError::unknown_target(view, name, names))
    }

    /// A view's target by its index among the plan's; `None` if views of another kind have it.
    pub(super) fn get(&self, view: usize, index: usize) -> Option<&SoftwareTarget<R>> {
        let targets = self.views.get(view)?;
        targets.binary_search_by_key(&index, |(index, _)| *index).ok().map(|position| &targets[position].1)
    }

    /// Copies what processes of later frames read of the views that this one draws.
    pub(super) fn copy_histories(&self, is_drawn: impl Fn(usize) -> bool)
    where
        R: Precision,
    {
        for (view, _) in self.views.iter().enumerate().filter(|(view, _)| is_drawn(*view)) {
            for &(copy, source) in &self.histories {
                let Some((copy, source)) = self.get(view, copy).zip(self.get(view, source)) else { continue };
                let (copy, source) = (&copy.texture, &source.texture);
                let (mut copied, tiles) = (copy.tiles.write(), source.tiles.read());
                copied.iter_mut().zip(&*tiles).for_each(|(copy, tile)| copy.clone_from(tile));
                copy.mip_levels.write().clone_from(&source.mip_levels.read());
            }
        }
    }

    /// A pixel of zeros in place of a target of a view that the frame does not have.
    pub(super) fn find_placeholder(&self, planned: &PlannedTarget) -> Option<SoftwareTarget<R>> {
        let found = self.placeholder.iter().find(|placeholder| placeholder.planned.format == planned.format);
        found.map(|texture| SoftwareTarget { texture: Arc::clone(texture), layer: 0 })
    }

    /// The layers of a target that all views of a kind share, by its index among the plan's.
    pub(super) fn layers(&self, index: usize) -> Option<Vec<SoftwareTarget<R>>> {
        let found = self.layered.get(index)?.as_ref()?;
        Some((0..found.layers).map(|layer| SoftwareTarget { texture: Arc::clone(found), layer }).collect())
    }
}

/// Keeps targets over frames, and replaces those whose size or plan changes. Targets that no frame needs any more are
/// dropped.
pub(super) struct TargetCache<R> {
    current: Arc<SoftwareTargets<R>>,
    /// Whether the histories of the next frame are empty.
    forgets_histories: bool,
}

impl<R> Default for TargetCache<R> {
    fn default() -> Self {
        Self { current: Arc::default(), forgets_histories: false }
    }
}

impl<R: Precision> TargetCache<R> {
    /// Makes the histories of the next frame empty.
    pub(super) fn forget_histories(&mut self) {
        self.forgets_histories = true;
    }

    /// The targets of a frame of these views.
    ///
    /// # Errors
    /// If a picture is too large, or there is no memory for it.
    pub(super) fn update(
        &mut self,
        plan: &FramePlan,
        views: &[RenderView],
    ) -> Result<Arc<SoftwareTargets<R>>, BackendError> {
        let mut next = SoftwareTargets { histories: plan.histories().collect(), ..SoftwareTargets::default() };
        for planned in plan.targets() {
            if !planned.layered {
                next.layered.push(None);
                continue;
            }
            let mut sharing = views.iter().filter(|view| view.kind() == planned.views);
            // Without a view there is still a texture to read: one pixel in which nothing was drawn.
            let size = sharing.clone().next().map_or([1, 1], |view| view.camera.size);
            let layers = sharing.by_ref().count().max(1);
            let has_layers = |kept: &&Arc<TiledTexture<R>>| (layers..=2 * layers).contains(&kept.layers);
            let mut kept = self.current.layered.iter().flatten().filter(|kept| kept.is_for(planned, size));
            let texture = match kept.find(has_layers) {
                Some(kept) => Arc::clone(kept),
                None => Arc::new(TiledTexture::new(planned, size, layers)?),
            };
            next.layered.push(Some(texture));
        }
        let mut of_views = Vec::with_capacity(views.len());
        for view in views {
            let kept_targets = self.current.views.kept(view);
            let mut targets = Vec::new();
            let of_kind = plan.targets().iter().enumerate().filter(|(_, planned)| planned.views == view.kind());
            for (index, planned) in of_kind {
                if let Some(texture) = &next.layered[index] {
                    targets.push((index, SoftwareTarget { texture: Arc::clone(texture), layer: view.layer as usize }));
                    continue;
                }
                let size = planned.size.in_view(view.camera.size);
                // Another view has no part in this one's history.
                let keeps_history = |is_same: bool| is_same && !self.forgets_histories;
                let kept = kept_targets.filter(|(_, is_same)| planned.copy_of.is_none() || keeps_history(*is_same));
                let kept = kept.and_then(|(targets, _)| find(targets, &planned.name));
                let texture = match kept.filter(|kept| kept.texture.is_for(planned, size)) {
                    Some(kept) => Arc::clone(&kept.texture),
                    None => Arc::new(TiledTexture::new(planned, size, 1)?),
                };
                targets.push((index, SoftwareTarget { texture, layer: 0 }));
            }
            of_views.push(targets);
        }
        next.views = PerView::new(views, of_views);
        for &(target, access) in plan.processes().iter().flat_map(|process| &process.targets.accesses) {
            let planned = &plan.targets()[target];
            if matches!(access, Access::SampleView(..) | Access::SampleViewPrevious(..))
                && next.find_placeholder(planned).is_none()
            {
                let placeholder = match self.current.find_placeholder(planned) {
                    Some(kept) => kept.texture,
                    None => Arc::new(TiledTexture::new(planned, [1, 1], 1)?),
                };
                next.placeholder.push(placeholder);
            }
        }
        self.forgets_histories = false;
        self.current = Arc::new(next);
        Ok(Arc::clone(&self.current))
    }
}

/// The one of a view's targets that has this name.
fn find<'a, R>(targets: &'a [(usize, SoftwareTarget<R>)], name: &str) -> Option<&'a SoftwareTarget<R>> {
    targets.iter().map(|(_, target)| target).find(|target| target.texture.planned.name == name)
}

impl<R: Precision> TiledTexture<R> {
    fn new(planned: &PlannedTarget, size: [u32; 2], layers: usize) -> Result<Self, BackendError> {
        let [width, height] = size;
        if width.max(height) > MAX_PICTURE_SIZE {
            let target = planned.name.clone();
            return Err(BackendError::TargetTooLarge { target, width, height, allowed: MAX_PICTURE_SIZE });
        }
        let tiling = Tiling::new(size.map(|pixels| pixels as usize));
        let out_of_memory = || BackendError::OutOfMemory { label: format!("the target {:?}", planned.name) };
        let count = tiling.count().checked_mul(layers).ok_or_else(out_of_memory)?;
        let mut tiles = Vec::new();
        tiles.try_reserve_exact(count).map_err(|_| out_of_memory())?;
        for _ in 0..count {
            tiles.push(Tile::new(planned.format.channels()).ok_or_else(out_of_memory)?);
        }
        let mip_levels = if planned.mipmapped {
            MipLevel::chain(size, planned.format.channels()).ok_or_else(out_of_memory)?
        } else {
            Vec::new()
        };
        let (tiles, mip_levels) = (RwLock::new(tiles), RwLock::new(mip_levels));
        Ok(Self { planned: planned.clone(), tiling, layers, tiles, mip_levels })
    }

    /// Generates its mip levels from level 0.
    ///
    /// # Errors
    /// If a job panics. This is a bug in Drawloom.
    pub(super) fn generate_mip_levels(&self, executor: &Executor) -> Result<(), JobPanic> {
        generate(executor, self.planned.format, (self.tiling, &self.tiles.read()), &mut self.mip_levels.write())
    }

    fn is_for(&self, planned: &PlannedTarget, size: [u32; 2]) -> bool {
        self.planned == *planned && self.tiling.size() == size.map(|pixels| pixels as usize)
    }
}

impl<R: Precision> SoftwareTarget<R> {
    /// The range of its tiles among those of the texture.
    pub(super) fn tiles(&self) -> Range<usize> {
        let count = self.texture.tiling.count();
        self.layer * count..(self.layer + 1) * count
    }

    /// Its pixels in its format, as a device has them in memory.
    pub(super) fn picture(&self) -> Picture {
        let (format, size) = (self.texture.planned.format, self.texture.tiling.size());
        let mut bytes = Vec::with_capacity(size[0] * size[1] * format.bytes());
        self.visit(|pixel| append_bytes(format, pixel.0, &mut bytes));
        Picture { width: size[0] as u32, height: size[1] as u32, format, bytes }
    }

    /// Its stored pixels, rows from top to bottom.
    pub(super) fn numbers(&self) -> Vec<[f64; 4]> {
        let mut numbers = Vec::new();
        self.visit(|pixel| numbers.push(pixel.0.map(Real::as_f64)));
        numbers
    }

    fn visit(&self, mut visit: impl FnMut(Vector4<R>)) {
        // No deadlock: a writer of these tiles waits for no reader.
        let tiles = self.texture.tiles.read();
        let sampled = TargetReader::new(vec![self.layer_reader(&tiles, &[])]);
        let [width, height] = self.texture.tiling.size();
        for y in 0..height {
            (0..width).for_each(|x| visit(sampled.load([x, y], 0)));
        }
    }

    /// What CPU shaders read, as one layer. `tiles` and `mip_levels` are those of the texture.
    pub(super) fn layer_reader<'a>(&self, tiles: &'a [Tile<R>], mip_levels: &'a [MipLevel<R>]) -> LayerReader<'a, R> {
        let TiledTexture { planned, tiling, .. } = &*self.texture;
        LayerReader { tiles: &tiles[self.tiles()], mip_levels, tiling: *tiling, channels: planned.format.channels() }
    }
}

/// A layer of a target that a CPU shader samples.
pub(super) struct LayerReader<'a, R> {
    tiles: &'a [Tile<R>],
    /// From level 1 on.
    mip_levels: &'a [MipLevel<R>],
    tiling: Tiling,
    channels: usize,
}

/// A target that a CPU shader samples.
pub(super) struct TargetReader<'a, R> {
    layers: Vec<LayerReader<'a, R>>,
    size: [usize; 2],
    level_count: usize,
}

impl<'a, R> TargetReader<'a, R> {
    /// The reader of these layers, at least one. Those of views that the frame does not have are pixels of zeros; all
    /// others have one size.
    pub(super) fn new(layers: Vec<LayerReader<'a, R>>) -> Self {
        let larger = |one: [usize; 2], other: [usize; 2]| [one[0].max(other[0]), one[1].max(other[1])];
        let size = layers.iter().map(|layer| layer.tiling.size()).fold([1, 1], larger);
        let level_count = layers.iter().map(|layer| 1 + layer.mip_levels.len()).max().unwrap_or(1);
        Self { layers, size, level_count }
    }
}

impl<R: Precision> SampledTexture<R> for TargetReader<'_, R> {
    fn size(&self) -> [usize; 2] {
        self.size
    }

    fn load(&self, coordinates: [usize; 2], layer: usize) -> Vector4<R> {
        let LayerReader { tiles, tiling, channels, .. } = &self.layers[layer.min(self.layers.len() - 1)];
        let (tile, pixel) = tiling.find(if tiling.size() == self.size { coordinates } else { [0, 0] });
        four_channels(tiles[tile].pixel(pixel, *channels))
    }

    fn level_count(&self) -> usize {
        self.level_count
    }

    fn load_level(&self, coordinates: [usize; 2], layer: usize, level: usize) -> Vector4<R> {
        let LayerReader { mip_levels, channels, .. } = &self.layers[layer.min(self.layers.len() - 1)];
        // A view that the frame does not have has level 0 only.
        match level.checked_sub(1).and_then(|level| mip_levels.get(level)) {
            Some(level) => four_channels(level.pixel(coordinates, *channels)),
            None => self.load(coordinates, layer),
        }
    }
}

/// Channels that the format lacks are those of opaque black.
fn four_channels<R: Precision>(pixel: &[R]) -> Vector4<R> {
    let (zero, one) = (R::zero(), R::one());
    Vector(match *pixel {
        [red] => [red, zero, zero, one],
        [red, green] => [red, green, zero, one],
        [red, green, blue] => [red, green, blue, one],
        [red, green, blue, alpha, ..] => [red, green, blue, alpha],
        [] => [zero, zero, zero, one],
    })
}

impl<R: Precision> ReadTargets for SoftwareTargets<R> {
    fn picture(&self, view: usize, target: &str) -> Result<Picture, BackendError> {
        self.find(view, target).map(|target| target.picture())
    }

    fn numbers(&self, view: usize, target: &str) -> Result<Vec<[f64; 4]>, BackendError> {
        self.find(view, target).map(|target| target.numbers())
    }
}
