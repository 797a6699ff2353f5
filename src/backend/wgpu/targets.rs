//! The views' targets.

use std::sync::Arc;

use super::layouts::texture_format;
use crate::backend::BackendError;
use crate::process::{Format, FramePlan};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The targets of one view.
pub(super) struct ViewTargets {
    kind: ViewKind,
    pub(super) size: [u32; 2],
    targets: Vec<Target>,
}

/// One target.
pub(super) struct Target {
    name: String,
    pub(super) format: Format,
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
}

impl ViewTargets {
    pub(super) fn find(&self, name: &str) -> Option<&Target> {
        self.targets.iter().find(|target| target.name == name)
    }

    fn new(device: &wgpu::Device, plan: &FramePlan, view: &RenderView) -> Result<Self, BackendError> {
        let size = view.camera.size;
        let allowed = u64::from(device.limits().max_texture_dimension_2d);
        let needed = u64::from(size[0].max(size[1]));
        if needed > allowed {
            return Err(BackendError::Limit { limit: "max_texture_dimension_2d", allowed, needed });
        }
        let usual = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST;
        let planned = plan.targets().iter().filter(|target| target.views == view.kind());
        let targets = planned.map(|target| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(&target.name),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: texture_format(target.format),
                usage: if target.stored { usual | wgpu::TextureUsages::STORAGE_BINDING } else { usual },
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            Target { name: target.name.clone(), format: target.format, texture, view }
        });
        Ok(Self { kind: view.kind(), size, targets: targets.collect() })
    }
}

/// Keeps each view's targets from frame to frame, and makes new ones when its picture's size changes.
#[derive(Default)]
pub(super) struct TargetCache {
    views: Vec<Arc<ViewTargets>>,
}

impl TargetCache {
    /// # Errors
    /// If a picture is larger than the device allows.
    pub(super) fn update(
        &mut self,
        device: &wgpu::Device,
        plan: &FramePlan,
        views: &[RenderView],
    ) -> Result<Vec<Arc<ViewTargets>>, BackendError> {
        self.views.truncate(views.len());
        for (index, view) in views.iter().enumerate() {
            let fits = |targets: &Arc<ViewTargets>| (targets.size, targets.kind) == (view.camera.size, view.kind());
            match self.views.get_mut(index) {
                Some(targets) if fits(targets) => {}
                Some(targets) => *targets = Arc::new(ViewTargets::new(device, plan, view)?),
                None => self.views.push(Arc::new(ViewTargets::new(device, plan, view)?)),
            }
        }
        Ok(self.views.clone())
    }
}
