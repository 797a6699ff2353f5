//! The cache of the views' targets.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use super::imported_target::ResolvedImport;
use super::placeholder_targets::PlaceholderTargets;
use super::small_targets::{SmallTarget, SmallTargets};
use super::target_mip_levels::{MipGenerator, MipPipelines};
use super::target_texture::{TextureKind, new_texture, new_views, texture_bytes};
use super::transient_targets::{TransientTargets, uses_transient};
use super::view_array::{ViewArrayTexture, layer_descriptor};
use crate::backend::error::broken_rule;
use crate::backend::{BackendError, FrameRequest, TargetMemory};
use crate::process::{Format, Pass, PlannedTarget, SampledShape, SampledViews};
use crate::view::{PerView, RenderView, ViewId};

/// The targets of one frame.
#[derive(Clone, Default)]
pub(crate) struct WgpuTargets {
    /// For each view its own targets, and its layers of the shared ones: each with its index among the plan's, in
    /// ascending order. A frame may have thousands of views, so a view has no entries for targets of other kinds.
    views: PerView<Vec<(usize, ViewTarget)>>,
    /// The targets that all views of a kind share, by their indices among the plan's.
    layered: Vec<Option<LayeredTarget>>,
    /// See [`FramePlan::histories`](crate::process::FramePlan::histories).
    histories: Vec<(usize, usize)>,
    /// Those that transient targets share.
    transient: Vec<TransientSlot>,
    /// Those whose layers are targets of several views.
    arrays: Vec<ViewArrayTexture>,
    small: SmallTargets,
    memory: TargetMemory,
    /// For passes that sample views that the frame does not have.
    placeholders: PlaceholderTargets,
}

/// A target as one view draws into it.
#[derive(Clone)]
pub(crate) struct ViewTarget {
    planned: Arc<PlannedTarget>,
    pub(crate) texture: wgpu::Texture,
    /// Of the view's layer only, and of mip level 0.
    pub(crate) view: wgpu::TextureView,
    /// The same as shaders sample it: depth without the stencil, and all mip levels.
    pub(crate) sampled: wgpu::TextureView,
    pub(crate) layer: u32,
    /// For a target with mip levels that processes write.
    mip_levels: Option<Arc<MipGenerator>>,
    storage: TargetStorage,
}

/// Whose texture a target has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TargetStorage {
    /// Its own.
    Own,
    /// One that other targets of the frame may have too.
    Transient,
    /// A layer of a texture array.
    Layer,
}

/// A texture that transient targets share.
#[derive(Clone)]
struct TransientSlot {
    kind: TextureKind,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    sampled: wgpu::TextureView,
    mip_levels: Option<Arc<MipGenerator>>,
}

/// A texture array in which each view of a kind has a layer.
#[derive(Clone)]
struct LayeredTarget {
    planned: Arc<PlannedTarget>,
    texture: wgpu::Texture,
    array: wgpu::TextureView,
}

impl ViewTarget {
    pub(crate) fn format(&self) -> Format {
        self.planned.format
    }

    /// What generates its mip levels; `None` if it has none, or they are copied.
    pub(crate) fn mip_levels(&self) -> Option<&MipGenerator> {
        self.mip_levels.as_deref()
    }

    /// Whether other targets of the frame may have the same texture.
    pub(crate) fn is_transient(&self) -> bool {
        self.storage == TargetStorage::Transient
    }
}

impl WgpuTargets {
    /// The target of one view by its name, for what an engine asks for.
    ///
    /// # Errors
    /// If the view has no such target: the error lists those that it has.
    pub(crate) fn find(&self, view: usize, name: &str) -> Result<&ViewTarget, BackendError> {
        let targets = || self.views.get(view).into_iter().flatten().map(|(_, target)| target);
        let unknown = || BackendError::unknown_target(view, name, targets().map(|target| &*target.planned.name));
        targets().find(|target| target.planned.name == name).ok_or_else(unknown)
    }

    /// The target of one view by its index among the plan's; `None` if views of another kind have it.
    pub(crate) fn get(&self, view: usize, index: usize) -> Option<&ViewTarget> {
        let targets = self.views.get(view)?;
        targets.binary_search_by_key(&index, |(index, _)| *index).ok().map(|position| &targets[position].1)
    }

    /// # Errors
    /// As [`Self::get`], if the view does not have the target. This is a bug in Drawloom.
    pub(crate) fn of_view(&self, view: usize, index: usize) -> Result<&ViewTarget, BackendError> {
        self.get(view, index).ok_or_else(|| broken_rule("a frame has the targets of its passes"))
    }

