//! A loop that several workers run together.
//!
//! A loop of a thousand chunks is not a thousand jobs. It is a counter of claimed chunks and one token in some queue. A
//! worker that takes the token joins the loop: it claims chunks until there are none, and queues the token again for
//! the next worker as long as not all workers have joined. So workers join one after another, as long as there is work.
//!
//! If a worker would have to be woken, the caller begins a loop of many chunks serially. A few chunks show whether the
//! loop is worth a wake-up.
//!
//! A worker that waits inside a chunk, for a scope or a loop nested in it, runs only jobs of that. So no second chunk
//! begins on top of the first, and the body of the loop is never entered again on a worker that is inside it.

use std::ops::Range;

use crossbeam_utils::CachePadded;

use super::chunks::Chunks;
use super::priority::Priority;
use super::tickets::{TicketSize, Tickets};
use super::tokens::{TokenContext, Tokens, run_tokens};
use super::worker::Worker;
use crate::sync::Instant;
use crate::unwind::{JobPanic, catch};

/// A loop with this many chunks for each worker may begin serially: running one chunk before the other workers join
/// makes the loop longer by no more than this fraction.
const SERIAL_START_CHUNKS: usize = 16;

/// A loop that is being run.
pub(super) struct ParallelLoop<Body> {
    body: Body,
    chunks: Chunks,
    tickets: CachePadded<Tickets>,
}

impl<Body: Fn(Range<usize>, &Worker) + Sync> ParallelLoop<Body> {
    pub(super) fn new(length: usize, chunk: usize, body: Body) -> Self {
        Self { body, chunks: Chunks::new(length, chunk), tickets: CachePadded::new(Tickets::new()) }
    }

    /// Runs all chunks, beginning on this worker, and drops the loop. Does not unwind.
    pub(super) fn run(mut self, worker: &Worker) -> Result<(), JobPanic> {
        let outcome = self.run_all(worker);
        outcome.and(catch(|| drop(self)))
    }

    fn run_all(&mut self, worker: &Worker) -> Result<(), JobPanic> {
        self.chunks = self.chunks.shuffled(|count| worker.draw(count));
        let count = self.chunks.count();
        let done = if count == 1 || worker.workers() == 1 {
            catch(|| self.run_chunks(0..count, worker)).map(|()| count)
        } else if count >= SERIAL_START_CHUNKS * worker.workers() && worker.may_begin_serially() {
            catch(|| self.begin_serially(worker))
        } else {
            Ok(0)
        }?;
        if done == count {
            return Ok(());
        }
        self.tickets.reset(done);
        run_tokens(worker, &*self, |context| self.join(context))
    }

    /// Runs chunks as long as the whole loop seems to be shorter than a wake-up. Returns how many have run.
    fn begin_serially(&self, worker: &Worker) -> usize {
        let count = self.chunks.count();
        let (start, mut done) = (Instant::now(), 0);
        while done < count {
            // Doubles the number of chunks, so that few readings of the clock are needed.
            let next = (2 * done).clamp(1, count);
            self.run_chunks(done..next, worker);
            done = next;
            let expected = start.elapsed().as_nanos() * (count / done) as u128;
            if expected > worker.wake_up_cost().as_nanos() {
                break;
            }
        }
        done
    }

    fn run_chunks(&self, positions: Range<usize>, worker: &Worker) {
        positions.for_each(|position| (self.body)(self.chunks.range(position), worker));
    }

    /// Runs chunks until none are left. After a panic no worker begins another chunk.
    fn join(&self, context: &TokenContext<'_>) {
        let size = self.tickets.join();
        if let Err(panic) = catch(|| self.work(size, context)) {
            self.tickets.cancel();
            context.fail(panic);
        }
    }

    fn work(&self, mut size: TicketSize, context: &TokenContext<'_>) {
        let worker = context.worker();
        loop {
            let positions = self.tickets.take(&self.chunks, &mut size, worker.workers(), Instant::now);
            if positions.is_empty() {
                return;
            }
            if self.tickets.should_invite(positions.end, &self.chunks, worker.workers()) {
                context.push(0, Priority::Normal);
            }
            for position in positions {
                if self.tickets.are_cancelled() {
                    return;
                }
                (self.body)(self.chunks.range(position), worker);
            }
        }
    }
}

impl<Body: Fn(Range<usize>, &Worker) + Sync> Tokens for ParallelLoop<Body> {
    /// The only token of a loop is an invitation to join it.
    fn run(&self, _token: u64, context: &TokenContext<'_>) {
        self.join(context);
    }
}
