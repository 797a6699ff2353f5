//! The bind groups of a pass that its process determines.

use super::frame::{PassResources, WgpuPassState};
use super::pipelines::ProcessPipelines;
use super::resources::{BindingResource, CachedBindGroup, StorageBuffers, WgpuTargets};
use crate::backend::error::broken_rule;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Access, Pass, PlannedProcess, ShaderResource};

/// Updates `@group(2)` and `@group(3)` of a pass: makes them anew if something else is to be bound.
///
/// # Errors
/// If the device refuses a resource of the engine's, or a target is missing. The latter is a bug in Drawloom.
pub(super) fn update_bind_groups(
    device: &wgpu::Device,
    request: &FrameRequest<'_>,
    pipelines: &ProcessPipelines,
    (targets, buffers): (&WgpuTargets, &StorageBuffers),
    resources: &PassResources<'_>,
    pass: &mut WgpuPassState,
) -> Result<(), BackendError> {
    let Pass { process_index: process, view_index: view } = pass.pass;
    let PlannedProcess { declaration, targets: used, .. } = &request.plan.processes()[process];

    let parameters = pass.parameter_bytes().and_then(|bytes| resources.parameters.binding(bytes.start, bytes.len()));
    let parameters = parameters.map(|binding| (0, BindingResource::Buffer(binding)));
    let sampled = |&(target, access): &(usize, Access)| match access {
        Access::Sample | Access::SamplePrevious => targets.get(view, target).map(|target| &target.sampled),
        Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
            let views = request.sampled_views.find(pass.pass, index);
            let planned = (target, &request.plan.targets()[target]);
            targets.find_sampled(views, planned, declaration.sampled_views[index].shape)
        }
        Access::SampleLayers(_) => targets.layered(target).map(|(_, array)| array),
        _ => None,
    };
    let sampled = used.accesses.iter().filter_map(sampled);
    let samples = declaration.samples().count();
    if sampled.clone().count() != samples {
        return Err(broken_rule("a frame has the targets that its passes sample"));
    }
    let sampled = (1..).zip(sampled.map(BindingResource::Texture));
    let (before, layout) = (pass.process_bind_group.take(), pipelines.process_layout.as_ref());
    let shared = declaration.bound_buffers().filter_map(|(buffer, _)| buffers.find(buffer));
    let shared = shared.map(|buffer| BindingResource::Buffer(buffer.as_entire_buffer_binding()));
    let bound = parameters.into_iter().chain(sampled).chain((1 + samples as u32..).zip(shared));
    pass.process_bind_group = CachedBindGroup::update(before, device, &pass.label, layout, bound)?;

    let columns = declaration.columns.iter().filter_map(|column| resources.objects.column(*column));
    let draws = &request.draws[process];
    let mut bytes = resources.bytes.of_process(process);
    let materials: Vec<_> =
        bytes.by_ref().take(declaration.material_types.len()).map(BindingResource::Buffer).collect();
    let own = draws.resources().iter().filter_map(move |resource| match resource {
        ShaderResource::Bytes(_) | ShaderResource::SharedBytes(_) => bytes.next().map(BindingResource::Buffer),
        ShaderResource::Buffer(buffer) => Some(BindingResource::Buffer(buffer.as_entire_buffer_binding())),
        ShaderResource::Texture { view, .. } => Some(BindingResource::Texture(view)),
        ShaderResource::TextureOfView { views, other, .. } => {
            let of_view = views.iter().find(|(name, _)| name == request.views[view].name());
            Some(BindingResource::Texture(of_view.map_or(other, |(_, texture)| texture)))
        }
        ShaderResource::Sampler { sampler, .. } => Some(BindingResource::Sampler(sampler)),
    });
    let (before, layout) = (pass.engine_bind_group.take(), pipelines.engine_layout.as_ref());
    let bound = (0..).zip(columns.map(BindingResource::Buffer).chain(materials).chain(own));
    pass.engine_bind_group = CachedBindGroup::update(before, device, &pass.label, layout, bound)?;
    Ok(())
}
