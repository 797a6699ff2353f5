//! What is kept of a pass from frame to frame: bundles, and the bindings of its process.
//!
//! Everything is compared as a whole with what it was made of, and what it was made of is held meanwhile, so nothing else
//! can come to have its identity.

use std::sync::Arc;

use parking_lot::Mutex;

use super::assets::AssetSnapshot;
use super::pipelines::ProcessPipelines;
use super::subdivided_mesh::SubdividedMesh;
use crate::backend::subdivisions::{Subdivided, SubdividedMeshes};
use crate::command::Batch;

/// What all bundles of a pass are recorded with. Pipelines know the formats of their targets; the snapshot knows where meshes
/// lie in the arenas.
#[derive(Clone)]
pub(super) struct Surroundings {
    pub(super) frame_group: wgpu::BindGroup,
    pub(super) process_group: Option<wgpu::BindGroup>,
    pub(super) assets: Arc<AssetSnapshot>,
    pub(super) pipelines: Arc<ProcessPipelines>,
}

impl PartialEq for Surroundings {
    fn eq(&self, other: &Self) -> bool {
        self.frame_group == other.frame_group
            && self.process_group == other.process_group
            && Arc::ptr_eq(&self.assets, &other.assets)
            && Arc::ptr_eq(&self.pipelines, &other.pipelines)
    }
}

/// The bundles of a pass as the latest of its frames drew them.
#[derive(Default)]
pub(super) struct KeptBundles {
    surroundings: Option<Surroundings>,
    by_place: Mutex<Vec<Option<KeptBundle>>>,
}

struct KeptBundle {
    batches: Vec<Batch>,
    /// Those of the batches that draw one, in their order.
    subdivided: Vec<Arc<Subdivided<SubdividedMesh>>>,
    bundle: wgpu::RenderBundle,
}

impl KeptBundles {
    pub(super) fn are_there(&mut self) -> bool {
        self.surroundings.is_some() && !self.by_place.get_mut().is_empty()
    }

    /// Drops everything.
    pub(super) fn forget(&mut self) {
        self.surroundings = None;
        *self.by_place.get_mut() = Vec::new();
    }

    /// Begins a frame: what was recorded with something else is dropped.
    pub(super) fn begin(&mut self, surroundings: Surroundings) {
        if self.surroundings.as_ref() != Some(&surroundings) {
            self.by_place.get_mut().clear();
            self.surroundings = Some(surroundings);
        }
    }

    /// Makes it so many, and drops those behind.
    pub(super) fn set_count(&self, bundles: usize) {
        self.by_place.lock().resize_with(bundles, || None);
    }

    /// The bundle at a place, if it draws these batches.
    pub(super) fn find(
        &self,
        place: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
    ) -> Option<wgpu::RenderBundle> {
        let by_place = self.by_place.lock();
        let kept = by_place.get(place)?.as_ref()?;
        let draws = drawn(batches, subdivided).map(Arc::as_ptr).eq(kept.subdivided.iter().map(Arc::as_ptr));
        (kept.batches == batches && draws).then(|| kept.bundle.clone())
    }

    /// Keeps a bundle in the place of the one there.
    pub(super) fn keep(
        &self,
        place: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
        bundle: wgpu::RenderBundle,
    ) {
        let drawn = drawn(batches, subdivided).cloned();
        let mut by_place = self.by_place.lock();
        let Some(slot) = by_place.get_mut(place) else { return };
        match slot {
            Some(kept) => {
                kept.batches.clear();
                kept.batches.extend_from_slice(batches);
                kept.subdivided.clear();
                kept.subdivided.extend(drawn);
                kept.bundle = bundle;
            }
            None => *slot = Some(KeptBundle { batches: batches.to_vec(), subdivided: drawn.collect(), bundle }),
        }
    }
}

fn drawn<'a>(
    batches: &'a [Batch],
    subdivided: &'a SubdividedMeshes<SubdividedMesh>,
) -> impl Iterator<Item = &'a Arc<Subdivided<SubdividedMesh>>> {
    let halved = batches.iter().filter(|batch| batch.state.subdivision_level() > 0);
    halved.filter_map(|batch| subdivided.get(&(batch.mesh, batch.state.subdivision_level())))
}

/// What a pass has at `@group(2)`: its parameters and the targets that it samples.
pub(super) struct ProcessGroup {
    pub(super) group: wgpu::BindGroup,
    pipelines: Arc<ProcessPipelines>,
    /// The buffer, and where in it they are.
    parameters: Option<(wgpu::Buffer, u64, Option<std::num::NonZeroU64>)>,
    sampled: Vec<wgpu::TextureView>,
}

impl ProcessGroup {
    /// The bindings of a pass: `before` if they still are what it needs. `None` for a process that has nothing there.
    pub(super) fn follow<'a>(
        before: Option<Self>,
        device: &wgpu::Device,
        pipelines: &Arc<ProcessPipelines>,
        parameters: Option<wgpu::BufferBinding<'a>>,
        sampled: impl Iterator<Item = &'a wgpu::TextureView> + Clone,
    ) -> Option<Self> {
        let is_same = |before: &Self| {
            let of = before.parameters.as_ref().map(|(buffer, offset, size)| (buffer, *offset, *size));
            Arc::ptr_eq(&before.pipelines, pipelines)
                && of == parameters.as_ref().map(|binding| (binding.buffer, binding.offset, binding.size))
                && before.sampled.iter().eq(sampled.clone())
        };
        if let Some(before) = before.filter(is_same) {
            return Some(before);
        }
        let held = parameters.as_ref().map(|binding| (binding.buffer.clone(), binding.offset, binding.size));
        let group = pipelines.process_group(device, parameters, sampled.clone())?;
        Some(Self { group, pipelines: Arc::clone(pipelines), parameters: held, sampled: sampled.cloned().collect() })
    }
}
