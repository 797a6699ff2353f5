//! Bundles, recorded or cached.

use super::batch_recorder::BatchRecorder;
use super::pass_encoder::PassEncoder;
use crate::backend::BackendError;
use crate::backend::subdivision_cache::SubdividedMeshes;
use crate::backend::wgpu::frame::{RecordedPart, WgpuPart};
use crate::backend::wgpu::resources::SubdividedMesh;
use crate::backend::wgpu::strategy::RecordingStrategy;

impl PassEncoder<'_> {
    /// The cached bundle at an index of a pass with one encoder, if the strategy caches bundles and this one is cached.
    pub(crate) fn cached_bundle(&self, bundle: usize) -> Option<WgpuPart> {
        let (state, list) = (self.state, self.list);
        if !self.is_cacheable(bundle) || state.strategy.encoder_count(list.bundle_count()) > 1 {
            return None;
        }
        let subdivided = self.frame.buffers.subdivided().read();
        let bundle = state.bundle_cache.get(list.bundle_slot(bundle), list.bundle(bundle), &subdivided)?;
        state.timing.count_bundle(true);
        Some(WgpuPart(RecordedPart::Bundle(bundle)))
    }

    /// Records one bundle, or reuses the cached one.
    ///
    /// # Errors
    /// If a resource of a batch is missing. This is a bug in Drawloom.
    pub(crate) fn record_bundle(&self, bundle: usize) -> Result<wgpu::RenderBundle, BackendError> {
        let (state, slot, batches) = (self.state, self.list.bundle_slot(bundle), self.list.bundle(bundle));
        let subdivided = self.frame.buffers.subdivided().read();
        if !self.is_cacheable(bundle) {
            state.timing.count_bundle(false);
            return self.new_bundle(bundle, &subdivided);
        }
        let cached = state.bundle_cache.get(slot, batches, &subdivided);
        state.timing.count_bundle(cached.is_some());
        if let Some(cached) = cached {
            return Ok(cached);
        }
        let recorded = self.new_bundle(bundle, &subdivided)?;
        state.bundle_cache.insert(slot, batches, &subdivided, recorded.clone());
        Ok(recorded)
    }

    /// Whether later frames may replay a bundle. The remaining triangles of partial batches change, so bundles with
    /// them are not cached.
    fn is_cacheable(&self, bundle: usize) -> bool {
        self.state.strategy.recording == RecordingStrategy::CachedBundles && self.list.bundle_is_whole(bundle)
    }

    fn new_bundle(
        &self,
        bundle: usize,
        subdivided: &SubdividedMeshes<SubdividedMesh>,
    ) -> Result<wgpu::RenderBundle, BackendError> {
        let (pipelines, indices) = (self.pipelines.variants(), self.state.partial_indices.read());
        let descriptor = self.pipelines.bundle_descriptor(&self.state.label);
        let mut encoder = self.device.create_render_bundle_encoder(&descriptor);
        let partial_indices = indices.buffer();
        let recorder = BatchRecorder { pass: self, pipelines: &pipelines, subdivided, partial_indices };
        recorder.draw(&mut encoder, self.list.bundle_range(bundle))?;
        Ok(encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(&self.state.label) }))
    }
}
