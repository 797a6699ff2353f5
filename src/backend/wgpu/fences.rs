//! Fences that wgpu sets.

use std::time::Duration;

use super::error_scope::catch_wgpu_panic;
use crate::fence::{DeviceProgress, FenceSetter};

/// Has the device set a fence when it has done all work that is submitted so far.
pub(super) fn set_when_done(device: &wgpu::Device, queue: &wgpu::Queue, setter: FenceSetter) {
    setter.advance_by(SubmissionProgress { device: device.clone() });
    queue.on_submitted_work_done(move || setter.set());
}

/// wgpu calls back for finished work only while it is polled or something is submitted.
struct SubmissionProgress {
    device: wgpu::Device,
}

impl DeviceProgress for SubmissionProgress {
    /// Polls and does not wait, so whoever waits for the fence calls this again and again. A wait of wgpu holds a lock
    /// that presenting and destroying resources need. And wgpu panics in a wait that times out at the moment when
    /// another thread finds all work done.
    fn advance(&self, _limit: Duration) -> Result<(), String> {
        // wgpu panics if the device is lost.
        match catch_wgpu_panic("the device", || self.device.poll(wgpu::PollType::Poll)) {
            Ok(Ok(_) | Err(wgpu::PollError::Timeout)) => Ok(()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(error) => Err(error.to_string()),
        }
    }
}
