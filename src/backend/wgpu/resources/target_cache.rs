//! The cache of the views' targets.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use super::bind_group_layouts::texture_format;
use super::imported_target::ResolvedImport;
use super::transient_targets::{TextureKind, TransientTargets, uses_transient};
use crate::backend::kept_views::{KeptView, kept_views};
use crate::backend::{BackendError, FrameRequest, TargetMemory};
use crate::process::{Access, Format, FramePlan, Pass, PlannedTarget, SampledViews};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The targets of one frame.
#[derive(Clone, Default)]
pub(crate) struct WgpuTargets {
    /// For each view its name, its own targets, and its layers of the shared ones.
    views: Vec<(String, Vec<ViewTarget>)>,
    /// The targets that all views of a kind share.
    layered: Vec<LayeredTarget>,
    /// Those that transient targets share.
    transient: Vec<TransientSlot>,
    memory: TargetMemory,
    /// For passes that sample a view that the frame does not have: a pixel of zeros for each format and number of samples.
    placeholder: Vec<(Format, bool, wgpu::TextureView)>,
}

/// A target as one view draws into it.
#[derive(Clone)]
pub(crate) struct ViewTarget {
    planned: Arc<PlannedTarget>,
    pub(crate) texture: wgpu::Texture,
    /// Of the view's layer only.
    pub(crate) view: wgpu::TextureView,
    /// The same as shaders sample it: depth without the stencil.
    pub(crate) sampled: wgpu::TextureView,
    pub(crate) layer: u32,
    /// Whether other targets of the frame may have the same texture.
    pub(crate) is_transient: bool,
}

/// A texture that transient targets share.
#[derive(Clone)]
struct TransientSlot {
    kind: TextureKind,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    sampled: wgpu::TextureView,
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
}

impl WgpuTargets {
    /// The target of one view by its name.
    pub(crate) fn find(&self, view: usize, name: &str) -> Option<&ViewTarget> {
        self.views.get(view)?.1.iter().find(|target| target.planned.name == name)
    }

    /// The array that all views of a kind share.
    pub(crate) fn find_layered(&self, kind: ViewKind, name: &str) -> Option<(&wgpu::Texture, &wgpu::TextureView)> {
        let found = self.layered.iter().find(|target| target.planned.views == kind && target.planned.name == name);
        found.map(|target| (&target.texture, &target.array))
    }

    /// A pixel of zeros in place of a target of a view that the frame does not have.
    pub(crate) fn find_placeholder(&self, planned: &PlannedTarget) -> Option<&wgpu::TextureView> {
        let is_wanted =
            |placeholder: &&(Format, bool, _)| (placeholder.0, placeholder.1) == (planned.format, planned.multisampled);
        self.placeholder.iter().find(is_wanted).map(|(.., texture)| texture)
    }

    /// Copies what processes of later frames read of this one.
    pub(crate) fn copy_histories(&self, encoder: &mut wgpu::CommandEncoder) {
        for (view, (_, targets)) in self.views.iter().enumerate() {
            for copy in targets {
                let source = copy.planned.copy_of.as_ref().and_then(|source| self.find(view, source));
                let Some(source) = source else { continue };
                let (from, to) = (source.texture.as_image_copy(), copy.texture.as_image_copy());
                encoder.copy_texture_to_texture(from, to, copy.texture.size());
            }
        }
    }

    /// Whether processes of later frames read something of this one.
    pub(crate) fn have_histories(&self) -> bool {
        self.views.iter().any(|(_, targets)| targets.iter().any(|target| target.planned.copy_of.is_some()))
    }

    /// The memory of those that are not imported.
    pub(crate) fn memory(&self) -> TargetMemory {
        self.memory
    }

    /// Computes the memory of these targets, none of which is imported.
    fn computed_memory(&self) -> TargetMemory {
        let mut memory = TargetMemory::default();
        for target in self.views.iter().flat_map(|(_, targets)| targets).filter(|target| !target.planned.layered) {
            let bytes = texture_bytes(target.planned.format, &target.texture);
            memory.dedicated_bytes += bytes;
            if !target.is_transient {
                memory.add_texture(bytes);
            }
        }
        for target in &self.layered {
            let bytes = texture_bytes(target.planned.format, &target.texture);
            memory.dedicated_bytes += bytes;
            memory.add_texture(bytes);
        }
        self.transient.iter().for_each(|slot| memory.add_texture(texture_bytes(slot.kind.format, &slot.texture)));
        memory
    }
}

