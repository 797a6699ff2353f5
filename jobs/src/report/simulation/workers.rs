//! The simulated workers: their queues, which of them search for work or sleep, and who wakes whom. This follows
//! `task/worker.rs`, `task/queues.rs`, `task/idle.rs`, `task/frame_gaps.rs` and `task/sleep.rs`.
//!
//! It is a discrete-event simulation: the clock jumps from one event to the next. A worker that searches does so all
//! the time, so it reacts as soon as a token is pushed. All tokens lie in queues, as in a run that a thread outside of
//! the scheduler calls for. Mailboxes, through which workers of a run inside a job pass on tokens, are not simulated.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::measured_run::nanoseconds;
use super::scheduler_costs::SchedulerCosts;
use crate::task::{MAX_SPIN, Priority};

/// The workers, and the clock. Times are in nanoseconds since the run began. `T` is what lies in the queues, `A` what a
/// worker does.
pub(super) struct SimulatedWorkers<T, A> {
    now: u64,
    workers: Vec<SimulatedWorker<T, A>>,
    /// The last one to fall asleep is woken first.
    sleepers: Vec<usize>,
    /// What only the calling thread may run.
    pinned: VecDeque<T>,
    /// The upcoming events: the time, a sequence number that orders events of one time, and the worker.
    events: BinaryHeap<Reverse<(u64, u64, usize)>>,
    events_scheduled: u64,
    wake: u64,
    waker: u64,
    uncounted_search: u64,
}

struct SimulatedWorker<T, A> {
    state: State<A>,
    /// One queue for each priority of frame work, the newest last.
    queues: [VecDeque<T>; Priority::FRAME.len()],
    /// The worker to steal from first.
    victim: usize,
    /// Since when it has had nothing to do.
    idle_since: Option<u64>,
    /// Whether it was woken and has found nothing yet.
    is_called: bool,
    /// The sequence number of its next event. Its earlier events are void.
    next_event: u64,
}

/// What a worker does until its next event, and what it does then.
enum State<A> {
    /// It is busy, and then does this.
    Busy(A),
    /// It is busy or waking up, and then looks for work.
    WillSearch,
    /// It searches for work, and then goes to sleep.
    Searching,
    Asleep,
}

/// What a worker does at its event.
pub(super) enum Event<T, A> {
    Act(A),
    /// It found this token in its own queue, or stole it.
    TakeUp {
        token: T,
        is_stolen: bool,
        spent: u64,
    },
    /// It found nothing to do.
    Idle,
}

impl<T, A> SimulatedWorkers<T, A> {
    /// Worker 0, the calling thread, begins with `first`. All others look for work if they `are_awake`, and sleep
    /// otherwise.
    pub(super) fn new(count: usize, costs: &SchedulerCosts, are_awake: bool, first: A) -> Self {
        let worker = |_| SimulatedWorker {
            state: State::Asleep,
            queues: Default::default(),
            victim: 0,
            idle_since: None,
            is_called: false,
            next_event: 0,
        };
        let mut workers = Self {
            now: 0,
            workers: (0..count).map(worker).collect(),
            sleepers: if are_awake { Vec::new() } else { (1..count).rev().collect() },
            pinned: VecDeque::new(),
            events: BinaryHeap::new(),
            events_scheduled: 0,
            wake: nanoseconds(costs.wake),
            waker: nanoseconds(costs.waker),
            uncounted_search: nanoseconds(costs.uncounted_search),
        };
        workers.schedule(0, State::Busy(first), 0);
        if are_awake {
            (1..count).for_each(|worker| workers.schedule(worker, State::WillSearch, 0));
        }
        workers
    }

    pub(super) fn now(&self) -> u64 {
        self.now
    }

    pub(super) fn count(&self) -> usize {
        self.workers.len()
    }

    /// Whether no worker is busy, or about to be, and all queues are empty.
    pub(super) fn is_idle(&self) -> bool {
        let is_idle = |worker: &SimulatedWorker<T, A>| match worker.state {
            State::Busy(_) => false,
            State::WillSearch => worker.is_called,
            State::Searching | State::Asleep => true,
        };
        self.workers.iter().all(is_idle) && !self.has_pinned() && self.workers.iter().all(|worker| worker.is_empty())
    }

    /// How long it takes the calling thread to notice the end of the run, after `last` was the last worker to go idle.
    pub(super) fn time_to_notice_end(&self, last: usize, steal: u64) -> u64 {
        match self.workers[0].state {
            _ if last == 0 => 0,
            State::Asleep => self.wake,
            _ => steal,
        }
    }

