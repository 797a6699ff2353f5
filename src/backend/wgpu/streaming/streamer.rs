//! What a frame has on the device, what comes next, and what makes room for it (M 10.3).

use std::collections::BinaryHeap;
use std::sync::Arc;

use parking_lot::Mutex;

use super::budget::StreamingBudget;
use super::frame_use::FrameUse;
use super::mesh_upload::MeshUpload;
use super::request::{Request, Requested};
use super::statistics::StreamingStatistics;
use super::texture_upload::TextureUpload;
use super::upload_jobs::{Upload, UploadJobs};
use super::uses::Uses;
use crate::backend::wgpu::resources::{MaterialCache, MaterialSnapshot, MeshCache, MeshSnapshot, Room, UploadQueue};
use crate::backend::{BackendError, FrameRequest};
use crate::scene::Assets;

/// Brings meshes and textures to the device by background jobs, within a budget.
///
/// A frame that begins takes over what jobs have uploaded since the frame before, evicts what was used longest ago, and adds to the jobs
/// what is missing: first what the latest frame would have drawn, then the rest, both by priority. It uploads nothing itself, but for meshes
/// that replace others.
pub(crate) struct Streamer {
    pub(crate) budget: StreamingBudget,
    jobs: UploadJobs,
    /// Of the frame that began last.
    latest: Mutex<Latest>,
}

#[derive(Default)]
struct Latest {
    frame_use: FrameUse,
    statistics: StreamingStatistics,
}

/// What a frame begins with.
pub(crate) struct StreamedResources {
    pub(crate) meshes: Arc<MeshSnapshot>,
    pub(crate) materials: MaterialSnapshot,
    pub(crate) frame_use: FrameUse,
}

/// The device, and what is on it.
pub(crate) struct OnDevice<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) uploads: &'a UploadQueue,
    pub(crate) meshes: &'a mut MeshCache,
    pub(crate) materials: &'a mut MaterialCache,
}

impl OnDevice<'_> {
    /// Drops what is gone.
    ///
    /// # Errors
    /// If the device has no room for what was replaced.
    fn begin_frame(&mut self, request: &FrameRequest<'_>, mesh_budget: u64) -> Result<(), BackendError> {
        let (assets, used, vertices) = (request.scene.assets, request.objects.used_meshes(), request.quality.vertices);
        self.meshes.begin_streamed_frame(self.device, self.uploads, (assets, used), vertices, mesh_budget)?;
        self.materials.textures.begin_streamed_frame(assets);
        Ok(())
    }
}

impl Streamer {
    /// Something that was drawn in one of so many frames is in sight: a view need not be drawn in each.
    const FRAMES_IN_SIGHT: u64 = 2;
    /// So many times what is uploaded from one frame to the next waits for jobs at most, so that priorities can change.
    const MAX_WAITING_FRAMES: u64 = 2;

    pub(crate) fn new(budget: StreamingBudget) -> Self {
        Self { budget, jobs: UploadJobs::default(), latest: Mutex::default() }
    }

    /// Begins a frame with what is on the device.
    ///
    /// # Errors
    /// If the device had no room for what a job has uploaded, or has none now.
    pub(crate) fn begin_frame(
        &self,
        mut on_device: OnDevice<'_>,
        request: &FrameRequest<'_>,
    ) -> Result<StreamedResources, BackendError> {
        let (assets, used) = (request.scene.assets, request.objects.used_meshes());
        let mut latest = self.latest.lock();
        let Latest { frame_use, statistics } = &mut *latest;
        frame_use.frame += 1;
        frame_use.meshes.reserve(assets.meshes.slot_count());
        frame_use.materials.reserve(assets.materials.slot_count());
        on_device.begin_frame(request, self.budget.mesh_bytes)?;
        self.take_over(&mut on_device, request, frame_use)?;

        let uses = Uses::new(assets, frame_use, Self::FRAMES_IN_SIGHT);
        let requests = uses.requests(on_device.meshes, &on_device.materials.textures, assets, used);
        statistics.requested = requests.len();
        statistics.wanted = requests.iter().filter(|request| request.is_wanted).count();
        let was_over_budget = statistics.over_budget > 0;
        statistics.over_budget = self.place(&mut on_device, assets, &uses, requests, statistics)?;
        if statistics.over_budget > 0 && !was_over_budget {
            let count = statistics.over_budget;
            tracing::warn!(target: "drawloom", count, "what frames draw exceeds the streaming budget: meshes or textures are left out");
        }
        let OnDevice { device, meshes, materials, .. } = on_device;
        let (snapshot, lacks_texture) =
            materials.update_streamed(device, assets, request.plan.material_types(), request.rejections);
        frame_use.lacks_texture = lacks_texture;
        statistics.mesh_bytes = meshes.resident_bytes();
        statistics.texture_bytes = materials.textures.resident_bytes();
        (statistics.meshes, statistics.textures) = (meshes.resident().count(), materials.textures.resident().count());
        statistics.in_flight = meshes.in_flight() + materials.textures.in_flight();
        let resources =
            StreamedResources { meshes: meshes.streamed_snapshot(), materials: snapshot, frame_use: frame_use.clone() };
        Ok(resources)
    }

    /// Whether something waits for a background job.
    pub(crate) fn has_work(&self) -> bool {
        self.jobs.has_work()
    }

