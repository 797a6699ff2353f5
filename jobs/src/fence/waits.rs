//! The list of all who wait for a fence, so that a wait that takes too long can tell who waits for whom.

use std::time::Instant;

use parking_lot::Mutex;

use super::error::FenceWait;

/// All waits of this OS process, the oldest first. Only who really waits takes the lock.
static WAITS: Mutex<Vec<(u64, Wait)>> = Mutex::new(Vec::new());

struct Wait {
    waiter: String,
    fence: String,
    since: Instant,
}

/// A wait that is listed until this is dropped.
pub struct ListedWait {
    number: u64,
}

/// Lists a wait.
pub fn list_wait(waiter: String, fence: &str) -> ListedWait {
    let mut waits = WAITS.lock();
    let number = waits.last().map_or(0, |(number, _)| number + 1);
    waits.push((number, Wait { waiter, fence: fence.to_owned(), since: Instant::now() }));
    ListedWait { number }
}

impl ListedWait {
    /// All waits that are listed, this one among them.
    pub fn all_waits(&self) -> Vec<FenceWait> {
        let describe = |(_, wait): &(u64, Wait)| FenceWait {
            waiter: wait.waiter.clone(),
            fence: wait.fence.clone(),
            waited: wait.since.elapsed(),
        };
        WAITS.lock().iter().map(describe).collect()
    }
}

impl Drop for ListedWait {
    fn drop(&mut self) {
        WAITS.lock().retain(|(number, _)| *number != self.number);
    }
}

/// What lists of waits call this thread.
pub fn current_thread() -> String {
    let thread = std::thread::current();
    thread.name().map_or_else(|| format!("thread {:?}", thread.id()), |name| format!("thread {name:?}"))
}
