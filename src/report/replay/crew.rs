//! The workers of a replay: their queues, who of them looks for work, who sleeps, and who wakes whom. It follows
//! `task/worker.rs`, `task/idle.rs` and `task/sleep.rs`.
//!
//! A worker that looks does so all the time, so it is there at the moment that a token is pushed. Every token lies in a queue, as
//! in a run that a thread from outside calls for; mailboxes, through which workers hand on tokens of a run in a job, are left out.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, VecDeque},
};

use crate::task::Priority;

use super::{costs::nanoseconds, prices::Prices};

/// A worker that others count on looks for work for no longer than that, in nanoseconds, whatever a wake-up costs.
const LONGEST_LOOK: u64 = 100_000;

/// The workers, and the clock. Times are in nanoseconds since the run began. `T` is what lies in the queues, `A` what a
/// worker is to do.
pub(super) struct Crew<T, A> {
    now: u64,
    members: Vec<Member<T, A>>,
    /// The last to lie down is called first.
    sleepers: Vec<usize>,
    /// What the owner alone may run.
    mailbox: VecDeque<T>,
    /// When whose next moment is: the time, a number that tells those of one time apart, the worker, and which of its
    /// moments it is.
    moments: BinaryHeap<Reverse<(u64, u64, usize, u64)>>,
    moments_set: u64,
    wake: u64,
    waker: u64,
    silence: u64,
}

struct Member<T, A> {
    state: State<A>,
    /// One queue for each band of a frame, the newest last.
    bands: [VecDeque<T>; Priority::FRAME.len()],
    /// Whom to steal from first.
    victim: usize,
    /// Since when it has had nothing to do.
    idle_since: Option<u64>,
    /// Whether it was woken and has found nothing yet.
    is_called: bool,
    /// Which of its moments counts: those before have been overtaken.
    moment: u64,
}

/// What a worker does until its next moment, and at it.
enum State<A> {
    /// It is at something, and then does this.
    Busy(A),
    /// It is at something, or on its way, and then looks for the next thing.
    Coming,
    /// It looks, and then goes to sleep.
    Looking,
    Asleep,
}

/// What the worker does whose moment has come.
pub(super) enum Turn<T, A> {
    Go(A),
    /// Takes this up, which it has found in its own queue or has stolen.
    TakeUp {
        token: T,
        is_stolen: bool,
        spent: u64,
    },
    /// There is nothing to do.
    Rest,
}

impl<T, A> Crew<T, A> {
    /// The owner of the run is awake and begins with this, all others sleep.
    pub(super) fn new(workers: usize, prices: &Prices, first: A) -> Self {
        let member = |_| Member {
            state: State::Asleep,
            bands: Default::default(),
            victim: 0,
            idle_since: None,
            is_called: false,
            moment: 0,
        };
        let mut crew = Self {
            now: 0,
            members: (0..workers).map(member).collect(),
            sleepers: (1..workers).rev().collect(),
            mailbox: VecDeque::new(),
            moments: BinaryHeap::new(),
            moments_set: 0,
            wake: nanoseconds(prices.wake),
            waker: nanoseconds(prices.waker),
            silence: nanoseconds(prices.silence),
        };
        crew.set(0, State::Busy(first), 0);
        crew
    }

    pub(super) fn now(&self) -> u64 {
        self.now
    }

    pub(super) fn workers(&self) -> usize {
        self.members.len()
    }

    /// Whether nobody is at anything, nor comes.
    pub(super) fn is_idle(&self) -> bool {
        let rests = |member: &Member<T, A>| match member.state {
            State::Busy(_) => false,
            State::Coming => member.is_called,
            State::Looking | State::Asleep => true,
        };
        self.members.iter().all(rests) && !self.has_pinned() && self.members.iter().all(|member| member.is_empty())
    }

    /// How long it takes the owner of the run to see that it has ended, which this worker was the last to see.
    pub(super) fn end(&self, last: usize, steal: u64) -> u64 {
        match self.members[0].state {
            _ if last == 0 => 0,
            State::Asleep => self.wake,
            _ => steal,
        }
    }

    /// Goes on to the next moment: whose it is, and what that worker does.
    pub(super) fn turn(&mut self) -> Option<(usize, Turn<T, A>)> {
        loop {
            let Reverse((time, _, worker, moment)) = self.moments.pop()?;
            if self.members[worker].moment != moment {
                continue;
            }
            self.now = time;
            match std::mem::replace(&mut self.members[worker].state, State::Asleep) {
                State::Busy(action) => return Some((worker, Turn::Go(action))),
                State::Coming => return Some((worker, self.look(worker))),
                State::Looking => self.lie_down(worker),
                State::Asleep => {}
            }
        }
    }

