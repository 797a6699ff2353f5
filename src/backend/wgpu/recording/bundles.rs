//! Bundles, recorded or cached.

use super::batch_recorder::BatchRecorder;
use crate::backend::BackendError;
use crate::backend::subdivision_cache::SubdividedMeshes;
use crate::backend::wgpu::frame::{RecordedPart, WgpuFrame, WgpuPart, WgpuPassState};
use crate::backend::wgpu::resources::SubdividedMesh;
use crate::backend::wgpu::strategy::RecordingStrategy;
use crate::command::DrawList;

/// The cached bundle at an index of a pass with one encoder, if the strategy caches bundles and this one is cached.
pub(crate) fn cached_bundle(frame: &WgpuFrame, pass: usize, list: &DrawList, bundle: usize) -> Option<WgpuPart> {
    let pass = frame.pass(pass);
    if !is_cacheable(pass, list, bundle) || pass.strategy.encoder_count(list.bundle_count()) > 1 {
        return None;
    }
    let bundle =
        pass.bundle_cache.get(list.bundle_slot(bundle), list.bundle(bundle), &frame.buffers.subdivided().read())?;
    pass.timing.count_bundle(true);
    Some(WgpuPart(RecordedPart::Bundle(bundle)))
}

/// Records one bundle of a pass, or reuses the cached one.
///
/// # Errors
/// If a resource of a batch is missing. This is a bug in Drawloom.
pub(crate) fn record_bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: usize,
    list: &DrawList,
    bundle: usize,
) -> Result<wgpu::RenderBundle, BackendError> {
    let (pass, batches) = (frame.pass(pass), list.bundle(bundle));
    let subdivided = frame.buffers.subdivided().read();
    if !is_cacheable(pass, list, bundle) {
        pass.timing.count_bundle(false);
        return new_bundle(device, frame, pass, list, bundle, &subdivided);
    }
    let cached = pass.bundle_cache.get(list.bundle_slot(bundle), batches, &subdivided);
    pass.timing.count_bundle(cached.is_some());
    if let Some(cached) = cached {
        return Ok(cached);
    }
    let recorded = new_bundle(device, frame, pass, list, bundle, &subdivided)?;
    pass.bundle_cache.insert(list.bundle_slot(bundle), batches, &subdivided, recorded.clone());
    Ok(recorded)
}

/// Whether later frames may replay a bundle. The remaining triangles of partial batches change, so bundles with them
/// are not cached.
fn is_cacheable(pass: &WgpuPassState, list: &DrawList, bundle: usize) -> bool {
    pass.strategy.recording == RecordingStrategy::CachedBundles && list.bundle_is_whole(bundle)
}

fn new_bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &WgpuPassState,
    list: &DrawList,
    bundle: usize,
    subdivided: &SubdividedMeshes<SubdividedMesh>,
) -> Result<wgpu::RenderBundle, BackendError> {
    let pipelines = frame.pipelines(pass.pass);
    let variants = pipelines.variants();
    let mut encoder = device.create_render_bundle_encoder(&pipelines.bundle_descriptor(&pass.label));
    let indices = pass.partial_indices.read();
    let partial_indices = indices.buffer();
    let recorder = BatchRecorder { frame, pass, list, pipelines: &variants, subdivided, partial_indices };
    let batches = list.bundle_range(bundle);
    recorder.draw(&mut encoder, batches)?;
    Ok(encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(&pass.label) }))
}