/// Keeps targets from frame to frame, makes new ones when a picture's size or the plan changes, and drops those that the
/// current frame does not need.
#[derive(Default)]
pub(crate) struct TargetCache {
    current: Arc<WgpuTargets>,
    /// The key of the current targets, beside the views' names: the plan's identity, and kind, size and layer of each view.
    plan: Option<u64>,
    views: Vec<(ViewKind, [u32; 2], u32)>,
    /// The targets that are not among the current ones because they were imported: the view's index, and the name.
    imported: Vec<(usize, String)>,
    /// What decides which targets share textures, beside the above: see [`uses_transient`]. `None` if none may.
    order: Option<(Vec<Pass>, SampledViews)>,
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
            let (_, targets) = &mut with_imports.views[*view_index];
            targets.push(ViewTarget { planned, texture, view, sampled, layer: 0, is_transient: false });
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
        let requested = || views.iter().map(|view| (view.kind(), view.camera.size, view.layer));
        let names = self.current.views.iter().map(|(name, _)| name.as_str());
        let are_same_views = self.views.iter().copied().eq(requested()) && names.eq(views.iter().map(RenderView::name));
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
        let shared = order.as_ref().map_or_else(TransientTargets::default, |(passes, sampled_views)| {
            TransientTargets::new(plan, views, (passes, sampled_views), is_imported)
        });
        next.transient = self.transient_slots(device, shared.textures())?;
        let planned: Vec<_> = plan.targets().iter().map(|planned| Arc::new(planned.clone())).collect();
        let kinds_and_names =
            self.views.iter().zip(&self.current.views).map(|((kind, ..), (name, _))| (*kind, name.as_str()));
        let kept = kept_views(kinds_and_names, views);
        for (index, view) in views.iter().enumerate() {
            let of_kind = planned.iter().enumerate().filter(|(_, planned)| planned.views == view.kind());
            let own = of_kind.filter(|(_, planned)| !is_imported(index, &planned.name));
            let targets = own.map(|(target_index, planned)| {
                if let Some(slot) = shared.texture_of(index, target_index).and_then(|slot| next.transient.get(slot)) {
                    let TransientSlot { texture, view, sampled, .. } = slot.clone();
                    let planned = Arc::clone(planned);
                    return Ok(ViewTarget { planned, texture, view, sampled, layer: 0, is_transient: true });
                }
                if !planned.layered {
                    return self.own_target(device, planned, kept[index], view);
                }
                let layered = next.layered.iter().find(|layered| *layered.planned == **planned);
                let missing = || BackendError::BrokenRule { rule: "every shared target is created first".to_owned() };
                Ok(self.layer_target(layered.ok_or_else(missing)?, kept[index], view.layer))
            });
            let targets = targets.collect::<Result<_, _>>()?;
            next.views.push((view.name().to_owned(), targets));
        }
        next.placeholder = self.placeholder_targets(device, plan)?;
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
            Ok(TransientSlot { kind, texture, view, sampled })
        });
        slots.collect()
    }

    /// The latest frame's targets.
    pub(crate) fn current(&self) -> &WgpuTargets {
        &self.current
    }

    fn own_target(
        &self,
        device: &wgpu::Device,
        planned: &Arc<PlannedTarget>,
        kept: Option<KeptView>,
        view: &RenderView,
    ) -> Result<ViewTarget, BackendError> {
        let kind = TextureKind::of(planned, view.camera.size);
        let [width, height] = kind.size;
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        // Another view has no part in this one's history.
        let kept = kept.filter(|kept| kept.is_same || planned.copy_of.is_none());
        let cached = kept.and_then(|kept| self.current.find(kept.index, &planned.name));
        let mut cached = cached.filter(|cached| cached.planned == *planned && cached.texture.size() == extent);
        if let Some(cached) = cached.take_if(|cached| !cached.is_transient) {
            return Ok(cached.clone());
        }
        let texture = new_texture(device, &planned.name, kind, 1)?;
        let (view, sampled) = new_views(&texture, planned.format, &wgpu::TextureViewDescriptor::default());
        let planned = Arc::clone(planned);
        Ok(ViewTarget { planned, texture, view, sampled, layer: 0, is_transient: false })
    }

    fn placeholder_targets(
        &self,
        device: &wgpu::Device,
        plan: &FramePlan,
    ) -> Result<Vec<(Format, bool, wgpu::TextureView)>, BackendError> {
        let mut placeholder: Vec<(Format, bool, wgpu::TextureView)> = Vec::new();
        let accesses = plan.processes().iter().flat_map(|planned| &planned.declaration.accesses);
        for (target, access) in accesses {
            let Access::SampleView(views, _) = *access else { continue };
            let Some(planned) = plan.sampled_target(views, target) else { continue };
            let (format, multisampled) = (planned.format, planned.multisampled);
            if placeholder.iter().any(|(known, samples, _)| (*known, *samples) == (format, multisampled)) {
                continue;
            }
            let sampled = match self.current.find_placeholder(planned) {
                Some(cached) => cached.clone(),
                // wgpu clears a texture before it is first read.
                None => {
                    let kind = TextureKind { size: [1, 1], ..TextureKind::of(planned, [1, 1]) };
                    let texture = new_texture(device, target, kind, 1)?;
                    new_views(&texture, format, &wgpu::TextureViewDescriptor::default()).1
                }
            };
            placeholder.push((format, multisampled, sampled));
        }
        Ok(placeholder)
    }

    fn layer_target(&self, shared: &LayeredTarget, kept: Option<KeptView>, layer: u32) -> ViewTarget {
        let cached = kept.and_then(|kept| self.current.find(kept.index, &shared.planned.name));
        if let Some(cached) = cached.filter(|cached| cached.texture == shared.texture && cached.layer == layer) {
            return cached.clone();
        }
        let descriptor = wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..wgpu::TextureViewDescriptor::default()
        };
        let (view, sampled) = new_views(&shared.texture, shared.planned.format, &descriptor);
        let (planned, texture) = (Arc::clone(&shared.planned), shared.texture.clone());
        ViewTarget { planned, texture, view, sampled, layer, is_transient: false }
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
        let kind = TextureKind { size: [width, height], ..TextureKind::of(planned, [width, height]) };
        let texture = new_texture(device, &planned.name, kind, layers)?;
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let descriptor = wgpu::TextureViewDescriptor { dimension, ..Default::default() };
        let (_, array) = new_views(&texture, planned.format, &descriptor);
        Ok(LayeredTarget { planned: Arc::new(planned.clone()), texture, array })
    }
}

