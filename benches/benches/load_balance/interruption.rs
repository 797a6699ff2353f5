//! A thread outside the scheduler that occupies a core half of the time.

use std::hint;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The duration of each phase of spinning and of sleeping.
const SLICE: Duration = Duration::from_millis(2);

/// The thread spins and sleeps alternately until this is dropped.
pub struct Interruption {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Interruption {
    /// Least duration of a sample, so that all modes are disturbed alike: several periods.
    pub const MIN_SAMPLE: Duration = SLICE.saturating_mul(8);

    pub fn begin() -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_over);
        let work = move || {
            while !stop.load(Ordering::Relaxed) {
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
            // The thread cannot panic.
            let _ = thread.join();
        }
    }
}
