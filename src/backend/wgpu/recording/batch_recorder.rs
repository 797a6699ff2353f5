//! Recording of batches into a pass or a bundle; bundles are recorded or cached.

use std::collections::HashMap;
use std::mem;
use std::ops::Range;

use wgpu::util::RenderEncoder;

use super::pass_encoder::PassEncoder;
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::subdivision_cache::{SubdividedMeshes, missing_mesh_error, subdivision_of};
use crate::backend::wgpu::frame::{RecordedPart, WgpuPart};
use crate::backend::wgpu::pipelines::{PipelineVariant, SharedRenderPipeline};
use crate::backend::wgpu::resources::{MeshPageIndices, SubdividedMesh, attribute_of};
use crate::backend::wgpu::strategy::{PassSegment, RecordingStrategy};
use crate::command::Batch;

impl PassEncoder<'_> {
    /// Records the batches of a segment directly into the pass.
    ///
    /// # Errors
    /// If a resource of the pass is missing. This is a bug in Drawloom.
    pub(super) fn record_batches(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        segment: PassSegment,
        bundles: Range<usize>,
    ) -> Result<(), BackendError> {
        let pipelines = self.pipelines.variants();
        let subdivided = self.frame.buffers.subdivided().read();
        let indices = self.state.partial_indices.read();
        let partial_indices = indices.buffer();
        let recorder = BatchRecorder { pass: self, pipelines: &pipelines, subdivided: &subdivided, partial_indices };
        let batches = match bundles.clone().next_back() {
            Some(last) => self.list.bundle_range(bundles.start).start..self.list.bundle_range(last).end,
            None => 0..0,
        };
        let mut render_pass = self.begin(encoder, segment)?;
        if batches.is_empty() { Ok(()) } else { recorder.draw(&mut render_pass, batches) }
    }
}

/// Records the batches of a pass.
pub(super) struct BatchRecorder<'a> {
    pub(super) pass: &'a PassEncoder<'a>,
    pub(super) pipelines: &'a HashMap<PipelineVariant, SharedRenderPipeline>,
    pub(super) subdivided: &'a SubdividedMeshes<SubdividedMesh>,
    /// The indices of partial batches' remaining triangles.
    pub(super) partial_indices: Option<&'a wgpu::Buffer>,
}

impl<'a> BatchRecorder<'a> {
    /// Draws a range of the list's batches. State that does not change between batches is set once. Batches whose
    /// meshes are not on the device draw nothing.
    ///
    /// # Errors
    /// If a resource of a batch is missing. This is a bug in Drawloom.
    pub(super) fn draw(&self, encoder: &mut impl RenderEncoder<'a>, batches: Range<usize>) -> Result<(), BackendError> {
        self.pass.bind_groups().for_each(|(index, group)| encoder.set_bind_group(index, Some(group), &[]));
        let (mut bound, mut texture_set) = (None, 0);
        let mut start = batches.start;
        let meshes = &self.pass.frame.meshes;
        for run in self.pass.list.batches[batches].chunk_by(|one, next| meshes.share_pipeline(one, next)) {
            let variant = PipelineVariant::of_batch(meshes, &run[0]).clamping(self.pass.state.clamps_depth);
            let end = start + run.len();
            let Some(pipeline) = self.pipelines.get(&variant) else {
                if !self.pass.pipelines.is_unreadable(&variant) {
                    return Err(broken_rule("a pipeline is created before it is used"));
                }
                start = end;
                continue;
            };
            encoder.set_pipeline(pipeline);
            let set = run[0].state.texture_set();
            if mem::replace(&mut texture_set, set) != set {
                let materials = self.pass.frame.buffers.materials_bind_groups().get(set as usize);
                let materials = materials.ok_or_else(|| broken_rule("a set of textures is bound before it is used"))?;
                encoder.set_bind_group(1, Some(materials), &[]);
            }
            if variant.layout.is_some() {
                self.draw_imported_meshes(encoder, run)?;
                bound = None;
            } else if run[0].state.subdivision_level() > 0 {
                self.draw_subdivided(encoder, run)?;
                bound = None;
            } else if meshes.has_one_page() {
                self.draw_in_pages(encoder, start..end, &mut bound)?;
            } else {
                let mut first = start;
                for in_same_pages in run.chunk_by(|one, next| meshes.pages(one) == meshes.pages(next)) {
                    let next = first + in_same_pages.len();
                    self.draw_in_pages(encoder, first..next, &mut bound)?;
                    first = next;
                }
            }
            start = end;
        }
        Ok(())
    }