    /// The array that all views of a kind share, by its index among the plan's targets.
    pub(crate) fn layered(&self, index: usize) -> Option<(&wgpu::Texture, &wgpu::TextureView)> {
        let found = self.layered.get(index)?.as_ref()?;
        Some((&found.texture, &found.array))
    }

    /// A target of one or several views, one for each layer, as a shader samples it. Zeros in place of views that the
    /// frame does not have.
    pub(crate) fn find_sampled(
        &self,
        views: &[Option<usize>],
        (target, planned): (usize, &PlannedTarget),
        shape: SampledShape,
    ) -> Option<&wgpu::TextureView> {
        let found = views.iter().flatten().find_map(|view| match shape {
            SampledShape::Picture => self.get(*view, target).map(|target| &target.sampled),
            _ => self.arrays.iter().find_map(|array| array.find(*view, target, shape)),
        });
        found.or_else(|| self.placeholders.find(planned, shape))
    }

    /// Copies what processes of later frames read of the views that this one draws.
    ///
    /// # Errors
    /// If the target of a copy is missing. This is a bug in Drawloom.
    pub(crate) fn copy_histories(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        is_drawn: impl Fn(usize) -> bool,
    ) -> Result<(), BackendError> {
        for (view, _) in self.views.iter().enumerate().filter(|(view, _)| is_drawn(*view)) {
            for &(copy, source) in &self.histories {
                let Some(copy) = self.get(view, copy) else { continue };
                let source = self.of_view(view, source)?;
                let origin = wgpu::Origin3d { z: source.layer, ..wgpu::Origin3d::ZERO };
                for mip_level in 0..copy.texture.mip_level_count() {
                    let from = wgpu::TexelCopyTextureInfo { origin, mip_level, ..source.texture.as_image_copy() };
                    let to = wgpu::TexelCopyTextureInfo { mip_level, ..copy.texture.as_image_copy() };
                    let size = copy.texture.size().mip_level_size(mip_level, wgpu::TextureDimension::D2);
                    encoder.copy_texture_to_texture(from, to, size);
                }
            }
        }
        Ok(())
    }

    /// Whether processes of later frames read something of this one.
    pub(crate) fn have_histories(&self) -> bool {
        self.views.iter().flatten().any(|(_, target)| target.planned.copy_of.is_some())
    }

    /// The memory of those that are not imported.
    pub(crate) fn memory(&self) -> TargetMemory {
        self.memory
    }

    /// Computes the memory of these targets, none of which is imported.
    fn computed_memory(&self) -> TargetMemory {
        let mut memory = TargetMemory::default();
        let targets = self.views.iter().flatten().map(|(_, target)| target);
        for target in targets.filter(|target| target.storage != TargetStorage::Layer) {
            let bytes = texture_bytes(target.planned.format, &target.texture);
            memory.dedicated_bytes += bytes;
            if !target.is_transient() {
                memory.add_texture(bytes);
            }
        }
        let layered = self.layered.iter().flatten().map(|target| (&target.planned, &target.texture));
        let arrays = self.arrays.iter().map(|array| (&array.planned, &array.texture));
        let arrays = layered.chain(arrays).map(|(planned, texture)| (planned.format, texture));
        for (format, texture) in arrays.chain(self.small.textures().map(|(kind, texture)| (kind.format, texture))) {
            let bytes = texture_bytes(format, texture);
            memory.dedicated_bytes += bytes;
            memory.add_texture(bytes);
        }
        self.transient.iter().for_each(|slot| memory.add_texture(texture_bytes(slot.kind.format, &slot.texture)));
        memory
    }
}

/// Keeps targets from frame to frame, makes new ones when a picture's size or the plan changes, and drops those that
/// the current frame does not need.
#[derive(Default)]
pub(crate) struct TargetCache {
    current: Arc<WgpuTargets>,
    /// The key of the current targets: the plan's identity, and of each view its id, its size, its layer, and whether
    /// it may be cached.
    plan: Option<u64>,
    views: Vec<(ViewId, [u32; 2], u32, bool)>,
    /// The targets that are not among the current ones because they were imported: the indices of view and target.
    imported: Vec<(usize, usize)>,
    /// What decides which targets share textures, beside the above: see [`uses_transient`]. `None` if none may.
    order: Option<(Vec<Pass>, SampledViews)>,
    /// Created when a plan has a target with mip levels for the first time.
    mip_pipelines: Option<MipPipelines>,
}

