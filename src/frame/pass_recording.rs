//! What the jobs of one pass record.

use parking_lot::Mutex;

use crate::backend::{Backend, BackendError};

/// What the jobs of one pass record: its parts in any order, then the finished pass. It keeps its memory from frame to frame.
pub(super) struct PassRecording<B: Backend> {
    /// By part index.
    parts: Mutex<Vec<Option<B::Part>>>,
    /// All parts in order, when they are handed to the backend.
    ordered_parts: Mutex<Vec<B::Part>>,
    finished: Mutex<Option<B::Commands>>,
}

impl<B: Backend> Default for PassRecording<B> {
    fn default() -> Self {
        Self { parts: Mutex::default(), ordered_parts: Mutex::default(), finished: Mutex::default() }
    }
}

impl<B: Backend> PassRecording<B> {
    /// Makes room for `count` parts.
    pub(super) fn reserve(&self, count: usize) {
        self.parts.lock().resize_with(count, || None);
    }

    /// A function that stores parts, the first at index `first`.
    pub(super) fn put_parts_from(&self, first: usize) -> impl FnMut(B::Part) {
        let mut index = first;
        move |part| {
            self.parts.lock()[index] = Some(part);
            index += 1;
        }
    }

    /// Finishes the pass with `finish`, which takes all parts in order.
    ///
    /// # Errors
    /// If a part is missing, or `finish` fails.
    pub(super) fn finish(
        &self,
        finish: impl FnOnce(&mut Vec<B::Part>) -> Result<B::Commands, BackendError>,
    ) -> Result<(), BackendError> {
        let (mut parts, mut ordered_parts) = (self.parts.lock(), self.ordered_parts.lock());
        let count = parts.len();
        ordered_parts.extend(parts.drain(..).flatten());
        if ordered_parts.len() < count {
            return Err(BackendError::BrokenRule {
                rule: "every part is recorded before its pass is finished".to_owned(),
            });
        }
        *self.finished.lock() = Some(finish(&mut ordered_parts)?);
        Ok(())
    }

    /// Takes the finished pass, if there is one, and drops what an unfinished frame has left.
    pub(super) fn take(&mut self) -> Option<B::Commands> {
        self.parts.get_mut().clear();
        self.ordered_parts.get_mut().clear();
        self.finished.get_mut().take()
    }
}
