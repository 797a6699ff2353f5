//! The submission of a frame, the fences in it, and the readback of its targets.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use super::backend::WgpuBackend;
use super::error_scope::{catch_wgpu_panic, check_device, poll, with_error_scope};
use super::frame::{PassCommands, RecordedPart, WgpuCommands, WgpuFrame, WgpuPart};
use super::read_back::new_read_back;
use super::resources::WgpuTargets;
use super::strategy::PassTuner;
use super::timing::{DevicePassTimes, TimestampReadback};
use crate::backend::{BackendError, FrameFence, Picture, ViewQueue};
use crate::fence::{DeviceProgress, FenceSetter};

impl WgpuBackend {
    /// Finishes open encoders, and submits the frame.
    ///
    /// # Errors
    /// If the device refuses, or is lost.
    pub(super) fn submit_frame(
        &self,
        frame: &mut WgpuFrame,
        queues: Vec<ViewQueue<WgpuCommands>>,
        fences: Vec<FrameFence>,
    ) -> Result<WgpuSubmission, BackendError> {
        let has_histories = frame.targets.have_histories();
        let drawn: HashSet<_> = queues.iter().filter(|_| has_histories).map(|queue| queue.view).collect();
        let pass_count = queues.iter().map(|queue| queue.passes.len()).sum();
        let [before, behind] = frame.buffers.copies_of_objects(&self.device)?;
        let mut finished = Vec::with_capacity(pass_count + 1);
        finished.extend(before);
        let (inner_fences, end_fences): (Vec<_>, Vec<_>) =
            fences.into_iter().partition(|fence| fence.passes < pass_count);
        let mut inner_fences = inner_fences.into_iter().peekable();
        // Of each inner fence, the number of command buffers before its place.
        let mut inner_places = Vec::new();
        for (index, (_, WgpuCommands(commands))) in queues.into_iter().flat_map(|queue| queue.passes).enumerate() {
            while let Some(fence) = inner_fences.next_if(|fence| fence.passes <= index) {
                inner_places.push((finished.len(), fence.setter));
            }
            match commands {
                PassCommands::Finished(commands) => finished.push(commands),
                PassCommands::InEarlierPass => {}
                PassCommands::Parts(parts) => {
                    finished.extend(parts.into_iter().filter_map(|WgpuPart(part)| match part {
                        RecordedPart::Encoder(commands) => Some(commands),
                        RecordedPart::Bundle(_) => None,
                    }));
                }
                PassCommands::Open(encoder) => {
                    let pass = frame.pass(index);
                    // This thread runs no job, so no scheduler would catch a panic of wgpu.
                    let finish = || catch_wgpu_panic(&pass.label, || encoder.finish());
                    let finish = || with_error_scope(&self.device, &pass.label, finish);
                    finished.push(pass.timing.time_serial(finish)??);
                }
            }
        }
        let (submission, index) = with_error_scope(&self.device, "the frame", || {
            let timestamps = frame.buffers.timestamps().zip(self.device_timing.as_ref());
            let readback =
                timestamps.map(|(timestamps, timing)| timestamps.read_back(&self.device, timing)).transpose()?;
            let (copy, readback) = readback.unzip();
            frame.buffers.objects().unmap();
            frame.generated.write(self.queue());
            let copies = (has_histories || !frame.read_backs.is_empty()).then(|| {
                let descriptor = wgpu::CommandEncoderDescriptor { label: Some("copies of targets") };
                let mut encoder = self.device.create_command_encoder(&descriptor);
                frame.read_backs.iter().for_each(|copy| copy.encode(&mut encoder));
                frame.targets.copy_histories(&mut encoder, |view| drawn.contains(&view))?;
                Ok::<_, BackendError>(encoder.finish())
            });
            let copies = copies.transpose()?;
            let mut finished = finished.into_iter();
            self.submit_up_to_fences(&mut finished, inner_places)?;
            let index = self.queue().submit(finished.chain(copies).chain(behind).chain(copy));
            frame.buffers.objects().await_submission(self.queue());
            let (device, queue) = (self.device.clone(), self.queue().clone());
            Ok((WgpuSubmission::new(device, queue, index.clone(), Arc::clone(&frame.targets), readback), index))
        })
        .flatten()?;
        // The queue of a lost device refuses a submission without a word.
        check_device(&self.device)?;
        // Only now, because a submission that is refused uploads and copies nothing.
        frame.pending_uploads.submitted();
        frame.read_backs.drain(..).for_each(|copy| copy.submitted(&self.device, &index));
        end_fences.into_iter().for_each(|fence| set_when_done(&self.device, self.queue(), fence.setter));
        self.report_costs(frame);
        Ok(submission)
    }

    /// Submits the command buffers before the place of each of these fences, and has the device set the fence after
    /// them. A fence has the number of command buffers before its place.
    ///
    /// # Errors
    /// If the device refuses one of the command buffers. Its fence and those behind it are abandoned.
    fn submit_up_to_fences(
        &self,
        commands: &mut impl Iterator<Item = wgpu::CommandBuffer>,
        fences: Vec<(usize, FenceSetter)>,
    ) -> Result<(), BackendError> {
        let mut submitted = None;
        for (count, setter) in fences {
            if submitted != Some(count) {
                // An error scope of its own, as a fence must not be set for what the device has refused.
                let part = commands.take(count - submitted.unwrap_or(0));
                with_error_scope(&self.device, "a part of the frame", || self.queue().submit(part))?;
                check_device(&self.device)?;
                submitted = Some(count);
            }
            set_when_done(&self.device, self.queue(), setter);
        }
        Ok(())
    }