/// The number of samples of the pixels of a target.
pub(crate) fn sample_count(multisampled: bool) -> u32 {
    // The only number beside 1 that every device has.
    if multisampled { 4 } else { 1 }
}

/// The size of a texture in bytes.
fn texture_bytes(format: Format, texture: &wgpu::Texture) -> u64 {
    let size = texture.size();
    let pixels = u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
    pixels * format.bytes() as u64 * u64::from(texture.sample_count())
}

/// A view to draw into, and one that shaders sample.
fn new_views(
    texture: &wgpu::Texture,
    format: Format,
    descriptor: &wgpu::TextureViewDescriptor<'_>,
) -> (wgpu::TextureView, wgpu::TextureView) {
    let view = texture.create_view(descriptor);
    let sampled = if format.has_depth() && format.has_stencil() {
        let aspect = wgpu::TextureAspect::DepthOnly;
        texture.create_view(&wgpu::TextureViewDescriptor { aspect, ..descriptor.clone() })
    } else {
        view.clone()
    };
    (view, sampled)
}

fn new_texture(
    device: &wgpu::Device,
    label: &str,
    kind: TextureKind,
    layers: u32,
) -> Result<wgpu::Texture, BackendError> {
    let TextureKind { format, multisampled, stored, size: [width, height] } = kind;
    let missing = texture_format(format).required_features() - device.features();
    if !missing.is_empty() {
        return Err(BackendError::MissingFeature { missing: missing.to_string() });
    }
    let limits = device.limits();
    for (limit, allowed, needed) in [
        ("max_texture_dimension_2d", limits.max_texture_dimension_2d, width.max(height)),
        ("max_texture_array_layers", limits.max_texture_array_layers, layers),
    ] {
        if needed > allowed {
            return Err(BackendError::Limit { limit, allowed: u64::from(allowed), needed: u64::from(needed) });
        }
    }
    let sampled = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    let copied = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST;
    let usage = if multisampled { sampled } else { sampled | copied };
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: sample_count(multisampled),
        dimension: wgpu::TextureDimension::D2,
        format: texture_format(format),
        usage: if stored { usage | wgpu::TextureUsages::STORAGE_BINDING } else { usage },
        view_formats: &[],
    }))
}
