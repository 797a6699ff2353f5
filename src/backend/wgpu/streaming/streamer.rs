//! What a frame has on the device, what comes next, and what makes room for it (M 10.3).

use std::mem;
use std::sync::Arc;

use parking_lot::Mutex;

use super::backoff::{Retries, TooLarge};
use super::budget::StreamingBudget;
use super::frame_use::FrameUse;
use super::mesh_upload::MeshUpload;
use super::placement::Placement;
use super::request::Requested;
use super::residency::{FrameAssets, HeldUpload, Residency};
use super::statistics::StreamingStatistics;
use super::texture_upload::TextureUpload;
use super::upload_jobs::{Upload, UploadJobs};
use super::usage::{TextureUsers, Usage};
use crate::backend::wgpu::resources::{CountedQueue, EndOfUpload, Unplaced};
use crate::backend::{BackendError, FrameRequest};
use crate::scene::Assets;
use crate::unwind::emit_unlocked;
use crate::view::{IssueReason, SceneIssues, UsedMeshes};

/// Brings meshes and textures to the device by background jobs, within a budget.
///
/// A frame that begins takes over what jobs have uploaded since the frame before, evicts what was used longest ago, and
/// adds to the jobs what is missing: first what the latest frame would have drawn, then the rest, both by priority. It
/// uploads nothing itself, but for meshes that replace others.
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
    texture_users: TextureUsers,
    /// What has room, and waits until no frame in flight reads there. The most important first.
    held: Vec<HeldUpload>,
    retries: Retries,
    too_large: TooLarge,
    warning: BudgetWarning,
}

impl Streamer {
    /// How many frames something stays in sight after one drew it: a view need not be drawn in each.
    const FRAMES_IN_SIGHT: u64 = 2;
    /// The most that waits for jobs, as a multiple of the uploads from one frame to the next, so that priorities can
    /// change.
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
        mut residency: Residency<'_>,
        request: &FrameRequest<'_>,
    ) -> Result<FrameAssets, BackendError> {
        let assets = request.scene.assets;
        let mut latest = self.latest.lock();
        let latest = &mut *latest;
        latest.frame_use.frame += 1;
        latest.frame_use.meshes.reserve(assets.meshes.slot_count());
        latest.frame_use.materials.reserve(assets.materials.slot_count());
        residency.begin_frame(request, Some(&self.budget))?;
        latest.held.retain(|held| residency.is_current(&held.upload));
        self.jobs.drop_stale(|upload| residency.is_current(upload));
        self.take_over(&mut residency, (assets, request.objects.used_meshes()), &latest.frame_use)?;
        self.place(&mut residency, (assets, request.scene_issues), latest)?;
        let Latest { frame_use, statistics, held, .. } = latest;
        latest.warning.update(statistics.over_budget);
        let (meshes, materials) = residency.snapshots(request, true);
        frame_use.lacks_texture = Arc::clone(&residency.materials.lacks_texture);
        // The caches have forgotten the snapshots before. So what made room may be written now, unless a frame is in
        // flight.
        self.begin_uploads(&residency, held);
        let (residents, textures) = (&residency.meshes.residents, &residency.materials.textures);
        statistics.mesh_bytes = residents.resident_bytes();
        statistics.texture_bytes = textures.resident_bytes();
        (statistics.meshes, statistics.textures) = (residents.resident_count(), textures.resident_count());
        statistics.in_flight = residents.in_flight().len() + textures.in_flight().len();
        Ok(FrameAssets { meshes, materials, frame_use: frame_use.clone() })
    }

    /// Whether something waits for a background job.
    pub(crate) fn has_work(&self) -> bool {
        self.jobs.has_work()
    }

    /// Uploads what the budget allows between two frames.
    pub(crate) fn work(&self, device: &wgpu::Device, uploads: &CountedQueue) {
        self.jobs.work(device, uploads, &self.budget);
    }

    /// What streaming has done.
    pub(crate) fn statistics(&self) -> StreamingStatistics {
        StreamingStatistics { uploaded_bytes: self.jobs.uploaded_bytes(), ..self.latest.lock().statistics }
    }

    /// Takes over what jobs have uploaded. Errors of what was cleared since are nobody's any more.
    ///
    /// # Errors
    /// Returns the first error of the device.
    fn take_over(
        &self,
        residency: &mut Residency<'_>,
        (assets, used): (&Assets, &UsedMeshes),
        frame_use: &FrameUse,
    ) -> Result<(), BackendError> {
        let (finished, commands) = self.jobs.take_finished();
        if !commands.is_empty() {
            residency.uploads.add_commands(commands);
        }
        let mut outcome = Ok(());
        for (upload, result) in finished {
            let is_complete = result.is_ok();
            let end = match upload {
                Upload::Mesh(MeshUpload { in_flight, mesh, target, .. }) => {
                    let arrived = (assets, used, is_complete);
                    let end = residency.meshes.end_upload((&in_flight, &mesh), target.location, arrived);
                    if end == EndOfUpload::Resident {
                        // As if it had been drawn, so that what was used before makes room first.
                        frame_use.mark_arrival(in_flight.handle.index(), Self::FRAMES_IN_SIGHT);
                    }
                    end
                }
                Upload::Texture(TextureUpload { in_flight, .. }) => {
                    let textures = &mut residency.materials.textures;
                    textures.end_upload(&in_flight, &assets.textures, |_, _| true, is_complete)
                }
            };
            if end != EndOfUpload::Stale {
                outcome = outcome.and(result);
            }
        }
        outcome
    }

    /// Gives room to requests, the most important ones first, and evicts what is used less.
    ///
    /// # Errors
    /// If a page is missing. This is a bug in Drawloom.
    fn place(
        &self,
        residency: &mut Residency<'_>,
        (assets, scene_issues): (&Assets, &SceneIssues),
        latest: &mut Latest,
    ) -> Result<(), BackendError> {
        let Latest { frame_use, texture_users, statistics, held, retries, too_large, .. } = latest;
        texture_users.update(assets);
        retries.begin_frame(frame_use.frame);
        too_large.update(assets);
        let usage = Usage::new(assets, (frame_use, texture_users), Self::FRAMES_IN_SIGHT);
        let mut requests = usage.requests(&residency.meshes.residents, &residency.materials.textures);
        statistics.requested = requests.len();
        statistics.wanted = requests.iter().filter(|request| request.is_wanted).count();
        statistics.over_budget = 0;

        let max_waiting = self.budget.upload_bytes_per_frame.saturating_mul(Self::MAX_WAITING_FRAMES);
        let mut waiting = self.jobs.waiting_bytes() + held.iter().map(|held| held.upload.bytes()).sum::<u64>();
        let mut placement = Placement::new(residency, &self.budget, &usage, retries);
        while waiting < max_waiting
            && let Some(request) = requests.pop()
        {
            match placement.place(&request)? {
                Ok(placed) => {
                    waiting += placed.upload.bytes();
                    held.push(placed);
                    too_large.remove(&request.requested);
                }
                Err(Unplaced::TooLarge { bytes, limit, allowed }) => {
                    too_large.tell(&request.requested, (bytes, limit, allowed));
                    statistics.requested -= 1;
                    statistics.wanted -= usize::from(request.is_wanted);
                }
                Err(Unplaced::Full) => statistics.over_budget += usize::from(request.is_wanted),
                Err(Unplaced::LayerLimit) => {
                    if let Requested::Texture(handle, ..) = request.requested
                        && request.is_wanted
                    {
                        scene_issues.count(IssueReason::TextureLimit, handle.index() as usize);
                    }
                }
                Err(Unplaced::Awaited) => {}
            }
        }
        statistics.evictions += placement.evictions as u64;
        statistics.too_large = too_large.count();
        Ok(())
    }

    /// Has jobs do the uploads whose memory no frame in flight reads any more.
    fn begin_uploads(&self, residency: &Residency<'_>, held: &mut Vec<HeldUpload>) {
        self.jobs.add(held.extract_if(.., |held| residency.may_begin(held)).map(|held| held.upload));
    }
}