    /// The worker is at something for so long, and then does that; or looks for the next thing, if that is `None`.
    pub(super) fn go_on(&mut self, worker: usize, spent: u64, then: Option<A>) {
        let state = then.map_or(State::Coming, State::Busy);
        self.set(worker, state, self.now + spent);
    }

    /// Queues a token of this worker, and says how long that takes the worker.
    pub(super) fn push(&mut self, worker: usize, token: T, band: Priority) -> u64 {
        self.members[worker].bands[band as usize].push_back(token);
        let spent = self.wake_any();
        let looker = self.members.iter().position(|member| matches!(member.state, State::Looking));
        if let Some(looker) = looker {
            self.set(looker, State::Coming, self.now);
        }
        spent
    }

    /// Hands a token to the owner, and says how long that takes this worker.
    pub(super) fn push_pinned(&mut self, worker: usize, token: T) -> u64 {
        self.mailbox.push_back(token);
        match self.members[0].state {
            State::Looking => self.set(0, State::Coming, self.now),
            State::Asleep if worker != 0 => {
                self.sleepers.retain(|&sleeper| sleeper != 0);
                return self.call(0);
            }
            _ => {}
        }
        0
    }

    /// Whether a token waits that the owner alone may run.
    pub(super) fn has_pinned(&self) -> bool {
        !self.mailbox.is_empty()
    }

    fn set(&mut self, worker: usize, state: State<A>, time: u64) {
        let member = &mut self.members[worker];
        member.state = state;
        member.moment += 1;
        self.moments_set += 1;
        self.moments.push(Reverse((time, self.moments_set, worker, member.moment)));
    }

    fn look(&mut self, worker: usize) -> Turn<T, A> {
        let Some((token, is_stolen)) = self.find(worker) else {
            let since = *self.members[worker].idle_since.get_or_insert(self.now);
            self.set(worker, State::Looking, since + self.silence + self.wake.min(LONGEST_LOOK));
            return Turn::Rest;
        };
        let has_searched = self.is_searching(&self.members[worker]);
        let member = &mut self.members[worker];
        (member.idle_since, member.is_called) = (None, false);
        let others = |(other, member): (usize, &Member<T, A>)| other != worker && !member.is_empty();
        let sees_more = has_searched && self.members.iter().enumerate().any(others);
        Turn::TakeUp { token, is_stolen, spent: if sees_more { self.wake_any() } else { 0 } }
    }

    fn find(&mut self, worker: usize) -> Option<(T, bool)> {
        if worker == 0
            && let Some(token) = self.mailbox.pop_front()
        {
            return Some((token, false));
        }
        if let Some(token) = self.members[worker].bands.iter_mut().find_map(VecDeque::pop_back) {
            return Some((token, false));
        }
        let (first, count) = (self.members[worker].victim, self.members.len());
        for band in Priority::FRAME {
            for victim in (first..count).chain(0..first).filter(|&victim| victim != worker) {
                if let Some(token) = self.members[victim].bands[band as usize].pop_front() {
                    self.members[worker].victim = victim;
                    return Some((token, true));
                }
            }
        }
        None
    }

    fn lie_down(&mut self, worker: usize) {
        let member = &mut self.members[worker];
        (member.idle_since, member.is_called) = (None, false);
        self.sleepers.push(worker);
    }

    /// Wakes somebody, unless somebody searches. Says how long that takes.
    fn wake_any(&mut self) -> u64 {
        if self.sleepers.is_empty() || self.members.iter().any(|member| self.is_searching(member)) {
            return 0;
        }
        self.sleepers.pop().map_or(0, |sleeper| self.call(sleeper))
    }

    fn call(&mut self, sleeper: usize) -> u64 {
        self.members[sleeper].is_called = true;
        self.set(sleeper, State::Coming, self.now + self.wake);
        self.waker
    }

    fn is_searching(&self, member: &Member<T, A>) -> bool {
        member.is_called || member.idle_since.is_some_and(|since| self.now - since >= self.silence)
    }
}

impl<T, A> Member<T, A> {
    fn is_empty(&self) -> bool {
        self.bands.iter().all(VecDeque::is_empty)
    }
}
