//! How long a job waits for a chunk that a job of a CPU node holds: a minute while that job works, not counting the
//! time for which a debugger stops the process. A chunk that nobody will let go of is an error, as a rule after a
//! second.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;

/// Jobs that may hold the chunk: one entry a thread, its latest job.
#[derive(Default)]
pub(super) struct ChunkUsers(Mutex<Vec<NodeJob>>);

/// A job of a CPU node, or what a thread does between two of them.
#[derive(Clone)]
struct NodeJob {
    thread: Arc<NodeThread>,
    ended_before: u64,
}

/// What a thread does with chunks. Both are hints, so they are relaxed: a stale value costs another slice of a wait.
#[derive(Default)]
struct NodeThread {
    /// The jobs of nodes that have ended on it.
    ended: AtomicU64,
    is_waiting: AtomicBool,
}

thread_local! {
    static THREAD: Arc<NodeThread> = Arc::default();
}

/// A wait is cut into slices, and the time is counted in them: while a debugger has stopped the whole process, only one
/// passes.
const SLICE: Duration = Duration::from_millis(5);
/// The slices in which nobody works on the chunk, after which nobody ever will: a second.
const MAX_IDLE_SLICES: u32 = 200;
/// All slices: a minute. A thread that seems to work may wait for this one, such as in a loop of which this is a part.
const MAX_SLICES: u32 = 12_000;

impl ChunkUsers {
    /// Takes a chunk with `try_lock`, which waits for a given time. `None` if it is held by this job, by one that has
    /// leaked its guard, by one that waits for another chunk itself, or by any for a minute.
    pub(super) fn wait<G>(&self, try_lock: impl Fn(Duration) -> Option<G>) -> Option<G> {
        let guard = try_lock(Duration::ZERO).or_else(|| self.wait_in_slices(try_lock))?;
        let job = NodeJob::current();
        let mut jobs = self.0.lock();
        jobs.retain(|other| !other.has_ended() && !Arc::ptr_eq(&other.thread, &job.thread));
        jobs.push(job);
        drop(jobs);
        Some(guard)
    }

    /// A frame begins: no job of an earlier one holds the chunk.
    pub(super) fn clear(&mut self) {
        self.0.get_mut().clear();
    }

    #[cold]
    fn wait_in_slices<G>(&self, try_lock: impl Fn(Duration) -> Option<G>) -> Option<G> {
        let thread = THREAD.with(Arc::clone);
        thread.is_waiting.store(true, Ordering::Relaxed);
        let (mut slices, mut idle_slices) = (0, 0);
        let guard = loop {
            let guard = try_lock(SLICE);
            if guard.is_some() || idle_slices == MAX_IDLE_SLICES || slices == MAX_SLICES {
                break guard;
            }
            let is_worked_on = self.0.lock().iter().any(|job| job.works_beside(&thread));
            idle_slices += u32::from(!is_worked_on);
            slices += 1;
        };
        thread.is_waiting.store(false, Ordering::Relaxed);
        guard
    }
}

impl NodeJob {
    fn current() -> Self {
        let thread = THREAD.with(Arc::clone);
        Self { ended_before: thread.ended.load(Ordering::Relaxed), thread }
    }

    fn has_ended(&self) -> bool {
        self.thread.ended.load(Ordering::Relaxed) != self.ended_before
    }

    /// Whether it has not ended, and works on another thread.
    fn works_beside(&self, other: &Arc<NodeThread>) -> bool {
        !Arc::ptr_eq(&self.thread, other) && !self.has_ended() && !self.thread.is_waiting.load(Ordering::Relaxed)
    }
}

/// Runs a job of a CPU node. What it still holds when it ends, it has leaked.
pub(crate) fn run_node_job<R>(job: impl FnOnce() -> R) -> R {
    struct End;
    impl Drop for End {
        fn drop(&mut self) {
            THREAD.with(|thread| thread.ended.fetch_add(1, Ordering::Relaxed));
        }
    }
    let _end = End;
    job()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;

    use parking_lot::{MutexGuard, RwLock};

    use super::*;

    #[derive(Default)]
    struct Chunk {
        value: Mutex<u32>,
        users: ChunkUsers,
    }

    impl Chunk {
        fn take(&self) -> Option<MutexGuard<'_, u32>> {
            self.users.wait(|slice| self.value.try_lock_for(slice))
        }
    }

    #[test]
    fn a_job_waits_for_one_that_works_longer_than_for_one_that_does_not() {
        let chunk = Chunk::default();
        let (taken, is_taken) = mpsc::channel();
        thread::scope(|threads| {
            threads.spawn(|| {
                run_node_job(|| {
                    let mut value = chunk.take().unwrap();
                    taken.send(()).unwrap();
                    // Longer than anybody waits for a chunk that nobody works on.
                    thread::sleep(SLICE * (MAX_IDLE_SLICES + 100));
                    *value = 7;
                });
            });
            is_taken.recv().unwrap();
            assert_eq!(chunk.take().as_deref(), Some(&7));
        });
    }

    /// Of two jobs that read a chunk, the one that came last ends first.
    #[test]
    fn a_job_waits_for_every_reader_of_a_chunk() {
        let (value, users) = (RwLock::new(3), ChunkUsers::default());
        let read = || users.wait(|slice| value.try_read_for(slice));
        let (first_reads, is_read) = mpsc::channel();
        thread::scope(|threads| {
            threads.spawn(|| {
                run_node_job(|| {
                    let value = read().unwrap();
                    first_reads.send(()).unwrap();
                    // Longer than anybody waits for a chunk that nobody works on.
                    thread::sleep(SLICE * (MAX_IDLE_SLICES + 100));
                    drop(value);
                });
            });
            is_read.recv().unwrap();
            assert_eq!(threads.spawn(|| run_node_job(|| read().as_deref().copied())).join().unwrap(), Some(3));
            run_node_job(|| assert_eq!(read().as_deref(), Some(&3)));
            let written = run_node_job(|| users.wait(|slice| value.try_write_for(slice)).map(|mut value| *value = 7));
            assert_eq!(written, Some(()));
        });
        assert_eq!(*value.read(), 7);
    }

    #[test]
    fn nobody_waits_for_itself_for_a_leaked_guard_or_in_a_circle() {
        let [first, second] = [(); 2].map(|()| Chunk::default());
        let held = first.take().unwrap();
        assert!(first.take().is_none(), "this job holds it");
        drop(held);
        thread::scope(|threads| {
            let leak = || run_node_job(|| std::mem::forget(second.take()));
            threads.spawn(leak).join().unwrap();
        });
        assert!(second.take().is_none(), "the job that held it has ended");
        // Each has one of two and wants the other's.
        let chunks = [(); 2].map(|()| Chunk::default());
        let both_hold = std::sync::Barrier::new(2);
        let has_both = thread::scope(|threads| {
            let take_both = |index: usize| {
                run_node_job(|| {
                    let _own = chunks[index].take().unwrap();
                    both_hold.wait();
                    chunks[1 - index].take().is_some()
                })
            };
            let jobs = [0, 1].map(|index| threads.spawn(move || take_both(index)));
            jobs.map(|job| job.join().unwrap())
        });
        assert!(has_both != [true; 2], "one of them gives up, and then the other may go on");
    }
}
