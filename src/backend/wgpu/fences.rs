//! Fences that wgpu sets.

use std::time::Duration;

use super::error_scope::catch_wgpu_panic;
use crate::fence::{DeviceProgress, FenceSetter};

/// Has the device set a fence when it has done all work that is submitted so far, of which `index` is the latest that matters.
pub(super) fn set_when_done(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    index: &wgpu::SubmissionIndex,
    setter: FenceSetter,
) {
    setter.advance_by(SubmissionProgress { device: device.clone(), index: index.clone() });
    queue.on_submitted_work_done(move || setter.set());
}

/// wgpu calls back for finished work only while it is polled or something is submitted.
struct SubmissionProgress {
    device: wgpu::Device,
    index: wgpu::SubmissionIndex,
}

impl DeviceProgress for SubmissionProgress {
    fn advance(&self, limit: Duration) -> Result<(), String> {
        /// While wgpu waits it holds a lock that presenting and destroying resources need, so it does not wait for long at a time.
        const MAX_WAIT: Duration = Duration::from_millis(1);
        let poll_type = if limit.is_zero() {
            wgpu::PollType::Poll
        } else {
            wgpu::PollType::Wait { submission_index: Some(self.index.clone()), timeout: Some(limit.min(MAX_WAIT)) }
        };
        // wgpu panics if the device is lost.
        match catch_wgpu_panic("the device", || self.device.poll(poll_type)) {
            // Who waits for the fence looks at the time.
            Ok(Ok(_) | Err(wgpu::PollError::Timeout)) => Ok(()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(error) => Err(error.to_string()),
        }
    }
}