/// Tells once that frames draw more than the budget, and again only after they have not for a while.
#[derive(Default)]
struct BudgetWarning {
    was_told: bool,
    frames_within: u32,
}

impl BudgetWarning {
    /// What is over the budget in one frame of a few is one state, not many.
    const FRAMES_WITHIN: u32 = 600;

    fn update(&mut self, over_budget: usize) {
        if over_budget == 0 {
            self.frames_within = self.frames_within.saturating_add(1);
            self.was_told &= self.frames_within < Self::FRAMES_WITHIN;
            return;
        }
        self.frames_within = 0;
        if !mem::replace(&mut self.was_told, true) {
            let count = over_budget;
            emit_unlocked(move || {
                tracing::warn!(target: "drawloom", count, "what frames draw exceeds the streaming budget: meshes or textures are left out");
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::iter;

    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::backend::wgpu::resources::{MaterialCache, MeshCache};
    use crate::scene::{Mesh, Topology, Vertex};

    #[test]
    fn an_error_of_an_upload_to_pages_that_are_gone_is_nobodys() {
        let (device, queue) = noop_device();
        let (streamer, uploads) = (Streamer::new(StreamingBudget::default()), CountedQueue::new(queue));
        let (mut assets, used) = (Assets::default(), UsedMeshes::default());
        let mesh = Mesh::new("leaf", Topology::TriangleList, vec![Vertex::default(); 3], vec![0, 1, 2]).unwrap();
        let handle = assets.add(mesh.clone()).unwrap();
        for was_cleared in [true, false] {
            let (mut meshes, mut materials) = (MeshCache::default(), MaterialCache::default());
            let residents = &mut meshes.residents;
            let placed = residents.place(&device, &mesh, 1 << 20, iter::empty(), &mut 0).unwrap().ok().unwrap();
            let in_flight = residents.begin_upload((handle, 1), placed.target.location);
            let upload = MeshUpload::new(in_flight, mesh.clone(), placed.target);
            let error = BackendError::OutOfMemory { label: "a leaf".to_owned() };
            streamer.jobs.end(Upload::Mesh(upload), Err(error));
            if was_cleared {
                meshes = MeshCache::default();
            }
            let (device, uploads) = (&device, &uploads);
            let mut residency = Residency { device, uploads, meshes: &mut meshes, materials: &mut materials };
            let outcome = streamer.take_over(&mut residency, (&assets, &used), &FrameUse::default());
            assert_eq!(outcome.is_ok(), was_cleared);
        }
    }

    #[test]
    fn what_exceeds_the_budget_in_some_frames_is_told_once_until_it_did_not_for_long() {
        let mut warning = BudgetWarning::default();
        let told = |warning: &BudgetWarning| warning.was_told;
        for frame in 0..5000 {
            warning.update(usize::from(frame % 7 == 0));
            assert!(told(&warning), "it is not told again");
        }
        (0..BudgetWarning::FRAMES_WITHIN).for_each(|_| warning.update(0));
        assert!(!told(&warning));
    }
}