    /// Advances the clock to the next event. Returns the worker, and what it does.
    pub(super) fn next_event(&mut self) -> Option<(usize, Event<T, A>)> {
        loop {
            let Reverse((time, event, worker)) = self.events.pop()?;
            if self.workers[worker].next_event != event {
                continue;
            }
            self.now = time;
            match std::mem::replace(&mut self.workers[worker].state, State::Asleep) {
                State::Busy(action) => return Some((worker, Event::Act(action))),
                State::WillSearch => return Some((worker, self.look_for_work(worker))),
                State::Searching => self.fall_asleep(worker),
                State::Asleep => {}
            }
        }
    }

    /// The worker is busy for `spent`, and then does `then`. If that is `None`, it looks for work.
    pub(super) fn resume(&mut self, worker: usize, spent: u64, then: Option<A>) {
        let state = then.map_or(State::WillSearch, State::Busy);
        self.schedule(worker, state, self.now + spent);
    }

    /// Pushes a token to the queue of this worker. Returns how long that takes the worker.
    pub(super) fn push(&mut self, worker: usize, token: T, priority: Priority) -> u64 {
        self.workers[worker].queues[priority as usize].push_back(token);
        let spent = self.wake_one();
        let searching = self.workers.iter().position(|worker| matches!(worker.state, State::Searching));
        if let Some(searching) = searching {
            self.schedule(searching, State::WillSearch, self.now);
        }
        spent
    }

    /// Hands a token to the calling thread. Returns how long that takes this worker.
    pub(super) fn push_pinned(&mut self, worker: usize, token: T) -> u64 {
        self.pinned.push_back(token);
        match self.workers[0].state {
            State::Searching => self.schedule(0, State::WillSearch, self.now),
            State::Asleep if worker != 0 => {
                self.sleepers.retain(|&sleeper| sleeper != 0);
                return self.wake(0);
            }
            _ => {}
        }
        0
    }

    /// Whether there is a token that only the calling thread may run.
    pub(super) fn has_pinned(&self) -> bool {
        !self.pinned.is_empty()
    }

    fn schedule(&mut self, worker: usize, state: State<A>, time: u64) {
        self.events_scheduled += 1;
        let event = self.events_scheduled;
        (self.workers[worker].state, self.workers[worker].next_event) = (state, event);
        self.events.push(Reverse((time, event, worker)));
    }

    fn look_for_work(&mut self, worker: usize) -> Event<T, A> {
        let Some((token, is_stolen)) = self.find(worker) else {
            let since = *self.workers[worker].idle_since.get_or_insert(self.now);
            let spin = self.uncounted_search + self.wake.min(nanoseconds(MAX_SPIN));
            self.schedule(worker, State::Searching, since + spin);
            return Event::Idle;
        };
        let was_searching = self.is_searching(&self.workers[worker]);
        (self.workers[worker].idle_since, self.workers[worker].is_called) = (None, false);
        let has_work = |(other, victim): (usize, &SimulatedWorker<T, A>)| other != worker && !victim.is_empty();
        let sees_more = was_searching && self.workers.iter().enumerate().any(has_work);
        Event::TakeUp { token, is_stolen, spent: if sees_more { self.wake_one() } else { 0 } }
    }

    fn find(&mut self, worker: usize) -> Option<(T, bool)> {
        if worker == 0
            && let Some(token) = self.pinned.pop_front()
        {
            return Some((token, false));
        }
        if let Some(token) = self.workers[worker].queues.iter_mut().find_map(VecDeque::pop_back) {
            return Some((token, false));
        }
        let (first, count) = (self.workers[worker].victim, self.workers.len());
        for priority in Priority::FRAME {
            for victim in (first..count).chain(0..first).filter(|&victim| victim != worker) {
                if let Some(token) = self.workers[victim].queues[priority as usize].pop_front() {
                    self.workers[worker].victim = victim;
                    return Some((token, true));
                }
            }
        }
        None
    }

    fn fall_asleep(&mut self, worker: usize) {
        (self.workers[worker].idle_since, self.workers[worker].is_called) = (None, false);
        self.sleepers.push(worker);
    }

    /// Wakes a worker, unless one is searching. Returns how long that takes.
    fn wake_one(&mut self) -> u64 {
        if self.sleepers.is_empty() || self.workers.iter().any(|worker| self.is_searching(worker)) {
            return 0;
        }
        self.sleepers.pop().map_or(0, |sleeper| self.wake(sleeper))
    }

    fn wake(&mut self, sleeper: usize) -> u64 {
        self.workers[sleeper].is_called = true;
        self.schedule(sleeper, State::WillSearch, self.now + self.wake);
        self.waker
    }

    fn is_searching(&self, worker: &SimulatedWorker<T, A>) -> bool {
        worker.is_called || worker.idle_since.is_some_and(|since| self.now - since >= self.uncounted_search)
    }
}

impl<T, A> SimulatedWorker<T, A> {
    fn is_empty(&self) -> bool {
        self.queues.iter().all(VecDeque::is_empty)
    }
}
