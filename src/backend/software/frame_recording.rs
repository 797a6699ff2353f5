//! A frame that is being recorded, in either precision.

use std::ops::Range;

use super::SoftwareSubmission;
use super::commands::SoftwareCommands;
use super::read_back::SoftwareReadBack;
use crate::backend::{BackendError, FrameFence, FrameRequest, PassRequest, ViewQueue};
use crate::process::CpuShader;

/// A rasterizer in either precision.
pub(super) trait BeginFrame: Send + Sync {
    fn adapter_name(&self) -> String;

    /// Makes the histories of the next frame empty.
    fn forget_histories(&self);

    /// Begins a frame, with the CPU shader of each process.
    ///
    /// # Errors
    /// If a view, a target or a pass cannot be drawn.
    fn begin(&self, request: &FrameRequest<'_>, shaders: &[CpuShader])
    -> Result<Box<dyn FrameRecording>, BackendError>;
}

/// A frame that is being recorded, in either precision.
pub(super) trait FrameRecording: Send + Sync {
    /// Copies blocks of objects.
    fn upload(&self, request: &FrameRequest<'_>, blocks: Range<usize>);

    /// Subdivides the meshes that a pass draws subdivided.
    ///
    /// # Errors
    /// If a batch's mesh does not exist. This is a bug in Drawloom.
    fn prepare(&self, pass: &PassRequest<'_>) -> Result<(), BackendError>;

    /// Has a view's target read back when all passes are drawn.
    ///
    /// # Errors
    /// If there is no such target.
    fn read_back(&mut self, view: usize, target: &str) -> Result<SoftwareReadBack, BackendError>;

    /// Draws all passes, and sets each fence when the passes before its place are drawn.
    ///
    /// # Errors
    /// If a CPU shader panics.
    fn submit(
        self: Box<Self>,
        queues: Vec<ViewQueue<SoftwareCommands>>,
        fences: Vec<FrameFence>,
    ) -> Result<SoftwareSubmission, BackendError>;
}
