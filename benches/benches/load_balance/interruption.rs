//! A foreign thread that takes a core half of the time.

use std::hint;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How long it works, and how long it sleeps.
const SLICE: Duration = Duration::from_millis(2);

/// It works and sleeps in turns until this is dropped.
pub struct Interruption {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Interruption {
    /// How long a turn must take at least, so that all modes get as much of it: some of its periods.
    pub const TURN: Duration = SLICE.saturating_mul(8);

    pub fn begin() -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&is_over);
        let work = move || {
            while !seen.load(Ordering::Relaxed) {
                let start = Instant::now();
                while start.elapsed() < SLICE {
                    hint::spin_loop();
                }
                thread::sleep(SLICE);
            }
        };
        Self { is_over, thread: Some(thread::spawn(work)) }
    }
}

impl Drop for Interruption {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It cannot panic, and there would be nobody to tell.
            let _ = thread.join();
        }
    }
}
