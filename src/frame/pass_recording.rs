//! What the jobs of one pass record.

use parking_lot::{Mutex, MutexGuard};

use crate::backend::{Backend, BackendError};
use crate::unwind::{discard, discard_all};

/// What the jobs of one pass record: its parts in any order, then the finished pass. It keeps its memory from frame to
/// frame.
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
            let mut parts = self.parts.lock();
            if index >= parts.len() {
                drop(parts);
                discard(part);
                panic!("`record` emitted more parts than `part_count` announced");
            }
            let before = parts[index].replace(part);
            drop(parts);
            discard(before);
            index += 1;
        }
    }

    /// All parts in order, to finish the pass with.
    ///
    /// # Errors
    /// If a part is missing.
    pub(super) fn ordered_parts(&self) -> Result<MutexGuard<'_, Vec<B::Part>>, BackendError> {
        let (mut parts, mut ordered_parts) = (self.parts.lock(), self.ordered_parts.lock());
        let count = parts.len();
        ordered_parts.extend(parts.drain(..).flatten());
        if ordered_parts.len() < count {
            return Err(BackendError::BrokenRule {
                rule: "every part is recorded before its pass is finished".to_owned(),
            });
        }
        Ok(ordered_parts)
    }

    /// Keeps the memory of parts that were taken out, for the next frame.
    pub(super) fn keep_memory(&self, mut parts: Vec<B::Part>) {
        discard_all(parts.drain(..));
        *self.ordered_parts.lock() = parts;
    }

    /// Stores the finished pass.
    pub(super) fn put_finished(&self, commands: B::Commands) {
        let before = self.finished.lock().replace(commands);
        discard(before);
    }

    /// Takes the finished pass, if there is one, and drops what an unfinished frame has left.
    pub(super) fn take(&mut self) -> Option<B::Commands> {
        discard_all(self.parts.get_mut().drain(..));
        discard_all(self.ordered_parts.get_mut().drain(..));
        self.finished.get_mut().take()
    }

    /// Drops everything. It keeps the memory.
    pub(super) fn clear(&mut self) {
        discard(self.take());
    }
}

impl<B: Backend> Drop for PassRecording<B> {
    fn drop(&mut self) {
        self.clear();
    }
}

/// Makes `recordings` one for each pass, empty.
pub(super) fn reset_recordings<B: Backend>(recordings: &mut Vec<PassRecording<B>>, passes: usize) {
    recordings.resize_with(passes, PassRecording::default);
    recordings.iter_mut().for_each(PassRecording::clear);
}
