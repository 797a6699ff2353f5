//! The work for one view.

use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Picture, ReadBack};
use drawloom::process::ShaderResource;
use drawloom::scene::Camera;

use crate::unwind::Contained;

/// A picture and the words of its view on the device.
pub(crate) type LayerTextures = [ShaderResource<'static>; 2];

/// The pixels of a frame on their way to the step.
pub(crate) struct Source {
    /// The number of the frame.
    pub(crate) number: u64,
    /// The camera that it was drawn with.
    pub(crate) camera: Camera,
    pub(crate) read_back: Contained<Box<dyn ReadBack>>,
}

/// What a step computed of a frame.
pub(crate) struct StepResult {
    /// The number of the frame.
    pub(crate) number: u64,
    pub(crate) camera: Camera,
    pub(crate) picture: Arc<Picture>,
    /// `None` if the backend has none.
    #[cfg_attr(not(feature = "wgpu"), expect(dead_code, reason = "no other backend has textures"))]
    pub(crate) textures: Option<LayerTextures>,
}

/// The work for one view: at most one job is queued or runs, and at most one source waits for it.
pub(crate) struct ViewWork {
    pub(crate) view: String,
    /// Tells it from the work for a view of the same name that is gone.
    pub(crate) identity: u64,
    /// The newest source whose pixels have arrived, and when they did.
    arrived: Option<(Source, Instant)>,
    /// Whether a job is queued or runs.
    has_job: bool,
    /// When the pixels arrived of which the step is being computed.
    started: Option<Instant>,
    pub(crate) latest: Option<Arc<StepResult>>,
    /// Whether the latest attempt failed, so that only the first of several failures in a row is told.
    has_failed: bool,
    pub(crate) computed: u64,
    pub(crate) skipped: u64,
    pub(crate) latest_took: Duration,
}

impl ViewWork {
    pub(crate) fn new(view: String, identity: u64) -> Self {
        Self {
            view,
            identity,
            arrived: None,
            has_job: false,
            started: None,
            latest: None,
            has_failed: false,
            computed: 0,
            skipped: 0,
            latest_took: Duration::ZERO,
        }
    }

    /// The pixels of a source have arrived. Returns the older source, which is skipped, if one waits.
    pub(crate) fn arrive(&mut self, source: Source, now: Instant) -> Option<Source> {
        let (replaced, _) = self.arrived.replace((source, now))?;
        self.skipped += 1;
        Some(replaced)
    }

    /// Whether a job is to be queued for a source that waits. If so, the view counts as having one.
    pub(crate) fn needs_job(&mut self) -> bool {
        let is_needed = self.arrived.is_some() && !self.has_job;
        self.has_job |= is_needed;
        is_needed
    }

    /// Takes the source that waits.
    pub(crate) fn start(&mut self) -> Option<Source> {
        let (source, arrived) = self.arrived.take()?;
        self.started = Some(arrived);
        Some(source)
    }

    /// The step has ended, with this result if it did not fail. Returns whether a failure is to be told, and the result
    /// that is of no use any more.
    pub(crate) fn finish(&mut self, result: Option<Arc<StepResult>>) -> (bool, Option<Arc<StepResult>>) {
        self.has_job = false;
        let took = self.started.take().map_or(Duration::ZERO, |arrived| arrived.elapsed());
        let Some(result) = result else { return (self.fail(), None) };
        self.computed += 1;
        self.latest_took = took;
        self.has_failed = false;
        // Frames arrive in their order, unless the engine submits them in another one.
        let is_newer = self.latest.as_ref().is_none_or(|latest| latest.number < result.number);
        (false, if is_newer { self.latest.replace(result) } else { Some(result) })
    }

    /// Something failed. Returns whether that is to be told.
    pub(crate) fn fail(&mut self) -> bool {
        !std::mem::replace(&mut self.has_failed, true)
    }
}
