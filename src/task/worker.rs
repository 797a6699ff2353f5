//! What a worker does: run jobs, look for jobs, sleep.

use std::{cell::Cell, fmt, marker::PhantomData, ptr, rc::Rc, time::Duration};

use crate::{
    sync::Arc,
    timeline::Timeline,
    unwind::{JobPanic, discard},
};

use super::{
    background::Queued,
    idle::Idle,
    job::{Job, Work},
    priority::Priority,
    queue::{Popped, Queues},
    region::Region,
    scheduler::Shared,
    sleep::WakeFor,
};

/// For how many jobs a worker counts in advance.
const JOBS_COUNTED_AT_ONCE: usize = if cfg!(any(drawloom_loom, drawloom_shuttle)) { 2 } else { 32 };

/// The witness that code runs as a job of a scheduler: only there can a reference to it be had, and it stays on its
/// thread.
///
/// No two threads are the same worker at the same time, so what an engine keeps once per [`index`](Self::index) is
/// never shared between threads. But a job that opens a scope or a loop and waits in it may find itself interrupted by
/// a job of that scope on the same worker, so such a thing should not stay borrowed over a wait.
///
/// ```compile_fail,E0277
/// # let scheduler = drawloom::task::Scheduler::new(2)?;
/// scheduler.scope(|scope| {
///     // A witness could testify for a thread that is no worker at all.
///     scope.spawn(|_scope, worker| std::thread::scope(|threads| { threads.spawn(|| worker.index()); }));
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Worker {
    index: usize,
    queues: Box<Queues>,
    shared: Arc<Shared>,
    /// Whom to steal from first: where there was something the last time.
    victim: Cell<usize>,
    /// How many regions are open on this worker, each inside a job of the one before.
    depth: Cell<usize>,
    /// Whether what runs is a background job.
    is_in_background: Cell<bool>,
    /// Whether the job that runs was stolen, until it is [past](Self::clear_stolen) what it was stolen for.
    has_stolen: Cell<bool>,
    /// For how many jobs that are not there this worker is counted, and by which region. While there is credit, the
    /// region waits for it to come back; where there is none, a job of the region is running here.
    credit: Cell<usize>,
    creditor: Cell<Option<&'static Region>>,
    /// The region that this worker waits for in the midst of a job, the innermost. Its own queues' newest jobs belong
    /// there.
    awaited: Cell<Option<&'static Region>>,
    /// What else this thread is (see `seat`).
    pub(super) outer: Cell<*const Worker>,
    on_this_thread: PhantomData<Rc<()>>,
}

impl Worker {
    pub(super) fn new(index: usize, queues: Box<Queues>, shared: Arc<Shared>) -> Self {
        Self {
            index,
            queues,
            shared,
            victim: Cell::new(0),
            depth: Cell::new(0),
            is_in_background: Cell::new(false),
            has_stolen: Cell::new(false),
            credit: Cell::new(0),
            creditor: Cell::new(None),
            awaited: Cell::new(None),
            outer: Cell::new(ptr::null()),
            on_this_thread: PhantomData,
        }
    }

