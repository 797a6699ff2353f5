//! What becomes of recorded frames, for the frames that keep what they draw.

use std::sync::Arc;

use parking_lot::Mutex;

/// What becomes of a recorded frame. Later frames that keep a view which it draws share this with it.
pub(super) struct FrameOutcome {
    state: Mutex<State>,
}

enum State {
    /// It is neither submitted nor dropped, and keeps views that these frames draw, or that frames draw which they keep
    /// views of in turn.
    InFlight(Vec<Arc<FrameOutcome>>),
    Submitted,
    /// It was dropped, or its submission failed.
    Lost,
}

impl FrameOutcome {
    /// Of a frame that keeps views which `earlier` frames draw.
    pub(super) fn in_flight<'a>(earlier: impl Iterator<Item = &'a Arc<Self>>) -> Self {
        let mut pending: Vec<Arc<Self>> = Vec::new();
        let mut add = |frame: &Arc<Self>| {
            if !frame.is_submitted() && !pending.iter().any(|known| Arc::ptr_eq(known, frame)) {
                pending.push(Arc::clone(frame));
            }
        };
        for frame in earlier {
            if let State::InFlight(earlier) = &*frame.state.lock() {
                earlier.iter().for_each(&mut add);
            }
            add(frame);
        }
        Self { state: Mutex::new(State::InFlight(pending)) }
    }

    pub(super) fn is_submitted(&self) -> bool {
        matches!(*self.state.lock(), State::Submitted)
    }

    /// Whether what the frame draws is lost, or will be, because a frame that it relies on is lost.
    pub(super) fn is_lost(&self) -> bool {
        match &*self.state.lock() {
            // Each of them is older, so no two wait for each other's lock. Those that these rely on are among them.
            State::InFlight(earlier) => earlier.iter().any(|frame| matches!(*frame.state.lock(), State::Lost)),
            State::Submitted => false,
            State::Lost => true,
        }
    }

    pub(super) fn submit(&self) {
        self.end(State::Submitted);
    }

    pub(super) fn lose(&self) {
        self.end(State::Lost);
    }

    fn end(&self, state: State) {
        let before = std::mem::replace(&mut *self.state.lock(), state);
        // The earlier frames are not needed any more, which keeps the chains of frames short.
        drop(before);
    }
}