impl TargetCache {
    /// The targets of a frame's views, transient ones if `transient`. Imported textures are those of this frame only.
    ///
    /// # Errors
    /// - If a picture is larger than the device allows.
    /// - If more views share a target than a texture can have layers.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        request: &FrameRequest<'_>,
        imports: &[ResolvedImport<'_>],
        transient: bool,
    ) -> Result<Arc<WgpuTargets>, BackendError> {
        self.update_own(device, request, imports, transient)?;
        if imports.is_empty() {
            return Ok(Arc::clone(&self.current));
        }
        let mut with_imports = WgpuTargets::clone(&self.current);
        for import in imports {
            let &ResolvedImport { view_index, target_index, planned, ref texture } = import;
            let (planned, texture) = (Arc::new(planned.clone()), texture.clone());
            let (view, sampled) = new_views(&texture, planned.format, &import.view_descriptor());
            let storage = TargetStorage::Own;
            let imported = ViewTarget { planned, texture, view, sampled, layer: 0, mip_levels: None, storage };
            let targets = &mut with_imports.views[view_index];
            let position = targets.partition_point(|(index, _)| *index < target_index);
            targets.insert(position, (target_index, imported));
        }
        Ok(Arc::new(with_imports))
    }

    /// Updates the current targets: those that are not imported.
    ///
    /// # Errors
    /// - If a picture is larger than the device allows.
    /// - If more views share a target than a texture can have layers.
    fn update_own(
        &mut self,
        device: &wgpu::Device,
        &FrameRequest { plan, views, passes, sampled_views, .. }: &FrameRequest<'_>,
        imports: &[ResolvedImport<'_>],
        transient: bool,
    ) -> Result<(), BackendError> {
        let key = |view: &RenderView| (view.id, view.camera.size, view.layer, !view.camera.redraw.is_every_frame());
        let requested = || views.iter().map(key);
        let are_same_views = self.views.iter().copied().eq(requested());
        let imported = || imports.iter().map(|import| (import.view_index, import.target_index));
        let is_same_order = match &self.order {
            Some((known, known_views)) => {
                let using = passes.iter().filter(|pass| uses_transient(plan, views, **pass));
                transient && known.iter().eq(using) && known_views == sampled_views
            }
            None => !transient,
        };
        if self.plan == Some(plan.identity())
            && are_same_views
            && self.imported.iter().copied().eq(imported())
            && is_same_order
        {
            return Ok(());
        }
        // If an error occurs below, no targets are current.
        self.plan = None;
        let mut next = WgpuTargets { histories: plan.histories().collect(), ..WgpuTargets::default() };
        let layered = |planned: &PlannedTarget| planned.layered.then(|| self.layered_target(device, planned, views));
        next.layered = plan.targets().iter().map(|planned| layered(planned).transpose()).collect::<Result<_, _>>()?;
        let is_imported = |view: usize, target: usize| imported().any(|import| import == (view, target));
        let order = transient.then(|| {
            let using = passes.iter().filter(|pass| uses_transient(plan, views, **pass));
            (using.copied().collect::<Vec<_>>(), sampled_views.clone())
        });
        let planned: Vec<_> = plan.targets().iter().map(|planned| Arc::new(planned.clone())).collect();
        // By the indices of view and target, those that are layers of a texture: it, and the layer.
        let mut layers: HashMap<(usize, usize), (wgpu::Texture, u32)> = HashMap::new();
        for array in plan.view_arrays(views) {
            let target = array.target_index;
            let array = ViewArrayTexture::new(device, &planned[target], array, views, &self.current.arrays)?;
            let position = |(view, layer)| ((view, target), (array.texture.clone(), layer));
            layers.extend(array.layers().map(position));
            next.arrays.push(array);
        }
        let shared = order.as_ref().map_or_else(TransientTargets::default, |(passes, sampled_views)| {
            let is_left_out =
                |view: usize, target: usize| layers.contains_key(&(view, target)) || is_imported(view, target);
            TransientTargets::new(plan, views, (passes, sampled_views), is_left_out)
        });
        next.transient = self.transient_slots(device, shared.textures())?;
        for slot in next.transient.iter_mut().filter(|slot| slot.kind.mipmapped && slot.mip_levels.is_none()) {
            let pipelines = self.mip_pipelines.get_or_insert_with(|| MipPipelines::new(device));
            slot.mip_levels =
                Some(Arc::new(MipGenerator::new(device, pipelines, (&slot.texture, 0), slot.kind.format)));
        }
        if transient {
            let (mut wanted, mut positions) = (Vec::new(), Vec::new());
            for (index, view) in views.iter().enumerate() {
                let of_kind = planned.iter().enumerate().filter(|(_, planned)| planned.views == view.kind());
                for (target_index, planned) in of_kind.filter(|(target, _)| !is_imported(index, *target)) {
                    let (position, kind) = ((index, target_index), TextureKind::of(planned, view.camera.size));
                    let has_storage =
                        layers.contains_key(&position) || shared.texture_of(index, target_index).is_some();
                    if !has_storage && SmallTargets::accepts(plan, planned, kind) {
                        let kept = self.kept_target(view, &planned.name).map(|(target, _)| target);
                        wanted.push(SmallTarget { kind, kept: kept.map(|kept| (kept.texture.clone(), kept.layer)) });
                        positions.push(position);
                    }
                }
            }
            let (small, assigned) = self.current.small.assign(device, &wanted)?;
            next.small = small;
            layers.extend(positions.into_iter().zip(assigned));
        }
        let mut of_views = Vec::with_capacity(views.len());
        for (index, view) in views.iter().enumerate() {
            let of_kind = planned.iter().enumerate().filter(|(_, planned)| planned.views == view.kind());
            let own = of_kind.filter(|(target, _)| !is_imported(index, *target));
            let target = |target_index: usize, planned: &Arc<PlannedTarget>| {
                if let Some(slot) = shared.texture_of(index, target_index).and_then(|slot| next.transient.get(slot)) {
                    let TransientSlot { texture, view, sampled, mip_levels, .. } = slot.clone();
                    let planned = Arc::clone(planned);
                    return Ok(ViewTarget {
                        planned,
                        texture,
                        view,
                        sampled,
                        layer: 0,
                        mip_levels,
                        storage: TargetStorage::Transient,
                    });
                }
                if let Some((texture, layer)) = layers.get(&(index, target_index)) {
                    return Ok(self.layer_target((planned, texture), view, *layer));
                }
                match &next.layered[target_index] {
                    Some(layered) => Ok(self.layer_target((planned, &layered.texture), view, view.layer)),
                    None => self.own_target(device, planned, view),
                }
            };
            let targets = own.map(|(index, planned)| Ok((index, target(index, planned)?)));
            of_views.push(targets.collect::<Result<Vec<_>, BackendError>>()?);
        }
        let written = of_views.iter_mut().flatten().map(|(_, target)| target);
        let mipmapped = written.filter(|target| target.planned.mipmapped && target.planned.copy_of.is_none());
        for target in mipmapped.filter(|target| target.mip_levels.is_none()) {
            let pipelines = self.mip_pipelines.get_or_insert_with(|| MipPipelines::new(device));
            let texture = (&target.texture, target.layer);
            target.mip_levels = Some(Arc::new(MipGenerator::new(device, pipelines, texture, target.planned.format)));
        }
        next.views = PerView::new(views, of_views);
        next.placeholders = self.current.placeholders.updated(device, plan)?;
        next.memory = next.computed_memory();
        self.current = Arc::new(next);
        self.plan = Some(plan.identity());
        self.views.clear();
        self.views.extend(requested());
        self.imported = imported().collect();
        self.order = order;
        Ok(())
    }

    /// Textures for transient targets, each at the position of its kind; those of the frame before where they fit.
    ///
    /// # Errors
    /// If a picture is larger than the device allows.
    fn transient_slots(
        &self,
        device: &wgpu::Device,
        kinds: &[TextureKind],
    ) -> Result<Vec<TransientSlot>, BackendError> {
        let mut unused: HashMap<TextureKind, VecDeque<&TransientSlot>> = HashMap::new();
        self.current.transient.iter().for_each(|slot| unused.entry(slot.kind).or_default().push_back(slot));
        let slots = kinds.iter().map(|&kind| {
            if let Some(slot) = unused.get_mut(&kind).and_then(VecDeque::pop_front) {
                return Ok(slot.clone());
            }
            let texture = new_texture(device, "transient targets", kind, 1)?;
            let (view, sampled) = new_views(&texture, kind.format, &wgpu::TextureViewDescriptor::default());
            Ok(TransientSlot { kind, texture, view, sampled, mip_levels: None })
        });
        slots.collect()
    }

    /// Makes the histories of the next frame empty.
    pub(crate) fn forget_histories(&mut self) {
        if self.current.have_histories() {
            let all = Arc::make_mut(&mut self.current).views.slots_mut();
            all.iter_mut().for_each(|targets| targets.retain(|(_, target)| target.planned.copy_of.is_none()));
            // The next frame has other targets than these.
            self.plan = None;
        }
    }

    /// The latest frame's targets.
    pub(crate) fn current(&self) -> &WgpuTargets {
        &self.current
    }

    /// The current target of this name in the slot of a view, and whether it is the same view's.
    fn kept_target(&self, view: &RenderView, name: &str) -> Option<(&ViewTarget, bool)> {
        let (targets, is_same) = self.current.views.kept(view)?;
        targets.iter().find(|(_, target)| target.planned.name == name).map(|(_, target)| (target, is_same))
    }

    fn own_target(
        &self,
        device: &wgpu::Device,
        planned: &Arc<PlannedTarget>,
        view: &RenderView,
    ) -> Result<ViewTarget, BackendError> {
        let kind = TextureKind::of(planned, view.camera.size);
        let [width, height] = kind.size;
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        // Another view has no part in this one's history.
        let is_usable = |cached: &ViewTarget, is_same: bool| {
            (is_same || planned.copy_of.is_none())
                && cached.planned == *planned
                && cached.texture.size() == extent
                && cached.storage == TargetStorage::Own
        };
        if let Some((cached, is_same)) = self.kept_target(view, &planned.name)
            && is_usable(cached, is_same)
        {
            return Ok(cached.clone());
        }
        let texture = new_texture(device, &planned.name, kind, 1)?;
        let (view, sampled) = new_views(&texture, planned.format, &wgpu::TextureViewDescriptor::default());
        let planned = Arc::clone(planned);
        Ok(ViewTarget { planned, texture, view, sampled, layer: 0, mip_levels: None, storage: TargetStorage::Own })
    }

    fn layer_target(
        &self,
        (planned, texture): (&Arc<PlannedTarget>, &wgpu::Texture),
        view: &RenderView,
        layer: u32,
    ) -> ViewTarget {
        if let Some((cached, _)) = self.kept_target(view, &planned.name)
            && (&cached.texture, cached.layer) == (texture, layer)
        {
            return cached.clone();
        }
        let (view, sampled) = new_views(texture, planned.format, &layer_descriptor(layer));
        let (planned, texture) = (Arc::clone(planned), texture.clone());
        ViewTarget { planned, texture, view, sampled, layer, mip_levels: None, storage: TargetStorage::Layer }
    }

    fn layered_target(
        &self,
        device: &wgpu::Device,
        planned: &PlannedTarget,
        views: &[RenderView],
    ) -> Result<LayeredTarget, BackendError> {
        let sharing_views = || views.iter().filter(|view| view.kind() == planned.views);
        // Without a view, shaders still bind a texture: one cleared pixel.
        let [width, height] = sharing_views().next().map_or([1, 1], |view| view.camera.size);
        let layers = sharing_views().count().max(1) as u32;
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: layers };
        // A texture of up to twice the layers is reused, so that lights that come and go do not allocate each time.
        let fits = |size: wgpu::Extent3d| {
            let layers = layers..=2 * layers;
            wgpu::Extent3d { depth_or_array_layers: extent.depth_or_array_layers, ..size } == extent
                && layers.contains(&size.depth_or_array_layers)
        };
        let mut cached = self.current.layered.iter().flatten().filter(|cached| *cached.planned == *planned);
        if let Some(cached) = cached.find(|cached| fits(cached.texture.size())) {
            return Ok(cached.clone());
        }
        let allowed = device.limits().max_texture_array_layers;
        if layers > allowed {
            return Err(BackendError::TooManyLayers {
                target: planned.name.clone(),
                views: u64::from(layers),
                allowed: u64::from(allowed),
            });
        }
        let kind = TextureKind { size: [width, height], ..TextureKind::of(planned, [width, height]) };
        let texture = new_texture(device, &planned.name, kind, layers)?;
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let descriptor = wgpu::TextureViewDescriptor { dimension, ..Default::default() };
        let (_, array) = new_views(&texture, planned.format, &descriptor);
        Ok(LayeredTarget { planned: Arc::new(planned.clone()), texture, array })
    }
}
