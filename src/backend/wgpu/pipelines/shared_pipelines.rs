//! What is compiled once for all processes that give wgpu the same.

use std::sync::Arc;

use super::interner::{Interner, Shared};
use super::vertex_buffers::VertexBuffers;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::backend::wgpu::resources::BindGroupLayouts;

/// What is compiled on a device: shader modules by their complete text, and layouts and pipelines by all that wgpu is
/// told of them. It goes with the last process that uses it, except in a [library](crate::backend::PipelineLibrary).
/// Clones are the same.
///
/// All that is shared is what the device has accepted: an error is reported to each process that asks.
#[derive(Clone)]
pub(crate) struct SharedPipelines(Arc<Compiled>);

struct Compiled {
    group_layouts: Interner<Vec<wgpu::BindGroupLayoutEntry>, wgpu::BindGroupLayout>,
    layouts: Interner<OwnGroups, wgpu::PipelineLayout>,
    modules: Interner<String, wgpu::ShaderModule>,
    render: Interner<RenderPipelineDescription, wgpu::RenderPipeline>,
    compute: Interner<(wgpu::PipelineLayout, wgpu::ShaderModule), wgpu::ComputePipeline>,
}

/// Of `@group(2)` and `@group(3)`. The other groups have the same layouts for all processes of a device.
type OwnGroups = [Option<wgpu::BindGroupLayout>; 2];

pub(crate) type SharedGroupLayout = Shared<Vec<wgpu::BindGroupLayoutEntry>, wgpu::BindGroupLayout>;
pub(super) type SharedLayout = Shared<OwnGroups, wgpu::PipelineLayout>;
pub(super) type SharedModule = Shared<String, wgpu::ShaderModule>;
pub(crate) type SharedRenderPipeline = Shared<RenderPipelineDescription, wgpu::RenderPipeline>;
pub(super) type SharedComputePipeline = Shared<(wgpu::PipelineLayout, wgpu::ShaderModule), wgpu::ComputePipeline>;

/// All that wgpu is told of a render pipeline.
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct RenderPipelineDescription {
    pub(super) layout: wgpu::PipelineLayout,
    pub(super) module: wgpu::ShaderModule,
    /// The vertex entry point.
    pub(super) vertex: String,
    pub(super) buffers: VertexBuffers,
    pub(super) primitive: wgpu::PrimitiveState,
    pub(super) depth_stencil: Option<wgpu::DepthStencilState>,
    /// The number of samples of a pixel.
    pub(super) samples: u32,
    /// Whether alpha decides how many of them are covered.
    pub(super) alpha_to_coverage: bool,
    /// The fragment entry point, and the colour targets.
    pub(super) fragment: Option<(String, Vec<Option<wgpu::ColorTargetState>>)>,
}

impl SharedPipelines {
    /// Nothing yet. If it `keeps` what is compiled, that stays until it is [cleared](Self::clear).
    pub(crate) fn new(keeps: bool) -> Self {
        Self(Arc::new(Compiled {
            group_layouts: Interner::new(keeps),
            layouts: Interner::new(keeps),
            modules: Interner::new(keeps),
            render: Interner::new(keeps),
            compute: Interner::new(keeps),
        }))
    }

    /// The layout of a bind group; `None` if it has no entries. Errors are those of `label`.
    ///
    /// # Errors
    /// If the device refuses it.
    pub(super) fn group_layout(
        &self,
        device: &wgpu::Device,
        label: &str,
        entries: Vec<wgpu::BindGroupLayoutEntry>,
    ) -> Result<Option<SharedGroupLayout>, BackendError> {
        if entries.is_empty() {
            return Ok(None);
        }
        let make = |entries: &Vec<_>| {
            let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("process"), entries };
            with_error_scope(device, label, || device.create_bind_group_layout(&descriptor))
        };
        self.0.group_layouts.get_or_make(entries, make).map(Some)
    }

    /// The layout of the pipelines of a process with these bind groups of its own.
    ///
    /// # Errors
    /// If the device refuses it.
    pub(super) fn layout(
        &self,
        device: &wgpu::Device,
        label: &str,
        layouts: &BindGroupLayouts,
        own: OwnGroups,
    ) -> Result<SharedLayout, BackendError> {
        self.0.layouts.get_or_make(own, |own| {
            let groups = [Some(&layouts.frame), Some(&layouts.assets), own[0].as_ref(), own[1].as_ref()];
            let used = 2 + own.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
            let descriptor = wgpu::PipelineLayoutDescriptor {
                label: Some("process"),
                bind_group_layouts: &groups[..used],
                immediate_size: 0,
            };
            with_error_scope(device, label, || device.create_pipeline_layout(&descriptor))
        })
    }

    /// The shader module of a complete text, which `compile` compiles.
    ///
    /// # Errors
    /// If it does not compile.
    pub(super) fn module(
        &self,
        text: String,
        compile: impl FnOnce(&str) -> Result<wgpu::ShaderModule, BackendError>,
    ) -> Result<SharedModule, BackendError> {
        self.0.modules.get_or_make(text, |text| compile(text))
    }

    /// # Errors
    /// If the device refuses the pipeline.
    pub(super) fn render_pipeline(
        &self,
        device: &wgpu::Device,
        label: &str,
        description: RenderPipelineDescription,
    ) -> Result<SharedRenderPipeline, BackendError> {
        self.0.render.get_or_make(description, |description| {
            let RenderPipelineDescription { layout, module, vertex, buffers, fragment, .. } = description;
            let descriptor = wgpu::RenderPipelineDescriptor {
                label: None,
                layout: Some(layout),
                vertex: wgpu::VertexState {
                    module,
                    entry_point: Some(vertex),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &buffers.layouts(),
                },
                primitive: description.primitive,
                depth_stencil: description.depth_stencil.clone(),
                multisample: wgpu::MultisampleState {
                    count: description.samples,
                    alpha_to_coverage_enabled: description.alpha_to_coverage,
                    ..wgpu::MultisampleState::default()
                },
                fragment: fragment.as_ref().map(|(entry_point, targets)| wgpu::FragmentState {
                    module,
                    entry_point: Some(entry_point),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets,
                }),
                multiview_mask: None,
                cache: None,
            };
            with_error_scope(device, label, || device.create_render_pipeline(&descriptor))
        })
    }

    /// The pipeline of a compute shader.
    ///
    /// # Errors
    /// If the device refuses it.
    pub(super) fn compute_pipeline(
        &self,
        device: &wgpu::Device,
        label: &str,
        layout: &SharedLayout,
        module: &SharedModule,
    ) -> Result<SharedComputePipeline, BackendError> {
        let key = (wgpu::PipelineLayout::clone(layout), wgpu::ShaderModule::clone(module));
        self.0.compute.get_or_make(key, |(layout, module)| {
            let descriptor = wgpu::ComputePipelineDescriptor {
                label: None,
                layout: Some(layout),
                module,
                entry_point: Some("compute"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            };
            with_error_scope(device, label, || device.create_compute_pipeline(&descriptor))
        })
    }

    /// Drops what it keeps.
    pub(crate) fn clear(&self) {
        let Compiled { group_layouts, layouts, modules, render, compute } = &*self.0;
        group_layouts.clear();
        layouts.clear();
        modules.clear();
        render.clear();
        compute.clear();
    }

    /// The number of pipelines that it keeps.
    pub(crate) fn kept_pipeline_count(&self) -> usize {
        self.0.render.kept_count() + self.0.compute.kept_count()
    }
}
