//! What a worker does: it runs jobs, looks for jobs, and sleeps.

use std::cell::Cell;
use std::marker::PhantomData;
use std::rc::Rc;
use std::time::Duration;
use std::{fmt, mem, ptr};

use super::background_queue::QueuedJob;
use super::idle::Idle;
use super::job::{Job, Work};
use super::prepaid_count::PrepaidCount;
use super::priority::Priority;
use super::queues::{Popped, Queues};
use super::region::{JobContext, Region, RegionKind, RunToken};
use super::shared::Shared;
use super::sleep::WakeFor;
use crate::sync::{Arc, Ordering, fence};
use crate::timeline::Timeline;
use crate::unwind::{AbortOnUnwind, JobPanic, catch, discard};

/// Proof that code runs as a job of a scheduler: a reference to a worker exists only there, and stays on its thread.
///
/// No two threads are the same worker at the same time, so no two threads use an engine's data of one
/// [`index`](Self::index) at once. But while a job waits in a scope or a loop that it opened, other jobs of that scope
/// may run on top of it, on the same worker: do not keep these data borrowed over a wait.
///
/// ```compile_fail,E0277
/// # let scheduler = drawloom_jobs::task::Scheduler::new(2)?;
/// scheduler.scope(|scope| {
///     // The reference would be on a thread that is no worker.
///     scope.spawn(|_scope, worker| std::thread::scope(|threads| { threads.spawn(|| worker.index()); }));
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Worker {
    index: usize,
    queues: Box<Queues<Self>>,
    shared: Arc<Shared<Self>>,
    /// The first worker to steal from: the last one that had something.
    victim: Cell<usize>,
    /// How many regions are open on this worker, each inside a job of the one before.
    depth: Cell<usize>,
    /// Whether the running job is a background job.
    is_in_background: Cell<bool>,
    /// Whether the running job was stolen, until [`clear_stolen`](Self::clear_stolen).
    has_stolen: Cell<bool>,
    prepaid: PrepaidCount<Self>,
    /// The innermost region that this worker waits for inside a job. The newest jobs of its own queues belong to it.
    awaited: Cell<Option<&'static Region<Self>>>,
    /// The next worker that this thread is (see `current_worker`).
    pub(super) outer: Cell<*const Self>,
    not_send: PhantomData<Rc<()>>,
}

impl JobContext for Worker {
    type Shared = Shared<Self>;
}

/// When a worker stops working.
#[derive(Clone, Copy)]
pub(super) enum ExitCondition {
    /// The scheduler is dropped.
    Shutdown,
    /// All jobs of the region have run. The worker opened the region, and runs its pinned jobs. Inside a job the worker
    /// takes only jobs of the region: a foreign job might take long, or need values that the job has borrowed.
    Finished { region: &'static Region<Worker> },
}

/// What a worker's thread runs while it holds a background slot.
enum BackgroundTask {
    /// A job of a scope, a loop or a graph of a background job.
    Part(Job<Worker>),
    /// A background job.
    Whole(std::sync::Arc<dyn QueuedJob>),
}

/// The wait inside of which a worker opens a region, and goes on with afterwards.
struct InterruptedWait {
    awaited: Option<&'static Region<Worker>>,
    /// As [`Queues::end_wait`] takes it.
    pushed: [usize; Priority::ALL.len()],
}

impl Worker {
    pub(super) fn new(index: usize, queues: Box<Queues<Self>>, shared: Arc<Shared<Self>>) -> Self {
        Self {
            index,
            queues,
            shared,
            victim: Cell::new(0),
            depth: Cell::new(0),
            is_in_background: Cell::new(false),
            has_stolen: Cell::new(false),
            prepaid: PrepaidCount::new(),
            awaited: Cell::new(None),
            outer: Cell::new(ptr::null()),
            not_send: PhantomData,
        }
    }

    /// The index of this worker, from 0 up to [`Scheduler::workers`](super::Scheduler::workers). 0 is the thread that
    /// called the scheduler.
    #[inline]
    pub fn index(&self) -> usize {
        self.index
    }

