//! From recorded parts to what the device is given.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::chooser::Chooser;
use super::error_scope::{caught, checked};
use super::frame::{Commands, Part};
use super::frame_pass::FramePass;
use super::ways::Share;
use super::{Record, WgpuBackend, WgpuCommands, WgpuFrame, WgpuPart, WgpuSubmission, record};
use crate::backend::{BackendError, FrameRequest};
use crate::command::DrawList;
use crate::process::{Draws, Pass};

impl WgpuBackend {
    /// Encodes a whole pass: its bundles, or what it draws without any.
    ///
    /// # Errors
    /// If what it needs was not made before, or a raw pass fails.
    pub(super) fn encode_pass(
        &self,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        index: usize,
        list: &DrawList,
        parts: &[WgpuPart],
    ) -> Result<wgpu::CommandEncoder, BackendError> {
        let FramePass { pass, way, .. } = *frame.pass(index);
        self.encoded(frame, index, |encoder| match &request.draws[pass.process] {
            Draws::Raw(raw) => record::raw(&self.device, encoder, frame, request, index, *raw),
            Draws::Commands(_) if matches!(way.record, Record::Direct | Record::Indirect) => {
                record::batches(encoder, frame, request, index, Share::WHOLE, list, 0..list.bundle_count())
            }
            Draws::Commands(_) => {
                let bundles = parts.iter().filter_map(|part| match &part.0 {
                    Part::Bundle(bundle) => Some(bundle),
                    Part::Encoder(_) => None,
                });
                record::bundles(encoder, frame, request, index, Share::WHOLE, bundles);
                Ok(())
            }
            _ => record::fixed(encoder, frame, request, index),
        })
    }

    /// Records one of the encoders that a pass is spread over.
    ///
    /// # Errors
    /// If what it needs was not made before.
    pub(super) fn record_encoder(
        &self,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        index: usize,
        list: &DrawList,
        part: usize,
    ) -> Result<Part, BackendError> {
        let way = frame.pass(index).way;
        let bundles = way.bundles_of(list, part);
        let share = way.share_of(list, part);
        let encoder = match way.record {
            Record::Direct | Record::Indirect => self
                .encoded(frame, index, |encoder| record::batches(encoder, frame, request, index, share, list, bundles)),
            Record::Bundles | Record::Kept => {
                let recorded = bundles.map(|place| record::bundle(&self.device, frame, index, list, place));
                let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
                self.encoded(frame, index, |encoder| {
                    record::bundles(encoder, frame, request, index, share, &recorded);
                    Ok(())
                })
            }
        };
        Ok(Part::Encoder(encoder?.finish()))
    }

    /// Submits what was recorded, and finishes first what was left for it.
    ///
    /// # Errors
    /// If the device refuses.
    pub(super) fn submit_frame(
        &self,
        frame: &WgpuFrame,
        passes: Vec<(Pass, WgpuCommands)>,
    ) -> Result<WgpuSubmission, BackendError> {
        let mut finished = Vec::with_capacity(passes.len());
        for (pass, WgpuCommands(commands)) in passes {
            match commands {
                Commands::Finished(commands) => finished.push(commands),
                Commands::Parts(parts) => finished.extend(parts.into_iter().filter_map(|WgpuPart(part)| match part {
                    Part::Encoder(commands) => Some(commands),
                    Part::Bundle(_) => None,
                })),
                Commands::Open(encoder) => {
                    let pass = frame.pass(frame.index(pass));
                    // No scheduler catches what wgpu panics over here.
                    let finish = || checked(&self.device, &pass.label, || caught(&pass.label, || encoder.finish()));
                    finished.push(pass.spent.alone(finish)??);
                }
            }
        }
        let submission = checked(&self.device, "the frame", || {
            let times = frame.buffers.timestamps().zip(self.timing.as_ref());
            let times = times.map(|(timestamps, timing)| timestamps.read_back(&self.device, timing)).transpose()?;
            let (copied, times) = times.unzip();
            let index = self.queue().submit(finished.into_iter().chain(copied));
            let (device, queue) = (self.device.clone(), self.queue().clone());
            Ok(WgpuSubmission::new(device, queue, index, Arc::clone(&frame.targets), times))
        })
        .flatten()?;
        self.note(frame);
        Ok(submission)
    }

    /// Encodes something of a pass in an encoder of its own.
    fn encoded(
        &self,
        frame: &WgpuFrame,
        index: usize,
        encode: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), BackendError>,
    ) -> Result<wgpu::CommandEncoder, BackendError> {
        let label = Some(frame.pass(index).label.as_str());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        encode(&mut encoder)?;
        Ok(encoder)
    }

    /// Tells the choosers what the frame has spent, and keeps how it was recorded.
    fn note(&self, frame: &WgpuFrame) {
        let workers = self.workers.load(Ordering::Relaxed);
        let passes = frame.buffers.passes().iter().filter(|pass| pass.drawn_place.is_some());
        let all = passes.clone().map(|pass| pass.spent.total()).sum();
        let mut latest = self.latest.lock();
        let mut count = 0;
        for pass in passes {
            let pipelines = frame.pipelines(pass.pass);
            if self.ways.offered().len() > 1 {
                let sample = pass.sample(all, workers);
                let note = |one: &mut Chooser| one.note(frame.number, pass.way_index, sample);
                pipelines.with_chooser(pass.pass.view, &self.ways, note);
            }
            // Names are written over those of the frame before.
            let mut name = latest.get_mut(count).map_or_else(String::new, |before| std::mem::take(&mut before.process));
            name.clear();
            name.push_str(pipelines.name());
            let report = pass.report(name);
            match latest.get_mut(count) {
                Some(before) => *before = report,
                None => latest.push(report),
            }
            count += 1;
        }
        latest.truncate(count);
    }
}
