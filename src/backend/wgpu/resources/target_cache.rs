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
use crate::backend::{BackendError, FrameRequest, TargetMemory};
use crate::process::{Format, Pass, PlannedTarget, SampledShape, SampledViews};
use crate::scene::ViewKind;
use crate::view::{PerView, RenderView, ViewId};

/// The targets of one frame.
#[derive(Clone, Default)]
pub(crate) struct WgpuTargets {
    /// For each view its own targets, and its layers of the shared ones.
    views: PerView<Vec<ViewTarget>>,
    /// The targets that all views of a kind share.
    layered: Vec<LayeredTarget>,
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
    /// The target of one view by its name.
    pub(crate) fn find(&self, view: usize, name: &str) -> Option<&ViewTarget> {
        find(self.views.get(view)?, name)
    }

    /// The array that all views of a kind share.
    pub(crate) fn find_layered(&self, kind: ViewKind, name: &str) -> Option<(&wgpu::Texture, &wgpu::TextureView)> {
        let found = self.layered.iter().find(|target| target.planned.views == kind && target.planned.name == name);
        found.map(|target| (&target.texture, &target.array))
    }

    /// A target of one or several views, one for each layer, as a shader samples it. Zeros in place of views that the
    /// frame does not have.
    pub(crate) fn find_sampled(
        &self,
        views: &[Option<usize>],
        planned: &PlannedTarget,
        shape: SampledShape,
    ) -> Option<&wgpu::TextureView> {
        let found = views.iter().flatten().find_map(|view| match shape {
            SampledShape::Picture => self.find(*view, &planned.name).map(|target| &target.sampled),
            _ => self.arrays.iter().find_map(|array| array.find(*view, &planned.name, shape)),
        });
        found.or_else(|| self.placeholders.find(planned, shape))
    }

    /// Copies what processes of later frames read of the views that this one draws.
    pub(crate) fn copy_histories(&self, encoder: &mut wgpu::CommandEncoder, is_drawn: impl Fn(usize) -> bool) {
        for (view, targets) in self.views.iter().enumerate().filter(|(view, _)| is_drawn(*view)) {
            for copy in targets {
                let source = copy.planned.copy_of.as_ref().and_then(|source| self.find(view, source));
                let Some(source) = source else { continue };
                let origin = wgpu::Origin3d { z: source.layer, ..wgpu::Origin3d::ZERO };
                for mip_level in 0..copy.texture.mip_level_count() {
                    let from = wgpu::TexelCopyTextureInfo { origin, mip_level, ..source.texture.as_image_copy() };
                    let to = wgpu::TexelCopyTextureInfo { mip_level, ..copy.texture.as_image_copy() };
                    let size = copy.texture.size().mip_level_size(mip_level, wgpu::TextureDimension::D2);
                    encoder.copy_texture_to_texture(from, to, size);
                }
            }
        }
    }

    /// Whether processes of later frames read something of this one.
    pub(crate) fn have_histories(&self) -> bool {
        self.views.iter().flatten().any(|target| target.planned.copy_of.is_some())
    }

    /// The memory of those that are not imported.
    pub(crate) fn memory(&self) -> TargetMemory {
        self.memory
    }

    /// Computes the memory of these targets, none of which is imported.
    fn computed_memory(&self) -> TargetMemory {
        let mut memory = TargetMemory::default();
        for target in self.views.iter().flatten().filter(|target| target.storage != TargetStorage::Layer) {
            let bytes = texture_bytes(target.planned.format, &target.texture);
            memory.dedicated_bytes += bytes;
            if !target.is_transient() {
                memory.add_texture(bytes);
            }
        }
        let layered = self.layered.iter().map(|target| (&target.planned, &target.texture));
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
    /// The targets that are not among the current ones because they were imported: the view's index, and the name.
    imported: Vec<(usize, String)>,
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
            let ResolvedImport { view_index, planned, texture } = import;
            let (planned, texture) = (Arc::new(PlannedTarget::clone(planned)), texture.clone());
            let (view, sampled) = new_views(&texture, planned.format, &import.view_descriptor());
            with_imports.views[*view_index].push(ViewTarget {
                planned,
                texture,
                view,
                sampled,
                layer: 0,
                mip_levels: None,
                storage: TargetStorage::Own,
            });
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
        let imported = || imports.iter().map(|import| (import.view_index, import.planned.name.as_str()));
        let known = self.imported.iter().map(|(view, target)| (*view, target.as_str()));
        let is_same_order = match &self.order {
            Some((known, known_views)) => {
                let using = passes.iter().filter(|pass| uses_transient(plan, views, **pass));
                transient && known.iter().eq(using) && known_views == sampled_views
            }
            None => !transient,
        };
        if self.plan == Some(plan.identity()) && are_same_views && known.eq(imported()) && is_same_order {
            return Ok(());
        }
        // If an error occurs below, no targets are current.
        self.plan = None;
        let mut next = WgpuTargets::default();
        for planned in plan.targets().iter().filter(|planned| planned.layered) {
            next.layered.push(self.layered_target(device, planned, views)?);
        }
        let is_imported = |view: usize, target: &str| imported().any(|import| import == (view, target));
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
            let is_left_out = |view: usize, target: usize| {
                layers.contains_key(&(view, target)) || is_imported(view, &plan.targets()[target].name)
            };
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
                for (target_index, planned) in of_kind.filter(|(_, planned)| !is_imported(index, &planned.name)) {
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
            let own = of_kind.filter(|(_, planned)| !is_imported(index, &planned.name));
            let targets = own.map(|(target_index, planned)| {
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
                if !planned.layered {
                    return self.own_target(device, planned, view);
                }
                let layered = next.layered.iter().find(|layered| *layered.planned == **planned);
                let missing = || BackendError::BrokenRule { rule: "every shared target is created first".to_owned() };
                let layered = layered.ok_or_else(missing)?;
                Ok(self.layer_target((&layered.planned, &layered.texture), view, view.layer))
            });
            of_views.push(targets.collect::<Result<Vec<_>, _>>()?);
        }
        let written = of_views.iter_mut().flatten();
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
        self.imported = imported().map(|(view, target)| (view, target.to_owned())).collect();
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
            all.iter_mut().for_each(|targets| targets.retain(|target| target.planned.copy_of.is_none()));
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
        Some((find(targets, name)?, is_same))
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
        let mut cached = self.current.layered.iter().filter(|cached| *cached.planned == *planned);
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

/// The one of a view's targets that has this name.
fn find<'a>(targets: &'a [ViewTarget], name: &str) -> Option<&'a ViewTarget> {
    targets.iter().find(|target| target.planned.name == name)
}
