//! The stages of a pass: from its draw list to finished commands.

use std::array;
use std::mem;
use std::ops::Range;
use std::panic::resume_unwind;
use std::time::Duration;

use super::super::context::FrameContext;
use super::super::pass_recording::PassRecording;
use super::super::pass_runs::{PassFailure, PassRuns};
use super::super::stage::StageJob;
use crate::backend::{Backend, BackendError, PassRequest};
use crate::command::DrawList;
use crate::task::{JobPanic, catch};

/// Uploads which objects the pass draws, and makes its pipelines.
pub(super) fn prepare<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
    let table = &frame.tables.passes[job.of];
    frame.recordings[job.of].reserve(frame.part_count(job.of));
    let list = table.list.read();
    frame.backend.prepare(frame.backend_frame, &frame.pass_request(job.of, &list))
}

/// The parts that the backend records the pass in.
pub(super) fn parts<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.part_count(pass)
}

/// Records the pass in parts, such as bundles. An item is a part.
pub(super) fn record<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
    let list = frame.tables.passes[job.of].list.read();
    let request = frame.pass_request(job.of, &list);
    let mut put_part = frame.recordings[job.of].put_parts_from(job.items.start);
    frame.backend.record(frame.backend_frame, &request, job.items, &mut put_part)
}

/// Finishes the pass: its commands are ready to submit. Of passes that are finished together, the job of the one that
/// becomes ready last finishes all.
pub(super) fn finish<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
    match frame.pass_runs.complete(job.of) {
        None => Ok(()),
        Some(passes) if passes.len() == 1 => finish_pass(frame, job.of),
        Some(passes) => finish_together(frame, passes, job.of),
    }
}

fn finish_pass<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> Result<(), BackendError> {
    let list = frame.tables.passes[pass].list.read();
    let mut parts = frame.recordings[pass].ordered_parts()?;
    let request = frame.pass_request(pass, &list);
    let commands = frame.backend.finish(frame.backend_frame, &request, &mut parts)?;
    frame.recordings[pass].put_finished(commands);
    Ok(())
}

fn finish_together<B: Backend>(
    frame: &FrameContext<'_, B>,
    passes: Range<usize>,
    job_of: usize,
) -> Result<(), BackendError> {
    // Arrays, so that no frame allocates for them.
    let (first, count, empty) = (passes.start, passes.len(), DrawList::default());
    let lists: [_; PassRuns::MAX_PASSES] =
        array::from_fn(|index| (index < count).then(|| frame.tables.passes[first + index].list.read()));
    let requests: [_; PassRuns::MAX_PASSES] = array::from_fn(|index| match &lists[index] {
        Some(list) => frame.pass_request(first + index, list),
        None => frame.pass_request(first, &empty),
    });
    let recordings = &frame.recordings[passes];
    let mut taken = TakenParts { parts: array::from_fn(|_| Vec::new()), recordings };
    let parts = &mut taken.parts;
    let fail = |index: usize| frame.pass_runs.add_failure(PassFailure { failed: first + index.min(count - 1), job_of });
    for (index, (parts, recording)) in parts.iter_mut().zip(recordings).enumerate() {
        *parts = mem::take(&mut *recording.ordered_parts().inspect_err(|_| fail(index))?);
    }
    let mut finished = 0;
    let mut emit = |commands| {
        if let Some(recording) = recordings.get(finished) {
            recording.put_finished(commands);
        }
        finished += 1;
    };
    let (requests, parts) = (&requests[..count], &mut parts[..count]);
    let start = frame.clock.stopwatch();
    let result = catch(|| frame.backend.finish_together(frame.backend_frame, requests, parts, &mut emit));
    let result = result.unwrap_or_else(|JobPanic { message, .. }| {
        fail(finished);
        // The run reports it.
        resume_unwind(Box::new(message))
    });
    attribute_time(frame, requests, job_of, start.elapsed());
    if result.is_err() {
        fail(finished);
    }
    result
}

/// The parts of passes that are finished together. When this is dropped, on every path, those that the backend leaves
/// are dropped, and their memory goes back to the recordings.
struct TakenParts<'a, B: Backend> {
    parts: [Vec<B::Part>; PassRuns::MAX_PASSES],
    recordings: &'a [PassRecording<B>],
}

impl<B: Backend> Drop for TakenParts<'_, B> {
    fn drop(&mut self) {
        for (parts, recording) in self.parts.iter_mut().zip(self.recordings) {
            recording.keep_memory(mem::take(parts));
        }
    }
}

/// Divides the time of passes that one job finished among their views, by their batches. When the job ends, its whole
/// time is added to the view of its own pass.
fn attribute_time<B: Backend>(
    frame: &FrameContext<'_, B>,
    requests: &[PassRequest<'_>],
    job_of: usize,
    took: Duration,
) {
    let all: u64 = requests.iter().map(PassRequest::relative_cost).sum();
    for request in requests {
        frame.add_view_time(request.index, took.mul_f64(request.relative_cost() as f64 / all as f64));
    }
    frame.subtract_view_time(job_of, took);
}
