//! Targets of drawn frames, kept for whoever reads them back.

use std::sync::Arc;

use parking_lot::Mutex;

use super::submission::ReadTargets;
use crate::backend::{BackendError, Picture, ReadBack};

/// A target as one frame leaves it.
pub(super) struct SoftwareReadBack {
    /// Shared with the copy until the frame is drawn or dropped.
    picture: Arc<Mutex<Option<Picture>>>,
}

/// What a frame does for a read-back when it is drawn.
pub(super) struct ReadBackCopy {
    view: usize,
    target: String,
    picture: Arc<Mutex<Option<Picture>>>,
}

/// A read-back of a view's target, and the copy that its frame makes for it.
pub(super) fn new_read_back(view: usize, target: &str) -> (SoftwareReadBack, ReadBackCopy) {
    let picture = Arc::default();
    let copy = ReadBackCopy { view, target: target.to_owned(), picture: Arc::clone(&picture) };
    (SoftwareReadBack { picture }, copy)
}

impl ReadBackCopy {
    /// Copies the target, now that the frame is drawn.
    pub(super) fn drawn(self, targets: &dyn ReadTargets) {
        *self.picture.lock() = targets.picture(self.view, &self.target).ok();
    }
}

impl ReadBack for SoftwareReadBack {
    fn try_read(&self) -> Result<Option<Picture>, BackendError> {
        let is_over = Arc::strong_count(&self.picture) == 1;
        match self.picture.lock().clone() {
            None if is_over => Err(BackendError::NotSubmitted),
            picture => Ok(picture),
        }
    }

    fn read(&self) -> Result<Picture, BackendError> {
        self.try_read()?.ok_or(BackendError::NotSubmitted)
    }
}