    /// Draws batches of one state whose meshes are in the same pages. `bound` are the pages whose buffers are set.
    fn draw_in_pages(
        &self,
        encoder: &mut impl RenderEncoder<'a>,
        batches: Range<usize>,
        bound: &mut Option<MeshPageIndices>,
    ) -> Result<(), BackendError> {
        let Some(pages) = self.pass.frame.meshes.pages(&self.pass.list.batches[batches.start]) else {
            // An error unless it is yet to arrive.
            return self.pass.frame.meshes.mesh_range(&self.pass.list.batches[batches.start]).map(|_| ());
        };
        if *bound != Some(pages) {
            self.set_pages(encoder, pages)?;
            *bound = Some(pages);
        }
        if self.pass.list.is_whole() {
            self.draw_each(encoder, batches)
        } else {
            self.draw_with_partial(encoder, pages, batches)
        }
    }

    /// Draws batches of one state, some of them partial, whose meshes are in these pages.
    fn draw_with_partial(
        &self,
        encoder: &mut impl RenderEncoder<'a>,
        pages: MeshPageIndices,
        batches: Range<usize>,
    ) -> Result<(), BackendError> {
        let mut whole = batches.start..batches.start;
        let mut binds_partial_indices = false;
        for index in batches {
            let Some(remaining) = self.pass.frame.meshes.remaining(self.pass.list, index) else {
                whole.end = index + 1;
                continue;
            };
            if !whole.is_empty() {
                if mem::take(&mut binds_partial_indices) {
                    self.set_index_page(encoder, pages)?;
                }
                self.draw_each(encoder, whole)?;
            }
            whole = index + 1..index + 1;
            if remaining.is_empty() {
                continue;
            }
            if !mem::replace(&mut binds_partial_indices, true) {
                let indices = self.partial_indices;
                let indices = indices.ok_or_else(|| broken_rule("indices are uploaded before they are used"))?;
                encoder.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            }
            let batch = &self.pass.list.batches[index];
            if let Some(mesh) = self.pass.frame.meshes.mesh_range(batch)? {
                encoder.draw_indexed(remaining, mesh.base_vertex, batch.first..batch.first + batch.count);
            }
        }
        if binds_partial_indices {
            self.set_index_page(encoder, pages)?;
        }
        if whole.is_empty() { Ok(()) } else { self.draw_each(encoder, whole) }
    }

    /// Draws each of these whole batches with a draw call of its own.
    fn draw_each(&self, encoder: &mut impl RenderEncoder<'a>, batches: Range<usize>) -> Result<(), BackendError> {
        for batch in &self.pass.list.batches[batches] {
            if let Some(mesh) = self.pass.frame.meshes.mesh_range(batch)? {
                let indices = mesh.first_index..mesh.first_index + mesh.index_count;
                encoder.draw_indexed(indices, mesh.base_vertex, batch.first..batch.first + batch.count);
            }
        }
        Ok(())
    }

    fn draw_subdivided(&self, encoder: &mut impl RenderEncoder<'a>, run: &[Batch]) -> Result<(), BackendError> {
        for batch in run {
            let mesh = self.subdivided.get(&subdivision_of(batch));
            let mesh = mesh.ok_or_else(|| broken_rule("a mesh is subdivided before it is drawn"))?;
            let Some(mesh) = &mesh.geometry else { continue };
            encoder.set_vertex_buffer(0, Some(mesh.vertices.slice(..)));
            for (slot, attribute) in (1..).zip(self.pass.pipelines.attributes()) {
                encoder.set_vertex_buffer(slot, Some(attribute_of(&mesh.attributes, attribute.layout)?.slice(..)));
            }
            encoder.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            encoder.draw_indexed(0..mesh.index_count, 0, batch.first..batch.first + batch.count);
        }
        Ok(())
    }

