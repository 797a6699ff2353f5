//! A frame that was drawn.

use std::sync::Arc;

use crate::backend::{BackendError, Picture};

/// A frame that was drawn on the CPU.
pub struct SoftwareSubmission {
    targets: Arc<dyn ReadTargets>,
}

impl SoftwareSubmission {
    pub(super) fn new(targets: Arc<dyn ReadTargets>) -> Self {
        Self { targets }
    }

    /// One of a view's targets in its format, in whichever precision it was drawn. The next frame draws into the same
    /// target.
    ///
    /// # Errors
    /// If there is no such target.
    pub fn read(&self, view: usize, target: impl AsRef<str>) -> Result<Picture, BackendError> {
        self.targets.picture(view, target.as_ref())
    }

    /// The same as numbers, before they are converted to the format: rows from top to bottom, four numbers a pixel.
    /// Colours are linear; channels that the format lacks are those of opaque black.
    ///
    /// # Errors
    /// If there is no such target.
    pub fn numbers(&self, view: usize, target: impl AsRef<str>) -> Result<Vec<[f64; 4]>, BackendError> {
        self.targets.numbers(view, target.as_ref())
    }
}

/// The targets of a frame in either precision, read by view and name.
pub(super) trait ReadTargets: Send + Sync {
    /// # Errors
    /// If there is no such target.
    fn picture(&self, view: usize, target: &str) -> Result<Picture, BackendError>;

    /// # Errors
    /// If there is no such target.
    fn numbers(&self, view: usize, target: &str) -> Result<Vec<[f64; 4]>, BackendError>;
}