    /// Reports the frame's measured costs to the tuners, and keeps the statistics of its passes.
    fn report_costs(&self, frame: &WgpuFrame) {
        let passes = frame.buffers.passes().iter().filter(|pass| pass.has_list());
        let all = passes.clone().map(|pass| pass.timing.total()).sum();
        let mut latest = self.latest.lock();
        let mut count = 0;
        for pass in passes {
            let pipelines = frame.pipelines(pass.pass);
            if self.strategies.strategies().len() > 1 && pass.is_tuned {
                let sample = pass.cost_sample(all, frame.workers);
                let report = |own: &mut PassTuner| {
                    own.set_group_size(pass.timing.group_size(), &self.strategies, frame.number);
                    own.tuner.report(frame.number, pass.strategy_index, sample);
                };
                pipelines.with_tuner(pass.pass.view_index, &self.strategies, report);
            }
            // Reuses the string of the frame before.
            let mut name = latest.get_mut(count).map_or_else(String::new, |before| std::mem::take(&mut before.process));
            name.clear();
            name.push_str(pipelines.name());
            let statistics = pass.statistics(name);
            match latest.get_mut(count) {
                Some(before) => *before = statistics,
                None => latest.push(statistics),
            }
            count += 1;
        }
        latest.truncate(count);
    }
}

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

/// A frame that was submitted to wgpu.
pub struct WgpuSubmission {
    device: wgpu::Device,
    queue: wgpu::Queue,
    index: wgpu::SubmissionIndex,
    targets: Arc<WgpuTargets>,
    timestamps: Option<TimestampReadback>,
}

impl WgpuSubmission {
    pub(crate) fn new(
        device: wgpu::Device,
        queue: wgpu::Queue,
        index: wgpu::SubmissionIndex,
        targets: Arc<WgpuTargets>,
        timestamps: Option<TimestampReadback>,
    ) -> Self {
        Self { device, queue, index, targets, timestamps }
    }

    /// Waits until the device has drawn the frame, and returns when it drew each pass.
    ///
    /// # Errors
    /// - [`BackendError::NotTimed`] if the backend does not [time passes](super::WgpuBackend::time_passes).
    /// - If the device is lost.
    pub fn pass_times(&self) -> Result<DevicePassTimes, BackendError> {
        let timestamps = self.timestamps.as_ref().ok_or(BackendError::NotTimed)?;
        self.wait()?;
        timestamps.read(&self.device)
    }

    /// The texture of a view's target, to present or to copy, and the layer that is the target's: 0 but where views
    /// have targets that are layers of one texture. The next frame draws into the same texture.
    ///
    /// # Errors
    /// If there is no such target, or it is [transient](super::WgpuBackend::transient_targets).
    pub fn texture(&self, view: usize, target: impl AsRef<str>) -> Result<(&wgpu::Texture, u32), BackendError> {
        let target = target.as_ref();
        let found = self.targets.find(view, target)?;
        if found.is_transient() {
            return Err(BackendError::TransientTarget { view, target: target.to_owned() });
        }
        Ok((&found.texture, found.layer))
    }

    /// Waits until the device has drawn the frame, however long that takes.
    ///
    /// # Errors
    /// If the device is lost before it has drawn the frame.
    pub fn wait(&self) -> Result<(), BackendError> {
        self.poll(None)
    }

    /// Waits until the device has drawn the frame, but no longer than this time: for engines that notice a device which
    /// hangs.
    ///
    /// # Errors
    /// - [`BackendError::Timeout`] if the time is over. The frame may still be drawn, and may be waited for again.
    /// - If the device is lost before it has drawn the frame.
    pub fn wait_timeout(&self, timeout: Duration) -> Result<(), BackendError> {
        self.poll(Some(timeout))
    }

    fn poll(&self, timeout: Option<Duration>) -> Result<(), BackendError> {
        poll(&self.device, wgpu::PollType::Wait { submission_index: Some(self.index.clone()), timeout })
    }

    /// Waits until the device has drawn the frame, and reads back a view's target.
    ///
    /// # Errors
    /// If there is no such target, it is [transient](super::WgpuBackend::transient_targets), or the device refuses or
    /// is lost.
    pub fn read(&self, view: usize, target: impl AsRef<str>) -> Result<Picture, BackendError> {
        let target = target.as_ref();
        self.wait()?;
        // The calls below do not report it, and the wait does not if the frame was drawn before.
        check_device(&self.device)?;
        let found = self.targets.find(view, target)?;
        let whole = [found.texture.width(), found.texture.height()];
        let (read_back, copy) = new_read_back(&self.device, &self.targets, view, target, [[0, 0], whole])?;
        let index = with_error_scope(&self.device, target, || {
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            copy.encode(&mut encoder);
            self.queue.submit([encoder.finish()])
        })?;
        copy.submitted(&self.device, &index);
        read_back.read()
    }
}
