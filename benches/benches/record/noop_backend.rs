//! A backend that does nothing and allocates nothing, which leaves the allocations of the renderer itself.

use std::ops::Range;
use std::sync::Arc;

use drawloom::backend::{
    Backend, BackendError, BackendExtras, FrameFence, FrameRecorder, FrameRequest, NoExtras, PassRequest, ReadBack,
    SceneLimits, TargetMemory, ViewQueue,
};
use drawloom::command::DrawState;
use drawloom::process::{Draws, FramePlan};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::Mesh;
use drawloom::timeline::{Labels, TuningChoice};

/// Ignores all that it receives.
pub struct NoopBackend;

impl Backend for NoopBackend {
    type Submission = ();

    fn adapter_name(&self) -> String {
        "no-op backend".to_owned()
    }

    fn limits(&self) -> SceneLimits {
        SceneLimits::NONE
    }

    fn check_mesh(&self, _: &Mesh, _: VertexFormat) -> Result<(), BackendError> {
        Ok(())
    }

    fn prepare_pipelines(
        &self,
        _: &FramePlan,
        _: &[Draws<'_>],
        _: &[Vec<DrawState>],
        _: &Quality,
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn begin(&self, _: &FrameRequest<'_>) -> Result<(), BackendError> {
        Ok(())
    }

    fn target_memory(&self, (): &()) -> TargetMemory {
        TargetMemory::default()
    }

    fn recording_choice(&self, (): &(), _: usize, _: &Arc<Labels>) -> Option<TuningChoice> {
        None
    }

    fn read_back(&self, (): &mut (), _: usize, _: &str) -> Result<Box<dyn ReadBack>, BackendError> {
        Err(BackendError::CannotReadBack)
    }

    fn submit(&self, (): (), _: Vec<ViewQueue<()>>, fences: Vec<FrameFence>) -> Result<(), BackendError> {
        fences.into_iter().for_each(|fence| fence.setter.set());
        Ok(())
    }

    fn extras(&self) -> &dyn BackendExtras {
        &NoExtras
    }
}

impl FrameRecorder for NoopBackend {
    type Frame = ();
    type Part = ();
    type Commands = ();

    fn objects_epoch(&self, (): &()) -> u64 {
        0
    }

    fn upload_objects(&self, (): &(), _: &FrameRequest<'_>, _: Range<usize>) -> Result<(), BackendError> {
        Ok(())
    }

    fn prepare(&self, (): &(), _: &PassRequest<'_>) -> Result<(), BackendError> {
        Ok(())
    }

    fn part_count(&self, (): &(), _: &PassRequest<'_>) -> usize {
        0
    }

    fn record(&self, (): &(), _: &PassRequest<'_>, _: Range<usize>, _: &mut dyn FnMut(())) -> Result<(), BackendError> {
        Ok(())
    }

    fn shares_encoder(&self, (): &(), _: usize) -> bool {
        false
    }

    fn finish(
        &self,
        (): &(),
        passes: &[PassRequest<'_>],
        _: &mut [Vec<()>],
        emit: &mut dyn FnMut(()),
    ) -> Result<(), BackendError> {
        passes.iter().for_each(|_| emit(()));
        Ok(())
    }
}
