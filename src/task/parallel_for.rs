//! One loop, run by as many workers as join it.
//!
//! A loop of a thousand chunks is not a thousand jobs. It is a *pass*: a ticket that counts the chunks taken, and one
//! token, a job in some deque. Whoever comes across the token joins the pass: it puts the token back for the next one,
//! if there is more than one chunk left, and takes chunks by ticket until there are none. So workers join in a chain,
//! as far as there is work, and a chunk costs one addition.
//!
//! A worker that waits inside a chunk, for a scope or a loop nested in it, may come across the token of the very pass
//! it is in. It takes no second chunk on top of the first. Otherwise every chunk could come to lie on the stack of one
//! thread, and the loop's body would be entered anew on a worker that is in the midst of it. It holds the token, and
//! puts it back when it has finished its chunk.
//!
//! # Memory ordering
//!
//! The ticket is relaxed: it only has to give every number once, which a read-modify-write does in any order. That the
//! pass is set up before somebody takes a ticket is ordered by the deque that brought the token, and that the chunks'
//! effects are seen by the caller, by the latch of the scope the tokens are jobs of.

use std::{ops::Range, ptr};

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicUsize, Ordering};

use super::{
    job::{JobPanic, catch},
    scope::{self, Scope},
    worker::Worker,
};

/// A loop that is being run.
pub(super) struct Pass<Body> {
    body: Body,
    length: usize,
    chunk: usize,
    chunks: usize,
    /// The next chunk. Every worker that finds no chunk left counts it one further.
    ticket: CachePadded<AtomicUsize>,
}

/// The most chunks of a pass. Beyond it are as many tickets again, more than there can be workers to count too far.
const MOST_CHUNKS: usize = usize::MAX / 2;

impl<Body: Fn(Range<usize>, &Worker) + Sync> Pass<Body> {
    pub(super) fn new(length: usize, chunk: usize, body: Body) -> Self {
        let chunk = chunk.max(1).max(length.div_ceil(MOST_CHUNKS));
        Self { body, length, chunk, chunks: length.div_ceil(chunk), ticket: CachePadded::new(AtomicUsize::new(0)) }
    }

    /// Runs the whole pass, beginning on this worker. Does not unwind.
    pub(super) fn run(&self, worker: &Worker) -> Result<(), JobPanic> {
        if self.chunks <= 1 || worker.shared().workers() == 1 {
            return catch(|| {
                while let Some(range) = self.take() {
                    (self.body)(range, worker);
                }
            });
        }
        scope::open(worker, |scope| self.join(scope, worker))
    }

    /// What the token does: takes chunks until there are none.
    fn join<'scope>(&'scope self, scope: &Scope<'scope>, worker: &Worker) {
        if !worker.enter(ptr::from_ref(self).addr()) {
            return;
        }
        let outcome = catch(|| {
            loop {
                if self.remaining() > 1 && worker.take_token() {
                    scope.spawn(|scope, worker| self.join(scope, worker));
                }
                let Some(range) = self.take() else { return };
                (self.body)(range, worker);
            }
        });
        worker.leave();
        if let Err(panic) = outcome {
            scope.state().fail(panic);
            self.skip_the_rest();
        }
    }

    fn take(&self) -> Option<Range<usize>> {
        let ticket = self.ticket.fetch_add(1, Ordering::Relaxed);
        if ticket >= self.chunks {
            return None;
        }
        let start = ticket * self.chunk;
        Some(start..start.saturating_add(self.chunk).min(self.length))
    }

    fn remaining(&self) -> usize {
        self.chunks.saturating_sub(self.ticket.load(Ordering::Relaxed))
    }

    /// Leaves no chunk to be taken. Where the ticket is further already, it may go back: to where there is none either.
    fn skip_the_rest(&self) {
        self.ticket.store(self.chunks, Ordering::Relaxed);
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::{
        cell::Cell,
        sync::{
            Barrier,
            atomic::{AtomicBool, Ordering},
        },
        thread,
        time::Duration,
    };

    use crate::task::Scheduler;

    thread_local! {
        static INSIDE: Cell<bool> = const { Cell::new(false) };
    }

    /// Waits for that, as long as the slowest machine may take, and says whether it came.
    fn eventually(condition: impl Fn() -> bool) -> bool {
        (0..10_000).any(|_look| {
            condition() || {
                thread::sleep(Duration::from_millis(1));
                false
            }
        })
    }

    /// Brings three workers, step by step, to where one waits inside a chunk and nothing is left but the token of its
    /// pass.
    #[test]
    fn a_worker_that_waits_inside_a_chunk_holds_the_token_and_passes_it_on_later() {
        let scheduler = Scheduler::new(3).unwrap();
        let [busy, joined, free, nested] = [(); 4].map(|()| Barrier::new(2));
        let last_begun = AtomicBool::new(false);
        let wait_for_last = || assert!(eventually(|| last_begun.load(Ordering::Relaxed)), "the token was lost");
        let outcome = scheduler.scope(|scope| {
            // One worker is kept busy, so only one can join the pass.
            scope.spawn(|_scope, _worker| {
                busy.wait();
                free.wait();
            });
            busy.wait();
            let outcome = scheduler.parallel_for(4, 1, |range, worker| {
                assert!(!INSIDE.replace(true), "a chunk began on top of another");
                match (range.start, worker.index()) {
                    // The caller waits, and comes across the token, which is with the other worker of the pass by now.
                    (0 | 1, 0) => {
                        joined.wait();
                        let waited = scheduler.scope(|scope| {
                            scope.spawn(|_scope, worker| {
                                nested.wait();
                                assert!(
                                    eventually(|| worker.shared().sleep().sleepers() == 1),
                                    "the caller is at work"
                                );
                            });
                            free.wait();
                            nested.wait();
                        });
                        assert_eq!(waited, Ok(()));
                    }
                    (0 | 1, _) => {
                        joined.wait();
                        wait_for_last();
                    }
                    // Back from its wait, the caller goes on, and the worker it waited for joins.
                    (2, _) => wait_for_last(),
                    _ => last_begun.store(true, Ordering::Relaxed),
                }
                INSIDE.set(false);
            });
            assert_eq!(outcome, Ok(()));
        });
        assert_eq!(outcome, Ok(()));
    }
}