    /// Which worker this is, from 0 up to [`Scheduler::workers`](super::Scheduler::workers). 0 is the thread that
    /// called the scheduler.
    #[inline]
    pub fn index(&self) -> usize {
        self.index
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// How many workers there are.
    #[inline]
    pub(crate) fn workers(&self) -> usize {
        self.shared.workers()
    }

    /// What it costs to wake one of them.
    #[inline]
    pub(crate) fn wake_up_cost(&self) -> Duration {
        self.shared.wake_up_cost()
    }

    /// What records what workers do.
    #[inline]
    pub(crate) fn timeline(&self) -> &Timeline {
        self.shared.timeline()
    }

    /// Whether what the worker does was stolen by it.
    #[inline]
    pub(crate) fn has_stolen(&self) -> bool {
        self.has_stolen.get()
    }

    /// What the job was stolen for is done, and what it goes on with was not stolen.
    #[inline]
    pub(crate) fn clear_stolen(&self) {
        self.has_stolen.set(false);
    }

    /// How many jobs are in this worker's queues.
    pub(crate) fn queued(&self) -> usize {
        self.queues.len()
    }

    /// Whether somebody sleeps who would have to be woken, and whom a worker may do without for what is not worth that.
    pub(super) fn may_be_alone(&self) -> bool {
        !self.is_shuffled() && !self.wake_up_cost().is_zero() && self.shared.sleep().sleepers() > 0
    }

    /// Whether jobs are to run in no particular order.
    #[inline]
    pub(crate) fn is_shuffled(&self) -> bool {
        self.shared.is_shuffled()
    }

    /// Draws one of so many, if the scheduler is to [shuffle](super::SchedulerBuilder::shuffle).
    pub(crate) fn draw(&self, count: usize) -> Option<usize> {
        self.queues.draw(count)
    }

    /// Whether what runs is a background job.
    pub(crate) fn is_in_background(&self) -> bool {
        self.is_in_background.get()
    }

    pub(super) fn into_queues(self) -> Box<Queues> {
        self.queues
    }

    /// How many regions are open on this worker.
    pub(super) fn depth(&self) -> usize {
        self.depth.get()
    }

    /// Whether a region opened now is one that a thread from outside waits for, and in the midst of no job.
    pub(super) fn opens_outermost(&self) -> bool {
        self.index == 0 && self.depth() == 0 && !self.is_in_background()
    }

    /// Queues a job, and wakes somebody for it. Only from within a counted job of the region, or its body.
    ///
    /// The job stays in this worker's queues only if no owner can wait for it in vain there. A worker keeps jobs of the
    /// innermost region that it waits for in the midst of a job. If it waits for none, it keeps those of an outermost region,
    /// whose owner steals.
    pub(super) fn push(&self, region: &'static Region, work: Work, band: Priority) {
        self.spend(region);
        let job = Job { work, region, is_stolen: false };
        let band = if region.is_background() { Priority::Background } else { band };
        let may_keep = self.awaited.get().map_or(region.is_outermost(), |awaited| awaited.is(region));
        let (owner, level) = (region.owner(), region.level());
        if !may_keep {
            self.shared.mailbox(owner).put_shared(job);
            self.shared.sleep().wake_owner_or_other(owner, level, band);
        } else if band == Priority::Background {
            self.queues.push(job, band);
            self.shared.sleep().wake_beside(band);
        } else {
            self.queues.push(job, band);
            self.shared.sleep().wake_any();
        }
    }

    /// Hands a job to the owner of the region. Only from within a counted job of the region, or its body.
    pub(super) fn push_pinned(&self, region: &'static Region, work: Work) {
        self.spend(region);
        let job = Job { work, region, is_stolen: false };
        self.shared.mailbox(region.owner()).put_pinned(job);
        if region.owner() != self.index {
            self.shared.sleep().wake_worker(region.owner());
        }
    }

    /// Calls `body`, whose jobs are those of the region, and then works until they have run. Neither may unwind.
    pub(super) fn wait_inside<R>(
        &self,
        region: &'static Region,
        body: impl FnOnce() -> Result<R, JobPanic>,
    ) -> Result<R, JobPanic> {
        let is_outermost = region.is_outermost();
        self.depth.set(self.depth.get() + 1);
        let outer = (self.awaited.replace((!is_outermost).then_some(region)), self.queues.start_wait());
        if is_outermost {
            self.shared.placement().make_room();
            self.shared.set_live(true);
        }
        let result = body();
        // The count that the latch began with.
        self.earn(region);
        self.work(Until::Finished { region });
        if is_outermost {
            self.shared.set_live(false);
        }
        self.awaited.set(outer.0);
        self.queues.end_wait(outer.1);
        self.depth.set(self.depth.get() - 1);
        let Some(first) = region.take_panic() else { return result };
        discard(result);
        Err(first)
    }

    /// Runs jobs, and sleeps where there are none, until that time has come. Does not unwind.
    pub(super) fn work(&self, until: Until) {
        let mut idle = Idle::default();
        loop {
            if let Some(job) = self.next_job(until) {
                idle.end(self);
                self.run(job);
                continue;
            }
            self.settle();
            if until.has_come(&self.shared) {
                break;
            }
            if matches!(until, Until::Shutdown)
                && let Some(job) = self.shared.background().take_oldest()
            {
                idle.end(self);
                self.run_in_background(&*job);
                continue;
            }
            idle.go_on(self, until);
        }
        idle.end(self);
    }

    /// Runs background jobs one after another, until there is none left or it is time to stop. Says how many have run.
    pub(super) fn work_in_background(&self, mut stop: impl FnMut() -> bool) -> usize {
        let mut jobs = 0;
        while !stop() {
            let Some(job) = self.shared.background().take_oldest() else { break };
            jobs += usize::from(self.run_in_background(&*job));
        }
        jobs
    }

    /// Whether there is a job that this worker would take up.
    pub(super) fn sees_work(&self, until: Until) -> bool {
        until.has_come(&self.shared)
            || match until {
                Until::Shutdown => self.sees_loot(&Priority::ALL),
                Until::Finished { region } => {
                    let mailbox = self.shared.mailbox(self.index);
                    mailbox.has_pinned(region)
                        || if region.is_outermost() {
                            self.sees_loot(&Priority::FRAME)
                        } else {
                            mailbox.has_shared(region)
                        }
                }
            }
    }

    /// Whether there is something in these bands that this worker could take up, and does not have itself.
    pub(super) fn sees_loot(&self, bands: &[Priority]) -> bool {
        let shared = &self.shared;
        let has_queued = self.index > 0 && bands.contains(&Priority::Background) && !shared.background().is_empty();
        let mut others = shared.loot().iter().enumerate().filter(|&(victim, _)| victim != self.index);
        has_queued
            || others.any(|(_, loot)| bands.iter().any(|&band| !loot.of(band).is_empty()))
            || shared.mailboxes().any(|mailbox| bands.iter().any(|&band| mailbox.has_any_shared(band)))
    }

    /// Takes over the count of a job of the region that has run here.
    fn earn(&self, region: &'static Region) {
        self.deal_with(region);
        self.credit.set(self.credit.get() + 1);
    }

    /// Sees to it that one more job of the region is counted.
    fn spend(&self, region: &'static Region) {
        self.deal_with(region);
        if self.credit.get() == 0 {
            region.latch().add(JOBS_COUNTED_AT_ONCE);
            self.credit.set(JOBS_COUNTED_AT_ONCE);
        }
        self.credit.set(self.credit.get() - 1);
    }

    /// Gives the credit of any other region back, so that what is earned and spent is this one's.
    fn deal_with(&self, region: &'static Region) {
        if !self.creditor.get().is_some_and(|creditor| creditor.is(region)) {
            self.settle();
            self.creditor.set(Some(region));
        }
    }

    /// Gives all credit back, and wakes the owner of the region if it was the last to come back.
    fn settle(&self) {
        let credit = self.credit.take();
        let Some(region) = self.creditor.take() else { return };
        // From the moment that the latch is released the region may be gone, and only the latch, which is nothing but
        // an atomic, may still be referred to.
        let (latch, owner) = (region.latch(), region.owner());
        if credit > 0 && latch.finish(credit) && owner != self.index {
            self.shared.sleep().wake_worker(owner);
        }
    }

    fn run(&self, job: Job) {
        let region = job.region;
        let was_in_background = self.is_in_background.replace(region.is_background());
        // The owner of another region may wait for the credit that is left of it, and this job may wait for that owner.
        self.deal_with(region);
        self.has_stolen.set(job.is_stolen);
        job.run(self);
        self.is_in_background.set(was_in_background);
        self.earn(region);
    }

    /// Says whether the job had not been begun by somebody else.
    fn run_in_background(&self, job: &dyn Queued) -> bool {
        let was_in_background = self.is_in_background.replace(true);
        let has_run = job.run();
        self.is_in_background.set(was_in_background);
        has_run
    }

    /// Pinned jobs come first, as nobody else can run them: while this worker does, others take those of its queues.
    fn next_job(&self, until: Until) -> Option<Job> {
        match until {
            Until::Shutdown => self
                .frame_job()
                .or_else(|| self.shared_job(Priority::Background))
                .or_else(|| self.steal(&[Priority::Background])),
            Until::Finished { region } => {
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

    /// A job of whatever belongs to the frame. What lies in mailboxes comes before what can be stolen: somebody waits for it
    /// in the midst of a job.
    fn frame_job(&self) -> Option<Job> {
        let own = Priority::FRAME.into_iter().find_map(|band| self.queues.pop(band));
        own.or_else(|| self.shared_job(Priority::Normal)).or_else(|| self.steal(&Priority::FRAME))
    }

    /// A job out of somebody's mailbox, for whoever looks for work of this band.
    fn shared_job(&self, band: Priority) -> Option<Job> {
        let job = self.shared.mailboxes().find_map(|mailbox| mailbox.take_any_shared(band))?;
        Some(Job { is_stolen: true, ..job })
    }

    /// The newest job here, if it is one of this region, which the worker waits for in the midst of another job.
    fn awaited_job(&self, region: &Region) -> Option<Job> {
        Priority::ALL.into_iter().find_map(|band| match self.queues.pop_awaited(band, region) {
            Popped::Job(job) => Some(job),
            Popped::Nothing => None,
            Popped::PutBack => {
                // Somebody may have looked for it in vain meanwhile.
                self.shared.sleep().wake_beside(band);
                None
            }
        })
    }

    /// One job of somebody else, the more urgent bands first.
    fn steal(&self, bands: &[Priority]) -> Option<Job> {
        let loot = self.shared.loot();
        let first = self.victim.get();
        bands.iter().find_map(|&band| {
            let mut victims = (first..loot.len()).chain(0..first).filter(|&victim| victim != self.index);
            victims.find_map(|victim| {
                let job = self.queues.steal_from(&loot[victim], band)?;
                if !loot[self.index].of(band).is_empty() {
                    // More came over than this one job. Whoever pushed them may have relied on this worker to look for
                    // more, and it is not going to look at what it has.
                    self.shared.sleep().wake_beside(band);
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

/// How long a worker works.
#[derive(Clone, Copy)]
pub(super) enum Until {
    /// Until the scheduler ends.
    Shutdown,
    /// Until the jobs of the region have run. The worker is the one that opened it, and runs its pinned jobs. Unless the
    /// region is an outermost one, the worker is in the midst of some job, and takes up nothing else meanwhile than what
    /// belongs to the region: a job of somebody else might take long, or want what this one has borrowed.
    Finished { region: &'static Region },
}

impl Until {
    fn has_come(self, shared: &Shared) -> bool {
        match self {
            Self::Shutdown => shared.is_shut_down(),
            Self::Finished { region, .. } => region.latch().is_released(),
        }
    }

    /// What a worker is woken for that sleeps meanwhile.
    pub(super) fn wake_for(self) -> WakeFor {
        match self {
            Self::Finished { region } if !region.is_outermost() => WakeFor::Region { level: region.level() },
            Self::Shutdown | Self::Finished { .. } => WakeFor::Any,
        }
    }
}