    #[inline]
    pub(super) fn shared(&self) -> &Arc<Shared<Self>> {
        &self.shared
    }

    /// How many workers the scheduler has.
    #[inline]
    pub(crate) fn workers(&self) -> usize {
        self.shared.workers()
    }

    /// How long it takes to wake a worker.
    #[inline]
    pub(crate) fn wake_up_cost(&self) -> Duration {
        self.shared.wake_up_cost()
    }

    #[inline]
    #[doc(hidden)]
    pub fn timeline(&self) -> &Timeline {
        self.shared.timeline()
    }

    /// Whether the running job was stolen.
    #[inline]
    pub(crate) fn has_stolen(&self) -> bool {
        self.has_stolen.get()
    }

    /// Ends the part of the running job that was stolen: from here on the job does work of its own.
    #[inline]
    pub(crate) fn clear_stolen(&self) {
        self.has_stolen.set(false);
    }

    /// How many jobs are in this worker's queues.
    pub(crate) fn queued(&self) -> usize {
        self.queues.len()
    }

    /// Whether a loop may begin on this worker alone: others sleep, and short work should not wake them.
    pub(super) fn may_begin_serially(&self) -> bool {
        !self.is_shuffled() && !self.wake_up_cost().is_zero() && self.shared.sleep().sleepers() > 0
    }

    /// Whether jobs run in a random order.
    #[inline]
    pub(crate) fn is_shuffled(&self) -> bool {
        self.shared.is_shuffled()
    }

    /// A random number below `count`, if the scheduler [shuffles](super::SchedulerBuilder::shuffle).
    pub(crate) fn draw(&self, count: usize) -> Option<usize> {
        self.queues.draw(count)
    }

    /// Whether the running job is a background job.
    pub(crate) fn is_in_background(&self) -> bool {
        self.is_in_background.get()
    }

    pub(super) fn into_queues(self) -> Box<Queues<Self>> {
        self.queues
    }

    /// Queues a job, and wakes a worker for it. Call it only inside a counted job of the region, or inside its body.
    ///
    /// The worker keeps the job in its own queues only if the owner of the region can take it from there. If the worker
    /// waits inside a job, it keeps jobs of the innermost region that it waits for, whose owner it is. Otherwise it
    /// keeps jobs of an outermost region, whose owner steals. All other jobs go to the owner's mailbox.
    pub(super) fn push(&self, region: &'static Region<Self>, work: Work<Self>, priority: Priority) {
        self.acquire_count(region);
        let job = Job { work, region, is_stolen: false };
        let priority = if region.is_background() { Priority::Background } else { priority };
        let may_keep = self.awaited.get().map_or(region.is_outermost(), |awaited| awaited.is(region));
        let (owner, level) = (region.owner(), region.level());
        if !may_keep {
            self.shared.mailbox(owner).put_shared(job);
            if priority == Priority::Background && !self.shared.has_background_slot() {
                // Only the owner may run it.
                self.shared.sleep().wake_worker(owner);
            } else {
                self.shared.sleep().wake_owner_or_other(owner, level, priority);
            }
        } else if priority == Priority::Background {
            self.queues.push(job, priority);
            self.shared.wake_for_background();
        } else {
            self.queues.push(job, priority);
            self.shared.sleep().wake_any();
        }
    }

    /// Hands a job to the owner of the region. Call it only inside a counted job of the region, or inside its body.
    pub(super) fn push_pinned(&self, region: &'static Region<Self>, work: Work<Self>) {
        self.acquire_count(region);
        let job = Job { work, region, is_stolen: false };
        self.shared.mailbox(region.owner()).put_pinned(job);
        self.wake_other(region.owner());
    }

