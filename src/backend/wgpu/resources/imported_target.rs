//! Textures of the engine's own that take the place of targets.

use super::bind_groups::texture_format;
use crate::backend::BackendError;
use crate::process::{Access, FramePlan, PlannedTarget, list_names};
use crate::view::RenderView;

/// A texture of the engine's own that takes the place of a view's target in one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImportedTarget {
    /// The view's name.
    pub(crate) view: String,
    pub(crate) target: String,
    pub(crate) texture: wgpu::Texture,
}

impl ImportedTarget {
    /// Whether it is of this view and target.
    pub(crate) fn is_of(&self, view: &str, target: &str) -> bool {
        (self.view.as_str(), self.target.as_str()) == (view, target)
    }

    /// The target that the texture takes the place of: that of the first view with the name that has a target of that
    /// name.
    ///
    /// # Errors
    /// If there is none, or the texture does not fit.
    pub(crate) fn resolve<'a>(
        &self,
        plan: &'a FramePlan,
        views: &[RenderView],
    ) -> Result<ResolvedImport<'a>, BackendError> {
        let mut named = views.iter().enumerate().filter(|(_, view)| view.name() == self.view).peekable();
        if named.peek().is_none() {
            return Err(self.refused("there is no such view"));
        }
        let found = named.find_map(|(index, view)| Some((index, view, plan.target_index(view.kind(), &self.target)?)));
        let (view_index, view, target_index) = found.ok_or_else(|| {
            let is_of_view = |planned: &&PlannedTarget| {
                views.iter().any(|view| view.name() == self.view && view.kind() == planned.views)
            };
            let known = plan.targets().iter().filter(is_of_view).map(|planned| planned.name.as_str());
            self.refused(format!("the view has no such target, only: {}", list_names(known)))
        })?;
        let planned = &plan.targets()[target_index];
        self.check(plan, planned, planned.size.in_view(view.camera.size))?;
        let mut arrays = plan.view_arrays(views).into_iter().filter(|array| array.target_index == target_index);
        if arrays.any(|array| array.view_indices.contains(&Some(view_index))) {
            return Err(
                self.refused("that target cannot be imported, because a process samples it as a layer of an array")
            );
        }
        Ok(ResolvedImport { view_index, target_index, planned, texture: self.texture.clone() })
    }

    fn refused(&self, problem: impl Into<String>) -> BackendError {
        let (view, target) = (self.view.clone(), self.target.clone());
        BackendError::InvalidImport { view, target, problem: problem.into() }
    }

    /// Checks that a view's target can be this texture.
    ///
    /// # Errors
    /// If it differs in what the frame needs of it.
    fn check(&self, plan: &FramePlan, planned: &PlannedTarget, [width, height]: [u32; 2]) -> Result<(), BackendError> {
        let unfit = [
            (planned.layered, "all views of its kind share it"),
            (planned.copy_of.is_some(), "it is the history of another one"),
            (planned.multisampled, "it is multisampled"),
            (planned.mipmapped, "it has mip levels"),
        ];
        if let Some((_, reason)) = unfit.into_iter().find(|(is_unfit, _)| *is_unfit) {
            return Err(self.refused(format!("that target cannot be imported, because {reason}")));
        }
        let (size, samples) = (self.texture.size(), self.texture.sample_count());
        if size != (wgpu::Extent3d { width, height, depth_or_array_layers: 1 }) {
            let (found, layers) = ([size.width, size.height], size.depth_or_array_layers);
            return Err(self.refused(format!(
                "the texture has {}x{} pixels in {layers} layers, and the target {width}x{height} in 1",
                found[0], found[1]
            )));
        }
        let (found, needed) = (self.texture.format(), texture_format(planned.format));
        if found.remove_srgb_suffix() != needed.remove_srgb_suffix() {
            return Err(self.refused(format!("the texture has the format {found:?}, and the target {needed:?}")));
        }
        let dimension = self.texture.dimension();
        if dimension != wgpu::TextureDimension::D2 {
            return Err(self.refused(format!("the texture is {dimension:?}, and the target D2")));
        }
        if samples != 1 {
            return Err(self.refused(format!("the texture has {samples} samples per pixel, and the target 1")));
        }
        let missing = needed_usages(plan, planned) - self.texture.usage();
        if missing.is_empty() {
            return Ok(());
        }
        Err(self.refused(format!("the texture lacks the usage {missing:?}, which the frame's processes need")))
    }
}

/// An imported texture, and the target that it takes the place of.
pub(crate) struct ResolvedImport<'a> {
    pub(super) view_index: usize,
    pub(super) target_index: usize,
    pub(super) planned: &'a PlannedTarget,
    pub(super) texture: wgpu::Texture,
}

impl ResolvedImport<'_> {
    /// The view of the texture that has the target's format.
    pub(super) fn view_descriptor(&self) -> wgpu::TextureViewDescriptor<'static> {
        // A view of one aspect of depth and stencil has a format of its own.
        let format = Some(self.planned.format).filter(|format| !format.is_depth_stencil()).map(texture_format);
        wgpu::TextureViewDescriptor { format, mip_level_count: Some(1), ..wgpu::TextureViewDescriptor::default() }
    }
}

/// The usages that a plan's processes need of a target.
fn needed_usages(plan: &FramePlan, planned: &PlannedTarget) -> wgpu::TextureUsages {
    let mut usages = wgpu::TextureUsages::empty();
    for process in plan.processes().iter().filter(|process| process.declaration.views == planned.views) {
        let accesses = process.declaration.accesses.iter();
        for (_, access) in accesses.filter(|(target, _)| *target == planned.name) {
            usages |= match access {
                Access::Sample => wgpu::TextureUsages::TEXTURE_BINDING,
                Access::Resolve(_) => wgpu::TextureUsages::RENDER_ATTACHMENT,
                access if access.is_color() || access.is_depth() => wgpu::TextureUsages::RENDER_ATTACHMENT,
                // wgpu checks what the commands of raw passes need.
                _ => wgpu::TextureUsages::empty(),
            };
        }
    }
    let samples = |(name, access): &(String, Access)| {
        *name == planned.name && matches!(access, Access::SampleView(views, _) if *views == planned.views)
    };
    if plan.processes().iter().any(|process| process.declaration.accesses.iter().any(samples)) {
        usages |= wgpu::TextureUsages::TEXTURE_BINDING;
    }
    let has_history = plan
        .targets()
        .iter()
        .any(|other| other.views == planned.views && other.copy_of.as_deref() == Some(planned.name.as_str()));
    if has_history { usages | wgpu::TextureUsages::COPY_SRC } else { usages }
}
