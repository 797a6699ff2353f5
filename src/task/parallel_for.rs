//! One loop, run by as many workers as join it.
//!
//! A loop of a thousand chunks is not a thousand jobs. It is a *pass*: a ticket that counts the chunks taken, and one
//! token in some queue. Whoever comes across the token joins the pass: it takes chunks by ticket until there are none, and
//! puts a token back for the next one as long as there are workers that have not joined. So workers join in a chain, as far
//! as there is work.
//!
//! Where somebody would have to be woken for it, a loop of many chunks is begun by the caller alone. A few chunks show whether
//! the loop is worth a wake-up.
//!
//! A worker that waits inside a chunk, for a scope or a loop nested in it, takes up nothing but what belongs to that. So no
//! second chunk begins on top of the first, and the body of the loop is not entered anew on a worker that is in the
//! midst of it.

use std::ops::Range;

use crossbeam_utils::CachePadded;

use crate::{
    sync::Instant,
    unwind::{JobPanic, catch},
};

use super::{
    chunks::Chunks,
    priority::Priority,
    region::{TokenContext, Tokens, run_tokens},
    tickets::{TicketSize, Tickets},
    worker::Worker,
};

/// How many chunks for each worker make a loop one of which the first chunk may be run before the others are called: the
/// loop takes longer by no more than this part.
const MANY: usize = 16;

/// A loop that is being run.
pub(super) struct Pass<Body> {
    body: Body,
    chunks: Chunks,
    tickets: CachePadded<Tickets>,
}

impl<Body: Fn(Range<usize>, &Worker) + Sync> Pass<Body> {
    pub(super) fn new(length: usize, chunk: usize, body: Body) -> Self {
        Self { body, chunks: Chunks::new(length, chunk), tickets: CachePadded::new(Tickets::new()) }
    }

    /// Runs the whole pass, beginning on this worker, and drops it. Does not unwind.
    pub(super) fn run(mut self, worker: &Worker) -> Result<(), JobPanic> {
        let outcome = self.run_all(worker);
        outcome.and(catch(|| drop(self)))
    }

    fn run_all(&mut self, worker: &Worker) -> Result<(), JobPanic> {
        self.chunks = self.chunks.shuffled(|count| worker.draw(count));
        let count = self.chunks.count();
        let done = if count == 1 || worker.workers() == 1 {
            catch(|| self.run_chunks(0..count, worker)).map(|()| count)
        } else if count >= MANY * worker.workers() && worker.may_be_alone() {
            catch(|| self.begin_alone(worker))
        } else {
            Ok(0)
        }?;
        if done == count {
            return Ok(());
        }
        self.tickets.reset(done);
        run_tokens(worker, &*self, |crew| self.join(crew))
    }

    /// Runs chunks as long as all of them seem to be less work than to wake somebody, and says how many.
    fn begin_alone(&self, worker: &Worker) -> usize {
        let count = self.chunks.count();
        let (start, mut done) = (Instant::now(), 0);
        while done < count {
            // Twice as many as before, so that the time is asked seldom.
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

    fn run_chunks(&self, places: Range<usize>, worker: &Worker) {
        places.for_each(|place| (self.body)(self.chunks.range(place), worker));
    }

    /// Takes chunks until there are none. After a panic nobody begins another.
    fn join(&self, crew: &TokenContext<'_>) {
        let pace = self.tickets.join();
        if let Err(panic) = catch(|| self.work(pace, crew)) {
            self.tickets.cancel();
            crew.fail(panic);
        }
    }

    fn work(&self, mut pace: TicketSize, crew: &TokenContext<'_>) {
        let worker = crew.worker();
        loop {
            let places = self.tickets.take(&self.chunks, &mut pace, worker.workers(), Instant::now);
            if places.is_empty() {
                return;
            }
            if self.tickets.should_invite(places.end, &self.chunks, worker.workers()) {
                crew.push(0, Priority::Normal);
            }
            for place in places {
                if self.tickets.are_cancelled() {
                    return;
                }
                (self.body)(self.chunks.range(place), worker);
            }
        }
    }
}

impl<Body: Fn(Range<usize>, &Worker) + Sync> Tokens for Pass<Body> {
    /// There is but one sort of token.
    fn run(&self, _token: u64, crew: &TokenContext<'_>) {
        self.join(crew);
    }
}
