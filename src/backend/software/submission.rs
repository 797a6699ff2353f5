//! What is known of a frame that was drawn.

use std::sync::Arc;

use super::number::Number;
use super::targets::FrameTargets;
use crate::backend::{BackendError, Picture};

/// A frame that was drawn on the CPU.
pub struct SoftwareSubmission {
    targets: Arc<dyn Pictures>,
}

impl SoftwareSubmission {
    pub(super) fn new(targets: Arc<dyn Pictures>) -> Self {
        Self { targets }
    }

    /// One of a view's targets, in its format, whichever number it was drawn in. The next frame draws into the same target.
    ///
    /// # Errors
    /// If there is no such target.
    pub fn read(&self, view: usize, target: &str) -> Result<Picture, BackendError> {
        self.targets.picture(view, target).ok_or_else(|| unknown(view, target))
    }

    /// The same as the numbers that are kept: rows from top to bottom, four numbers a pixel. Colours are linear, and channels
    /// that the format lacks are those of opaque black.
    ///
    /// # Errors
    /// If there is no such target.
    pub fn numbers(&self, view: usize, target: &str) -> Result<Vec<[f64; 4]>, BackendError> {
        self.targets.numbers(view, target).ok_or_else(|| unknown(view, target))
    }
}

fn unknown(view: usize, target: &str) -> BackendError {
    BackendError::UnknownTarget { view, target: target.to_owned() }
}

/// Targets in either kind of number.
pub(super) trait Pictures: Send + Sync {
    fn picture(&self, view: usize, target: &str) -> Option<Picture>;

    fn numbers(&self, view: usize, target: &str) -> Option<Vec<[f64; 4]>>;
}

impl<R: Number> Pictures for FrameTargets<R> {
    fn picture(&self, view: usize, target: &str) -> Option<Picture> {
        self.find(view, target).map(|target| target.picture())
    }

    fn numbers(&self, view: usize, target: &str) -> Option<Vec<[f64; 4]>> {
        self.find(view, target).map(|target| target.numbers())
    }
}