    /// Uploads what the budget allows between two frames.
    pub(crate) fn work(&self, device: &wgpu::Device, uploads: &UploadQueue) {
        self.jobs.work(device, uploads, &self.budget);
    }

    /// What streaming has done.
    pub(crate) fn statistics(&self) -> StreamingStatistics {
        StreamingStatistics { uploaded_bytes: self.jobs.uploaded_bytes(), ..self.latest.lock().statistics }
    }

    /// Takes over what jobs have uploaded.
    ///
    /// # Errors
    /// Returns the first error of the device.
    fn take_over(
        &self,
        on_device: &mut OnDevice<'_>,
        request: &FrameRequest<'_>,
        frame_use: &FrameUse,
    ) -> Result<(), BackendError> {
        let assets = request.scene.assets;
        let mut outcome = Ok(());
        for (upload, result) in self.jobs.take_finished() {
            let arrived = (assets, result.is_ok());
            match upload {
                Upload::Mesh(MeshUpload { epoch, slot, revision, mesh, target, .. }) => {
                    if on_device.meshes.end_upload(&epoch, (slot, revision, &mesh), &target, arrived) {
                        // As if it had been drawn, so that what was used before makes room first.
                        frame_use.mark_arrival(slot, Self::FRAMES_IN_SIGHT);
                    }
                }
                Upload::Texture(TextureUpload { epoch, handle, revision, location, .. }) => {
                    on_device.materials.textures.end_upload(&epoch, (handle, revision), location, arrived);
                }
            }
            outcome = outcome.and(result);
        }
        outcome
    }

    /// Gives room and jobs to requests, the most important ones first, and evicts what is used less. Returns how many wanted ones
    /// cannot have room.
    ///
    /// # Errors
    /// If a page is missing. This is a bug in Drawloom.
    fn place(
        &self,
        on_device: &mut OnDevice<'_>,
        assets: &Assets,
        uses: &Uses,
        mut requests: BinaryHeap<Request<'_>>,
        statistics: &mut StreamingStatistics,
    ) -> Result<usize, BackendError> {
        let OnDevice { device, uploads, meshes, materials } = on_device;
        let textures = &mut materials.textures;
        let max_waiting = self.budget.upload_bytes_per_frame * Self::MAX_WAITING_FRAMES;
        let (mut waiting, mut placed, mut over_budget) = (self.jobs.waiting_bytes(), Vec::new(), 0);
        let (mut mesh_victims, mut texture_victims) = (None, None);
        // While a request waits for the room that was made for it, no other one takes it. Where there is no room to make, smaller ones may
        // still fit.
        let (mut meshes_wait, mut textures_wait, mut meshes_are_full, mut textures_are_full) =
            (false, false, false, false);
        while waiting < max_waiting
            && !(meshes_wait && textures_wait)
            && let Some(request) = requests.pop()
        {
            let is_full = match request.requested {
                Requested::Mesh(..) if meshes_wait => continue,
                Requested::Texture(..) if textures_wait => continue,
                Requested::Mesh(slot, revision, mesh) => match meshes.find_room(mesh, self.budget.mesh_bytes)? {
                    Room::Found(target) => {
                        let epoch = meshes.begin_upload(slot);
                        let upload = MeshUpload::new(epoch, (slot, revision), mesh.clone(), target);
                        waiting += upload.bytes();
                        placed.push(Upload::Mesh(upload));
                        continue;
                    }
                    Room::Awaited => {
                        meshes_wait = true;
                        continue;
                    }
                    Room::Missing(_) if meshes_are_full => true,
                    Room::Missing(bytes) => {
                        let victims = mesh_victims.get_or_insert_with(|| uses.mesh_victims(meshes, assets));
                        let evicted = victims.take(&request, bytes);
                        evicted.iter().for_each(|slot| meshes.evict(*slot));
                        statistics.evictions += evicted.len() as u64;
                        (meshes_wait, meshes_are_full) = (!evicted.is_empty(), evicted.is_empty());
                        meshes_are_full
                    }
                },
                Requested::Texture(handle, revision, texture) => {
                    match textures.find_layer(device, uploads, texture, self.budget.texture_bytes) {
                        Room::Found((location, array)) => {
                            let epoch = textures.begin_upload(handle);
                            let upload =
                                TextureUpload::new(epoch, (handle, revision), texture.clone(), array, location);
                            waiting += upload.bytes();
                            placed.push(Upload::Texture(upload));
                            continue;
                        }
                        Room::Awaited => {
                            textures_wait = true;
                            continue;
                        }
                        Room::Missing(_) if textures_are_full => true,
                        Room::Missing(bytes) => {
                            let victims = texture_victims.get_or_insert_with(|| uses.texture_victims(textures, assets));
                            let evicted = victims.take(&request, bytes);
                            evicted.iter().for_each(|slot| textures.evict(*slot));
                            statistics.evictions += evicted.len() as u64;
                            (textures_wait, textures_are_full) = (!evicted.is_empty(), evicted.is_empty());
                            textures_are_full
                        }
                    }
                }
            };
            over_budget += usize::from(is_full && request.is_wanted);
        }
        self.jobs.add(placed.into_iter());
        Ok(over_budget)
    }
}
