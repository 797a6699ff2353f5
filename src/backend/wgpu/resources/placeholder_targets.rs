//! What passes sample in place of views that the frame does not have.

use super::target_texture::{TextureKind, new_texture, new_views};
use super::view_array::shape_descriptor;
use crate::backend::BackendError;
use crate::process::{Access, Format, FramePlan, PlannedTarget, SampledShape};

/// Pixels of zeros: one for each kind of target of other views that a plan's processes sample.
#[derive(Clone, Default)]
pub(super) struct PlaceholderTargets(Vec<Placeholder>);

/// A pixel of zeros, of this format and number of samples, and of as many layers as the shape says.
#[derive(Clone)]
struct Placeholder {
    format: Format,
    multisampled: bool,
    shape: SampledShape,
    texture: wgpu::TextureView,
}

impl PlaceholderTargets {
    /// The placeholder of a target.
    pub(super) fn find(&self, planned: &PlannedTarget, shape: SampledShape) -> Option<&wgpu::TextureView> {
        self.position(planned, shape).map(|position| &self.0[position].texture)
    }

    fn position(&self, planned: &PlannedTarget, shape: SampledShape) -> Option<usize> {
        let wanted = (planned.format, planned.multisampled, shape);
        self.0.iter().position(|known| (known.format, known.multisampled, known.shape) == wanted)
    }

    /// Those of a plan: known ones where there are some.
    ///
    /// # Errors
    /// If the device cannot have a texture.
    pub(super) fn updated(&self, device: &wgpu::Device, plan: &FramePlan) -> Result<Self, BackendError> {
        let mut updated = Self::default();
        for process in plan.processes() {
            for &(target, access) in &process.targets.accesses {
                let (Access::SampleView(_, index) | Access::SampleViewPrevious(_, index)) = access else { continue };
                let planned = &plan.targets()[target];
                let shape = process.declaration.sampled_views[index].shape;
                if updated.find(planned, shape).is_some() {
                    continue;
                }
                let placeholder = match self.position(planned, shape) {
                    Some(known) => self.0[known].clone(),
                    // wgpu clears a texture before it is first read.
                    None => {
                        let kind = TextureKind { size: [1, 1], ..TextureKind::of(planned, [1, 1]) };
                        let texture = new_texture(device, &planned.name, kind, shape.view_count())?;
                        let (_, texture) = new_views(&texture, planned.format, &shape_descriptor(shape));
                        let PlannedTarget { format, multisampled, .. } = *planned;
                        Placeholder { format, multisampled, shape, texture }
                    }
                };
                updated.0.push(placeholder);
            }
        }
        Ok(updated)
    }
}
