//! Compute passes.

use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::wgpu::frame::WgpuFrame;
use crate::process::{ComputeDispatch, Workgroups};

/// Encodes the pass of a compute shader.
///
/// # Errors
/// If a resource of the pass is missing. This is a bug in Drawloom.
pub(crate) fn encode_compute(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    index: usize,
    dispatch: &ComputeDispatch<'_>,
) -> Result<(), BackendError> {
    let pass = frame.pass(index);
    let pipeline = frame.pipelines(pass.pass).compute();
    let pipeline = pipeline.ok_or_else(|| broken_rule("a compute shader has a pipeline"))?;
    let queries = pass.timed_pass_index.and_then(|timed_pass| frame.buffers.timestamps()?.queries(timed_pass));
    let timestamp_writes = queries.map(|(query_set, [begin, end])| wgpu::ComputePassTimestampWrites {
        query_set,
        beginning_of_pass_write_index: Some(begin),
        end_of_pass_write_index: Some(end),
    });
    let descriptor = wgpu::ComputePassDescriptor { label: Some(&pass.label), timestamp_writes };
    let mut compute_pass = encoder.begin_compute_pass(&descriptor);
    compute_pass.set_pipeline(pipeline);
    compute_pass.set_bind_group(0, pass.frame_bind_group.as_ref(), &[]);
    compute_pass.set_bind_group(1, frame.buffers.materials_bind_group(), &[]);
    for (index, own) in [(2, &pass.process_bind_group), (3, &pass.engine_bind_group)] {
        if let Some(own) = own {
            compute_pass.set_bind_group(index, Some(&own.group), &[]);
        }
    }
    match dispatch.workgroups {
        Workgroups::Count([x, y, z]) => compute_pass.dispatch_workgroups(x, y, z),
        Workgroups::Indirect(offset) => {
            let buffer = frame.storage_buffers.find(offset.buffer);
            let buffer = buffer.ok_or_else(|| broken_rule("a buffer is made before it is used"))?;
            compute_pass.dispatch_workgroups_indirect(buffer, offset.bytes);
        }
    }
    Ok(())
}
