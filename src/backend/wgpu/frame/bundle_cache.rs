//! The cache of a pass's bundles, kept from frame to frame.
//!
//! A bundle's inputs are compared as a whole. The cache keeps them alive, so that no other object can get their
//! identity.

use std::sync::Arc;

use parking_lot::Mutex;

use crate::backend::subdivision_cache::{CachedSubdivision, SubdividedMeshes, subdivision_of};
use crate::backend::wgpu::pipelines::ProcessPipelines;
use crate::backend::wgpu::resources::SubdividedMesh;
use crate::command::Batch;

/// The inputs that all bundles of a pass have in common. Pipelines determine the formats of targets; the snapshot
/// determines the meshes' ranges in their pages.
#[derive(Clone)]
pub(crate) struct BundleKey {
    pub(crate) frame_bind_group: wgpu::BindGroup,
    pub(crate) materials_bind_group: wgpu::BindGroup,
    pub(crate) process_bind_group: Option<wgpu::BindGroup>,
    pub(crate) engine_bind_group: Option<wgpu::BindGroup>,
    /// The number of the snapshot. The bundles keep the pages that they draw from, but do not keep them from being
    /// overwritten: they are not replayed with another snapshot.
    pub(crate) meshes: u64,
    pub(crate) pipelines: Arc<ProcessPipelines>,
    /// See [`WgpuPassState`](super::WgpuPassState).
    pub(crate) clamps_depth: bool,
}

impl PartialEq for BundleKey {
    fn eq(&self, other: &Self) -> bool {
        self.frame_bind_group == other.frame_bind_group
            && self.materials_bind_group == other.materials_bind_group
            && self.process_bind_group == other.process_bind_group
            && self.engine_bind_group == other.engine_bind_group
            && (self.meshes, self.clamps_depth) == (other.meshes, other.clamps_depth)
            && Arc::ptr_eq(&self.pipelines, &other.pipelines)
    }
}

/// The bundles of a pass, as the latest frame with these buffers drew them.
#[derive(Default)]
pub(crate) struct BundleCache {
    key: Option<BundleKey>,
    bundles: Mutex<Vec<Option<CachedBundle>>>,
}

struct CachedBundle {
    batches: Vec<Batch>,
    /// The subdivided meshes that the batches draw, in order.
    subdivided: Vec<Arc<CachedSubdivision<SubdividedMesh>>>,
    bundle: wgpu::RenderBundle,
}

impl BundleCache {
    /// Whether an earlier frame has left bundles.
    pub(crate) fn is_warm(&mut self) -> bool {
        self.key.is_some() && !self.bundles.get_mut().is_empty()
    }

    /// Drops everything.
    pub(crate) fn clear(&mut self) {
        self.key = None;
        *self.bundles.get_mut() = Vec::new();
    }

    /// Begins a frame: drops all bundles if the key changed.
    pub(crate) fn begin_frame(&mut self, key: BundleKey) {
        if self.key.as_ref() != Some(&key) {
            self.bundles.get_mut().clear();
            self.key = Some(key);
        }
    }

    /// Makes room for this many bundles, and drops further ones.
    pub(crate) fn set_bundle_count(&self, bundles: usize) {
        self.bundles.lock().resize_with(bundles, || None);
    }

    /// The bundle at an index, if it draws these batches.
    pub(crate) fn get(
        &self,
        index: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
    ) -> Option<wgpu::RenderBundle> {
        let bundles = self.bundles.lock();
        let cached = bundles.get(index)?.as_ref()?;
        let draws_same =
            drawn_subdivisions(batches, subdivided).map(Arc::as_ptr).eq(cached.subdivided.iter().map(Arc::as_ptr));
        (cached.batches == batches && draws_same).then(|| cached.bundle.clone())
    }

    /// Replaces the bundle at an index.
    pub(crate) fn insert(
        &self,
        index: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
        bundle: wgpu::RenderBundle,
    ) {
        let subdivisions = drawn_subdivisions(batches, subdivided).cloned();
        let mut bundles = self.bundles.lock();
        let Some(slot) = bundles.get_mut(index) else { return };
        match slot {
            Some(cached) => {
                cached.batches.clear();
                cached.batches.extend_from_slice(batches);
                cached.subdivided.clear();
                cached.subdivided.extend(subdivisions);
                cached.bundle = bundle;
            }
            None => {
                *slot = Some(CachedBundle { batches: batches.to_vec(), subdivided: subdivisions.collect(), bundle })
            }
        }
    }
}

fn drawn_subdivisions<'a>(
    batches: &'a [Batch],
    subdivided: &'a SubdividedMeshes<SubdividedMesh>,
) -> impl Iterator<Item = &'a Arc<CachedSubdivision<SubdividedMesh>>> {
    let subdivided_batches = batches.iter().filter(|batch| batch.state.subdivision_level() > 0);
    subdivided_batches.filter_map(|batch| subdivided.get(&subdivision_of(batch)))
}
