//! Textures of the engine's own that take the place of targets.

use super::bind_group_layouts::texture_format;
use crate::backend::BackendError;
use crate::process::{Access, FramePlan, PlannedTarget};

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

    /// What is missing or wrong.
    pub(super) fn refused(&self, problem: impl Into<String>) -> BackendError {
        let (view, target) = (self.view.clone(), self.target.clone());
        BackendError::ImportedTarget { view, target, problem: problem.into() }
    }

    /// Checks that a view's target can be this texture.
    ///
    /// # Errors
    /// If it differs in what the frame needs of it.
    pub(super) fn check(
        &self,
        plan: &FramePlan,
        planned: &PlannedTarget,
        [width, height]: [u32; 2],
    ) -> Result<(), BackendError> {
        if planned.layered || planned.copy_of.is_some() || planned.multisampled {
            return Err(self.refused("that target is shared by views, a history, or has several samples a pixel"));
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
        if self.texture.dimension() != wgpu::TextureDimension::D2 || samples != 1 {
            return Err(
                self.refused(format!("the texture is not a plain 2D texture: it has {samples} samples a pixel"))
            );
        }
        let missing = needed_usages(plan, planned) - self.texture.usage();
        if missing.is_empty() {
            return Ok(());
        }
        Err(self.refused(format!("the texture lacks the usage {missing:?}, which the frame's processes need")))
    }

    /// The view of the texture that has the target's format.
    pub(super) fn view_descriptor(planned: &PlannedTarget) -> wgpu::TextureViewDescriptor<'static> {
        wgpu::TextureViewDescriptor {
            format: Some(texture_format(planned.format)),
            mip_level_count: Some(1),
            ..wgpu::TextureViewDescriptor::default()
        }
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
                access if access.is_color() || access.is_depth() => wgpu::TextureUsages::RENDER_ATTACHMENT,
                // wgpu checks what the commands of raw passes need.
                _ => wgpu::TextureUsages::empty(),
            };
        }
    }
    let has_history = plan
        .targets()
        .iter()
        .any(|other| other.views == planned.views && other.copy_of.as_deref() == Some(planned.name.as_str()));
    if has_history { usages | wgpu::TextureUsages::COPY_SRC } else { usages }
}
