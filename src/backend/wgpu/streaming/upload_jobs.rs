//! What background jobs upload.

use std::collections::VecDeque;
use std::mem;

use parking_lot::Mutex;

use super::budget::StreamingBudget;
use super::mesh_upload::MeshUpload;
use super::texture_upload::TextureUpload;
use super::upload_budget::UploadBudget;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::backend::wgpu::resources::CountedQueue;

/// Something on its way to the device.
pub(super) enum Upload {
    Mesh(MeshUpload),
    Texture(TextureUpload),
}

/// An upload, and whether the device had room for it.
pub(super) type EndedUpload = (Upload, Result<(), BackendError>);

/// What background jobs upload, and what they have uploaded. Frames add to it and take from it when they begin; one job
/// at a time does what was added.
#[derive(Default)]
pub(super) struct UploadJobs {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Upload>,
    finished: Vec<EndedUpload>,
    /// What the device has to execute before what is finished is there.
    commands: Vec<wgpu::CommandBuffer>,
    uploaded_bytes: u64,
}

impl UploadJobs {
    /// Adds what jobs upload after everything else.
    pub(super) fn add(&self, uploads: impl Iterator<Item = Upload>) {
        self.state.lock().waiting.extend(uploads);
    }

    /// What was uploaded, or could not be, once the device has executed the commands.
    pub(super) fn take_finished(&self) -> (Vec<EndedUpload>, Vec<wgpu::CommandBuffer>) {
        let mut state = self.state.lock();
        (mem::take(&mut state.finished), mem::take(&mut state.commands))
    }

    /// Ends an upload as a job does.
    #[cfg(test)]
    pub(super) fn end(&self, upload: Upload, result: Result<(), BackendError>) {
        self.state.lock().finished.push((upload, result));
    }

    /// Whether something waits for a job.
    pub(super) fn has_work(&self) -> bool {
        !self.state.lock().waiting.is_empty()
    }

    /// Drops what waits for a job, and is not current any more.
    pub(super) fn drop_stale(&self, is_current: impl Fn(&Upload) -> bool) {
        let stale: VecDeque<_> = {
            let mut state = self.state.lock();
            if state.waiting.iter().all(&is_current) {
                return;
            }
            let (current, stale) = mem::take(&mut state.waiting).into_iter().partition(is_current);
            state.waiting = current;
            stale
        };
        // Not under the lock.
        drop(stale);
    }

    /// The bytes of what waits for a job, whether a part of it is uploaded already or not.
    pub(super) fn waiting_bytes(&self) -> u64 {
        self.state.lock().waiting.iter().map(Upload::bytes).sum()
    }

    /// The bytes that jobs have uploaded so far.
    pub(super) fn uploaded_bytes(&self) -> u64 {
        self.state.lock().uploaded_bytes
    }

    /// Uploads what the budget allows between two frames.
    pub(super) fn work(&self, device: &wgpu::Device, uploads: &CountedQueue, budget: &StreamingBudget) {
        let mut upload_budget = UploadBudget::new(budget.upload_bytes_per_frame, budget.upload_time_per_frame);
        loop {
            // The lock is not held meanwhile, so that a frame can begin.
            let next = self.state.lock().waiting.pop_front();
            let Some(mut upload) = next else { break };
            let before = upload_budget.bytes();
            let advance = || match &mut upload {
                Upload::Mesh(mesh) => Ok((mesh.advance(device, uploads, &mut upload_budget)?, None)),
                Upload::Texture(texture) => {
                    let (is_complete, commands) = texture.advance(device, uploads, &mut upload_budget)?;
                    Ok((is_complete, Some(commands)))
                }
            };
            let label = "a streamed mesh or texture";
            let advanced = with_error_scope(device, label, || catch_wgpu_panic(label, advance)).flatten().flatten();
            let mut state = self.state.lock();
            state.uploaded_bytes += before - upload_budget.bytes();
            match advanced {
                Ok((is_complete, commands)) => {
                    state.commands.extend(commands);
                    if is_complete {
                        state.finished.push((upload, Ok(())));
                    } else {
                        state.waiting.push_front(upload);
                    }
                }
                Err(error) => state.finished.push((upload, Err(error))),
            }
            if upload_budget.is_over()
                || matches!(state.waiting.front(), Some(next) if !next.can_advance(&upload_budget))
            {
                break;
            }
        }
    }
}

impl Upload {
    /// All that it uploads.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Mesh(mesh) => mesh.bytes(),
            Self::Texture(texture) => texture.bytes(),
        }
    }

    /// Whether its next portion may fit into what is left.
    fn can_advance(&self, upload_budget: &UploadBudget) -> bool {
        match self {
            Self::Mesh(_) => upload_budget.bytes() >= 4,
            Self::Texture(texture) => upload_budget.bytes() >= u64::from(texture.array.width()) * 4,
        }
    }
}
