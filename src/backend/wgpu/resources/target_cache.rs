//! The cache of the views' targets.

use std::sync::Arc;

use super::bind_group_layouts::texture_format;
use super::imported_target::ResolvedImport;
use crate::backend::BackendError;
use crate::process::{Access, Format, FramePlan, PlannedTarget};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The targets of one frame.
#[derive(Clone, Default)]
pub(crate) struct WgpuTargets {
    /// For each view its name, its own targets, and its layers of the shared ones.
    views: Vec<(String, Vec<ViewTarget>)>,
    /// The targets that all views of a kind share.
    layered: Vec<LayeredTarget>,
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

    /// The number of textures, and their size in bytes.
    pub(crate) fn sizes(&self) -> (usize, u64) {
        let own = self.views.iter().flat_map(|(_, targets)| targets).filter(|target| !target.planned.layered);
        let textures = own.map(|target| (&target.planned, &target.texture));
        let textures = textures.chain(self.layered.iter().map(|target| (&target.planned, &target.texture)));
        textures.fold((0, 0), |(count, bytes), (planned, texture)| {
            let size = texture.size();
            let pixels = u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
            (count + 1, bytes + pixels * planned.format.bytes() as u64 * u64::from(texture.sample_count()))
        })
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
}

impl TargetCache {
    /// The targets of these views. Imported textures are those of this frame only.
    ///
    /// # Errors
    /// - If a picture is larger than the device allows.
    /// - If more views share a target than a texture can have layers.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        plan: &FramePlan,
        views: &[RenderView],
        imports: &[ResolvedImport<'_>],
    ) -> Result<Arc<WgpuTargets>, BackendError> {
        self.update_own(device, plan, views, imports)?;
        if imports.is_empty() {
            return Ok(Arc::clone(&self.current));
        }
        let mut with_imports = WgpuTargets::clone(&self.current);
        for import in imports {
            let ResolvedImport { view_index, planned, texture } = import;
            let (planned, texture) = (Arc::new(PlannedTarget::clone(planned)), texture.clone());
            let (view, sampled) = new_views(&texture, planned.format, &import.view_descriptor());
            let (_, targets) = &mut with_imports.views[*view_index];
            targets.push(ViewTarget { planned, texture, view, sampled, layer: 0 });
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
        plan: &FramePlan,
        views: &[RenderView],
        imports: &[ResolvedImport<'_>],
    ) -> Result<(), BackendError> {
        let requested = || views.iter().map(|view| (view.kind(), view.camera.size, view.layer));
        let names = self.current.views.iter().map(|(name, _)| name.as_str());
        let are_same_views = self.views.iter().copied().eq(requested()) && names.eq(views.iter().map(RenderView::name));
        let imported = || imports.iter().map(|import| (import.view_index, import.planned.name.as_str()));
        let known = self.imported.iter().map(|(view, target)| (*view, target.as_str()));
        if self.plan == Some(plan.identity()) && are_same_views && known.eq(imported()) {
            return Ok(());
        }
        // If an error occurs below, no targets are current.
        self.plan = None;
        let mut next = WgpuTargets::default();
        for planned in plan.targets().iter().filter(|planned| planned.layered) {
            next.layered.push(self.layered_target(device, planned, views)?);
        }
        for (index, view) in views.iter().enumerate() {
            let is_own = |planned: &&PlannedTarget| !imported().any(|import| import == (index, planned.name.as_str()));
            let planned = plan.targets().iter().filter(|planned| planned.views == view.kind()).filter(is_own);
            let targets = planned.map(|planned| {
                if !planned.layered {
                    return self.own_target(device, planned, index, view);
                }
                let shared = next.layered.iter().find(|shared| *shared.planned == *planned);
                let missing = || BackendError::BrokenRule { rule: "every shared target is created first".to_owned() };
                Ok(self.layer_target(shared.ok_or_else(missing)?, index, view.layer))
            });
            let targets = targets.collect::<Result<_, _>>()?;
            next.views.push((view.name().to_owned(), targets));
        }
        next.placeholder = self.placeholder_targets(device, plan)?;
        self.current = Arc::new(next);
        self.plan = Some(plan.identity());
        self.views.clear();
        self.views.extend(requested());
        self.imported = imported().map(|(view, target)| (view, target.to_owned())).collect();
        Ok(())
    }

    /// The latest frame's targets.
    pub(crate) fn current(&self) -> &WgpuTargets {
        &self.current
    }

    fn own_target(
        &self,
        device: &wgpu::Device,
        planned: &PlannedTarget,
        index: usize,
        view: &RenderView,
    ) -> Result<ViewTarget, BackendError> {
        let [width, height] = planned.size.in_view(view.camera.size);
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        // Another view has no part in this one's history.
        let is_same_view = self.current.views.get(index).is_some_and(|(name, _)| name == view.name());
        let cached = self.current.find(index, &planned.name).filter(|_| is_same_view || planned.copy_of.is_none());
        if let Some(cached) = cached.filter(|cached| *cached.planned == *planned && cached.texture.size() == extent) {
            return Ok(cached.clone());
        }
        let texture = new_texture(device, planned, extent)?;
        let (view, sampled) = new_views(&texture, planned.format, &wgpu::TextureViewDescriptor::default());
        Ok(ViewTarget { planned: Arc::new(planned.clone()), texture, view, sampled, layer: 0 })
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
                    let size = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
                    let texture = new_texture(device, planned, size)?;
                    new_views(&texture, format, &wgpu::TextureViewDescriptor::default()).1
                }
            };
            placeholder.push((format, multisampled, sampled));
        }
        Ok(placeholder)
    }

    fn layer_target(&self, shared: &LayeredTarget, view: usize, layer: u32) -> ViewTarget {
        let cached = self.current.find(view, &shared.planned.name);
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
        ViewTarget { planned: Arc::clone(&shared.planned), texture: shared.texture.clone(), view, sampled, layer }
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
        let texture = new_texture(device, planned, extent)?;
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let descriptor = wgpu::TextureViewDescriptor { dimension, ..Default::default() };
        let (_, array) = new_views(&texture, planned.format, &descriptor);
        Ok(LayeredTarget { planned: Arc::new(planned.clone()), texture, array })
    }
}

/// The number of samples of a target's pixels.
pub(crate) fn sample_count(planned: &PlannedTarget) -> u32 {
    // The only number beside 1 that every device has.
    if planned.multisampled { 4 } else { 1 }
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
    planned: &PlannedTarget,
    size: wgpu::Extent3d,
) -> Result<wgpu::Texture, BackendError> {
    let missing = texture_format(planned.format).required_features() - device.features();
    if !missing.is_empty() {
        return Err(BackendError::MissingFeature { missing: missing.to_string() });
    }
    let limits = device.limits();
    for (limit, allowed, needed) in [
        ("max_texture_dimension_2d", limits.max_texture_dimension_2d, size.width.max(size.height)),
        ("max_texture_array_layers", limits.max_texture_array_layers, size.depth_or_array_layers),
    ] {
        if needed > allowed {
            return Err(BackendError::Limit { limit, allowed: u64::from(allowed), needed: u64::from(needed) });
        }
    }
    let sampled = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    let copied = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST;
    let usage = if planned.multisampled { sampled } else { sampled | copied };
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some(&planned.name),
        size,
        mip_level_count: 1,
        sample_count: sample_count(planned),
        dimension: wgpu::TextureDimension::D2,
        format: texture_format(planned.format),
        usage: if planned.stored { usage | wgpu::TextureUsages::STORAGE_BINDING } else { usage },
        view_formats: &[],
    }))
}
