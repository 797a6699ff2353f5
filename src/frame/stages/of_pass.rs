//! The stages of a pass: from its draw list to finished commands.

use std::array;
use std::mem;
use std::ops::Range;
use std::slice;

use parking_lot::MutexGuard;

use super::super::context::FrameContext;
use super::super::encoders::{FailedPass, FrameEncoders, PassFailure};
use super::super::pass_recording::PassRecording;
use super::super::stage::StageJob;
use crate::backend::{Backend, PassRequest};
use crate::command::DrawList;
use crate::graph::NodeError;
use crate::task::catch;

/// Uploads which objects the pass draws, and makes its pipelines.
pub(super) fn prepare<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    frame.recordings[job.of].reserve(frame.part_count(job.of));
    let list = table.list.read();
    Ok(frame.backend.prepare(frame.backend_frame, &frame.pass_request(job.of, &list))?)
}

/// The parts that the backend records the pass in.
pub(super) fn parts<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.part_count(pass)
}

/// Records the pass in parts, such as bundles. An item is a part.
pub(super) fn record<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let list = frame.tables.passes[job.of].list.read();
    let request = frame.pass_request(job.of, &list);
    let mut put_part = frame.recordings[job.of].put_parts_from(job.items.start);
    Ok(frame.backend.record(frame.backend_frame, &request, job.items, &mut put_part)?)
}

/// Finishes the pass: its commands are ready to submit. The job of the pass that becomes ready last finishes all passes
/// of its encoder.
pub(super) fn finish<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    match frame.encoders.complete(job.of) {
        None => {}
        Some(passes) if passes.len() == 1 => finish_pass(frame, job.of)?,
        Some(passes) => finish_passes(frame, passes, job.of)?,
    }
    Ok(())
}

fn finish_pass<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> Result<(), FailedPass> {
    let list = frame.tables.passes[pass].list.read();
    let mut parts = ordered_parts(frame, pass)?;
    finish_encoder(frame, &[frame.pass_request(pass, &list)], slice::from_mut(&mut *parts))
}

fn finish_passes<B: Backend>(
    frame: &FrameContext<'_, B>,
    passes: Range<usize>,
    job_of: usize,
) -> Result<(), FailedPass> {
    // Arrays, so that no frame allocates for them.
    let (first, count, empty) = (passes.start, passes.len(), DrawList::default());
    let lists: [_; FrameEncoders::MAX_PASSES] =
        array::from_fn(|index| (index < count).then(|| frame.tables.passes[first + index].list.read()));
    let requests: [_; FrameEncoders::MAX_PASSES] = array::from_fn(|index| match &lists[index] {
        Some(list) => frame.pass_request(first + index, list),
        None => frame.pass_request(first, &empty),
    });
    let recordings = &frame.recordings[passes.clone()];
    let mut taken = TakenParts { parts: array::from_fn(|_| Vec::new()), recordings };
    for (parts, pass) in taken.parts.iter_mut().zip(passes) {
        *parts = mem::take(&mut *ordered_parts(frame, pass)?);
    }
    let requests = &requests[..count];
    let start = frame.clock.stopwatch();
    let result = finish_encoder(frame, requests, &mut taken.parts[..count]);
    let took = start.elapsed();
    for (request, share) in requests.iter().zip(PassRequest::divide_time(requests, took)) {
        frame.add_view_time(request.index, share);
    }
    // When the job ends, its whole time is added to the view of its own pass.
    frame.subtract_view_time(job_of, took);
    result
}

/// Has the backend finish an encoder with these passes.
fn finish_encoder<B: Backend>(
    frame: &FrameContext<'_, B>,
    passes: &[PassRequest<'_>],
    parts: &mut [Vec<B::Part>],
) -> Result<(), FailedPass> {
    let mut finished = 0;
    let mut emit = |commands| {
        if let Some(pass) = passes.get(finished) {
            frame.recordings[pass.index].put_finished(commands);
        }
        finished += 1;
    };
    let failure = match catch(|| frame.backend.finish(frame.backend_frame, passes, parts, &mut emit)) {
        Ok(Ok(())) => return Ok(()),
        Ok(Err(error)) => PassFailure::Error(error),
        Err(panic) => PassFailure::Panic(panic),
    };
    Err(FailedPass { pass: passes[finished.min(passes.len() - 1)].index, failure })
}

fn ordered_parts<'a, B: Backend>(
    frame: &FrameContext<'a, B>,
    pass: usize,
) -> Result<MutexGuard<'a, Vec<B::Part>>, FailedPass> {
    let parts = frame.recordings[pass].ordered_parts();
    parts.map_err(|error| FailedPass { pass, failure: PassFailure::Error(error) })
}

/// The parts of an encoder's passes. When this is dropped, on every path, those that the backend leaves are dropped, and
/// their memory goes back to the recordings.
struct TakenParts<'a, B: Backend> {
    parts: [Vec<B::Part>; FrameEncoders::MAX_PASSES],
    recordings: &'a [PassRecording<B>],
}

impl<B: Backend> Drop for TakenParts<'_, B> {
    fn drop(&mut self) {
        for (parts, recording) in self.parts.iter_mut().zip(self.recordings) {
            recording.keep_memory(mem::take(parts));
        }
    }
}