    /// Draws meshes in the engine's own buffers.
    fn draw_imported_meshes(&self, encoder: &mut impl RenderEncoder<'a>, run: &[Batch]) -> Result<(), BackendError> {
        let pipelines = self.pass.pipelines;
        let defaults = pipelines.attribute_defaults();
        let defaults = defaults.ok_or_else(|| broken_rule("attributes have defaults before they are drawn"))?;
        let meshes = &self.pass.frame.meshes.imported_meshes;
        for batch in run {
            let mesh = meshes.get(batch.mesh).ok_or_else(missing_mesh_error)?;
            mesh.set_buffers(encoder, pipelines.attributes(), defaults);
            let instances = batch.first..batch.first + batch.count;
            match &mesh.buffers.indices {
                Some(indices) => encoder.draw_indexed(0..indices.count, 0, instances),
                None => encoder.draw(0..mesh.buffers.vertex_count, instances),
            }
        }
        Ok(())
    }

    fn set_pages(&self, encoder: &mut impl RenderEncoder<'a>, pages: MeshPageIndices) -> Result<(), BackendError> {
        let buffers = self.pass.frame.meshes.vertex_buffers(pages)?;
        encoder.set_vertex_buffer(0, Some(buffers.vertices.slice(..)));
        for (slot, attribute) in (1..).zip(self.pass.pipelines.attributes()) {
            encoder.set_vertex_buffer(slot, Some(attribute_of(&buffers.attributes, attribute.layout)?.slice(..)));
        }
        self.set_index_page(encoder, pages)
    }

    fn set_index_page(&self, encoder: &mut impl RenderEncoder<'a>, pages: MeshPageIndices) -> Result<(), BackendError> {
        encoder.set_index_buffer(self.pass.frame.meshes.index_buffer(pages)?.slice(..), wgpu::IndexFormat::Uint32);
        Ok(())
    }
}

impl PassEncoder<'_> {
    /// The cached bundle at an index of a pass with one encoder, if the strategy caches bundles and this one is cached.
    ///
    /// # Errors
    /// With debug assertions, if the versions of its items do not say that they changed.
    pub(crate) fn cached_bundle(&self, bundle: usize) -> Result<Option<WgpuPart>, BackendError> {
        let (state, list) = (self.state, self.list);
        if state.draws_items && state.strategy.encoder_count(list.bundle_count()) == 1 {
            return Ok(self.cached_items(bundle)?.map(|bundle| WgpuPart(RecordedPart::Bundle(bundle))));
        }
        if !self.is_cacheable(bundle) || state.strategy.encoder_count(list.bundle_count()) > 1 {
            return Ok(None);
        }
        let subdivided = self.frame.buffers.subdivided().read();
        let cached = state.bundle_cache.get(list.bundle_slot(bundle), list.bundle(bundle), &subdivided);
        let Some(bundle) = cached else { return Ok(None) };
        state.timing.count_bundle(true);
        Ok(Some(WgpuPart(RecordedPart::Bundle(bundle))))
    }

    /// Records one bundle, or reuses the cached one.
    ///
    /// # Errors
    /// If a resource of a batch is missing. This is a bug in Drawloom.
    pub(crate) fn record_bundle(&self, bundle: usize) -> Result<wgpu::RenderBundle, BackendError> {
        if self.state.draws_items {
            return self.record_item_bundle(bundle);
        }
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
        let caches = self.state.strategy.recording == RecordingStrategy::CachedBundles;
        caches && !self.state.draws_items && self.list.bundle_is_whole(bundle)
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