    /// Opens a region, runs `body` in it, and works until all jobs of the region have run. Does not unwind.
    ///
    /// # Errors
    /// Returns the first [`JobPanic`] of `body` or of a job. All jobs have run nevertheless.
    pub(super) fn open_region<R>(
        &self,
        tokens: &dyn RunToken<Self>,
        body: impl FnOnce(&'static Region<Self>) -> R,
    ) -> Result<R, JobPanic> {
        // SAFETY: The types differ only in lifetimes, so the referent must outlive every use of the result. Only jobs
        // of the region use it. Each job is counted from before it is queued until it has run, `work_until_finished`
        // returns only when the count is zero, and `guard`, which is made before the first use, aborts if this function
        // unwinds before. The referent is borrowed for this whole call.
        let tokens = unsafe { mem::transmute::<&dyn RunToken<Self>, &'static dyn RunToken<Self>>(tokens) };
        let is_outermost = self.index == 0 && self.depth.get() == 0 && !self.is_in_background();
        let kind = RegionKind { is_outermost, is_background: self.is_in_background() };
        let storage = Region::new(self.index, self.depth.get(), kind, tokens, Arc::clone(&self.shared));
        // SAFETY: The storage must not move, and must outlive every use of the reference. It is a local that is not
        // moved. `body` uses the reference before it returns, jobs before they are counted off, and workers that hold a
        // prepaid count before they flush it, which the latch counts too; a thread that releases the latch does not use
        // the reference afterwards. `work_until_finished` returns only when the count is zero, and `guard` aborts if
        // this function unwinds before.
        let region: &'static Region<Self> = unsafe { &*ptr::from_ref(&storage) };
        // The last local, so that an unwind drops it before any other.
        let guard = AbortOnUnwind::new("an open region of jobs");
        let interrupted = self.enter(region);
        let result = catch(|| body(region)).inspect_err(|panic| region.fail(panic.clone()));
        let result = match self.work_until_finished(region, interrupted) {
            None => result,
            Some(first) => {
                discard(result);
                Err(first)
            }
        };
        guard.disarm();
        result
    }

    /// Enters a region: what follows belongs to it. Returns the wait that this interrupts.
    fn enter(&self, region: &'static Region<Self>) -> InterruptedWait {
        let is_outermost = region.is_outermost();
        self.depth.set(self.depth.get() + 1);
        let awaited = self.awaited.replace((!is_outermost).then_some(region));
        let interrupted = InterruptedWait { awaited, pushed: self.queues.start_wait() };
        if is_outermost {
            self.shared.placement().avoid_current_processor();
            self.shared.begin_frame();
        }
        interrupted
    }

    /// Works until all jobs of the region have run, and leaves it. Its body has returned. Returns the first panic of a
    /// job or of the body. Does not unwind.
    fn work_until_finished(&self, region: &'static Region<Self>, interrupted: InterruptedWait) -> Option<JobPanic> {
        // The count that the latch began with is that of the body.
        self.release_count(region);
        self.work(ExitCondition::Finished { region });
        if region.is_outermost() {
            self.shared.end_frame();
        }
        self.awaited.set(interrupted.awaited);
        self.queues.end_wait(interrupted.pushed);
        self.depth.set(self.depth.get() - 1);
        region.take_panic()
    }

    /// Runs jobs, and sleeps while there are none, until the exit condition holds. Does not unwind.
    pub(super) fn work(&self, until: ExitCondition) {
        let mut idle = Idle::default();
        // Kept from one background job to the next, and by a thread that ends.
        let mut has_slot = false;
        let sees_more_work = |priorities: &[Priority]| self.sees_jobs(priorities);
        loop {
            if let Some(job) = self.next_job(until) {
                self.free_background_slot(&mut has_slot);
                idle.end(self.index, &self.shared, sees_more_work);
                self.run(job);
                continue;
            }
            self.flush_counts();
            if until.holds(&self.shared) {
                break;
            }
            if matches!(until, ExitCondition::Shutdown)
                && let Some(work) = self.background_task(&mut has_slot)
            {
                idle.end(self.index, &self.shared, sees_more_work);
                match work {
                    BackgroundTask::Part(job) => self.run(job),
                    BackgroundTask::Whole(job) => _ = self.run_in_background(&*job),
                }
                continue;
            }
            self.free_background_slot(&mut has_slot);
            idle.pause(self.index, &self.shared, until.wake_for(), || self.sees_work(until));
        }
        idle.end(self.index, &self.shared, sees_more_work);
    }

    /// A background task for this thread, if it has a slot or a slot is free. Then it has one from here on.
    fn background_task(&self, has_slot: &mut bool) -> Option<BackgroundTask> {
        *has_slot = *has_slot || (self.sees_jobs(&[Priority::Background]) && self.shared.background_slots().try_take());
        if !*has_slot {
            return None;
        }
        // Parts of jobs come first: a job waits for them.
        let part = self.mailbox_job(Priority::Background).or_else(|| self.steal(&[Priority::Background]));
        let whole = || self.shared.background().take_oldest().map(BackgroundTask::Whole);
        part.map(BackgroundTask::Part).or_else(whole)
    }

    /// Frees the slot of this thread, if it has one, and wakes another worker if one may continue background jobs.
    fn free_background_slot(&self, has_slot: &mut bool) {
        if !mem::take(has_slot) {
            return;
        }
        self.shared.background_slots().release();
        fence(Ordering::SeqCst);
        if self.sees_jobs(&[Priority::Background]) {
            self.shared.sleep().wake_despite_searchers(Priority::Background);
        }
    }

    /// Runs background jobs one after another until there are none or `stop` returns true. Returns how many have run.
    pub(super) fn work_in_background(&self, mut stop: impl FnMut() -> bool) -> usize {
        let mut jobs = 0;
        while !stop() {
            let Some(job) = self.shared.background().take_oldest() else { break };
            jobs += usize::from(self.run_in_background(&*job));
        }
        jobs
    }

    /// Whether there is a job that this worker would run, or the exit condition holds.
    fn sees_work(&self, until: ExitCondition) -> bool {
        until.holds(&self.shared)
            || match until {
                ExitCondition::Shutdown => self.sees_jobs(&Priority::ALL),
                ExitCondition::Finished { region } => {
                    let mailbox = self.shared.mailbox(self.index);
                    mailbox.has_pinned(region)
                        || if region.is_outermost() {
                            self.sees_jobs(&Priority::FRAME)
                        } else {
                            mailbox.has_shared(region)
                        }
                }
            }
    }

    /// Whether this worker could take a job of these priorities from elsewhere; a background job only with a slot.
    fn sees_jobs(&self, priorities: &[Priority]) -> bool {
        let shared = &self.shared;
        let takes =
            |priority| priority != Priority::Background || (self.index > 0 && shared.background_slots().is_free());
        priorities.iter().any(|&priority| {
            let mut others = shared.stealers().iter().enumerate().filter(|&(victim, _)| victim != self.index);
            takes(priority)
                && ((priority == Priority::Background && !shared.background().is_empty())
                    || others.any(|(_, stealers)| !stealers.is_empty(priority))
                    || shared.mailboxes().any(|mailbox| mailbox.has_any_shared(priority)))
        })
    }

    #[inline]
    fn acquire_count(&self, region: &'static Region<Self>) {
        self.prepaid.acquire(region, |owner| self.wake_other(owner));
    }

    #[inline]
    fn release_count(&self, region: &'static Region<Self>) {
        self.prepaid.release(region, |owner| self.wake_other(owner));
    }

    #[inline]
    fn flush_counts(&self) {
        self.prepaid.flush(|owner| self.wake_other(owner));
    }

    /// Wakes a worker, unless it is this one.
    #[inline]
    fn wake_other(&self, worker: usize) {
        if worker != self.index {
            self.shared.sleep().wake_worker(worker);
        }
    }

    fn run(&self, job: Job<Self>) {
        let region = job.region;
        let was_in_background = self.is_in_background.replace(region.is_background());
        // The owner of another region may wait for this worker's prepaid count of it, and this job for that owner.
        self.prepaid.switch_to(region, |owner| self.wake_other(owner));
        self.has_stolen.set(job.is_stolen);
        job.run(self);
        self.is_in_background.set(was_in_background);
        self.release_count(region);
    }

    /// Runs a background job, unless another thread has begun it. Returns whether it has run.
    fn run_in_background(&self, job: &dyn QueuedJob) -> bool {
        let was_in_background = self.is_in_background.replace(true);
        let has_run = job.run();
        self.is_in_background.set(was_in_background);
        has_run
    }

    /// The next job to run. Pinned jobs come first: only this worker can run them, while others steal from its queues.
    fn next_job(&self, until: ExitCondition) -> Option<Job<Self>> {
        match until {
            ExitCondition::Shutdown => self.frame_job(),
            ExitCondition::Finished { region } => {
                let mailbox = self.shared.mailbox(self.index);
                let pinned = mailbox.take_pinned(region);
                pinned.or_else(|| {
                    if region.is_outermost() {
                        self.frame_job()
                    } else {
                        self.awaited_job(region).or_else(|| mailbox.take_shared(region))
                    }
                })
            }
        }
    }

    /// A job of a frame. Mailboxes come before stealing: owners wait for jobs in mailboxes inside other jobs.
    fn frame_job(&self) -> Option<Job<Self>> {
        let own = Priority::FRAME.into_iter().find_map(|priority| self.queues.pop(priority));
        own.or_else(|| self.mailbox_job(Priority::Normal)).or_else(|| self.steal(&Priority::FRAME))
    }

    /// A job for this priority from any worker's mailbox.
    fn mailbox_job(&self, priority: Priority) -> Option<Job<Self>> {
        let job = self.shared.mailboxes().find_map(|mailbox| mailbox.take_any_shared(priority))?;
        Some(Job { is_stolen: true, ..job })
    }

    /// The newest job of this worker's queues, if it belongs to the region that the worker waits for inside a job.
    fn awaited_job(&self, region: &Region<Self>) -> Option<Job<Self>> {
        Priority::ALL.into_iter().find_map(|priority| match self.queues.pop_awaited(priority, region) {
            Popped::Job(job) => Some(job),
            Popped::Nothing => None,
            Popped::PutBack => {
                // Another worker may have looked for the job while it was out of the queue.
                self.shared.sleep().wake_despite_searchers(priority);
                None
            }
        })
    }

    /// A job of another worker's queues. Earlier priorities come first.
    fn steal(&self, priorities: &[Priority]) -> Option<Job<Self>> {
        let stealers = self.shared.stealers();
        let first = self.victim.get();
        priorities.iter().find_map(|&priority| {
            let mut victims = (first..stealers.len()).chain(0..first).filter(|&victim| victim != self.index);
            victims.find_map(|victim| {
                let job = self.queues.steal_from(&stealers[victim], priority)?;
                if !stealers[self.index].is_empty(priority) {
                    // Further jobs have moved to this worker's queues, into which it does not look. The worker that
                    // pushed them may have relied on this one to look for more jobs.
                    self.shared.sleep().wake_despite_searchers(priority);
                }
                self.victim.set(victim);
                Some(job)
            })
        })
    }
}

impl fmt::Debug for Worker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Worker").field("index", &self.index).finish_non_exhaustive()
    }
}

impl ExitCondition {
    fn holds(self, shared: &Shared<Worker>) -> bool {
        match self {
            Self::Shutdown => shared.is_shut_down(),
            Self::Finished { region } => region.latch().is_released(),
        }
    }

    /// What wakes the worker if it sleeps meanwhile.
    fn wake_for(self) -> WakeFor {
        match self {
            Self::Finished { region } if !region.is_outermost() => WakeFor::Region { level: region.level() },
            Self::Shutdown | Self::Finished { .. } => WakeFor::Any,
        }
    }
}
