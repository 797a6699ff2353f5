//! What the scheduler's own operations cost on this machine.

use std::hint::black_box;
use std::sync::OnceLock;
use std::thread;
use std::time::Duration;

use crate::graph::{Closure, FrameGraph, Schedule};
use crate::sync::{Instant, spin_loop};
use crate::task::{Chunks, MAX_SPIN_BETWEEN_FRAMES, Scheduler, SchedulerError, Tickets, uncounted_pauses};
use crate::timeline::Run;

/// What the scheduler's own operations cost. A [replay](super::Replay) takes each for an hour at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SchedulerCosts {
    /// From waking a worker until it begins: [`Scheduler::wake_up_cost`].
    pub wake: Duration,
    /// The part of that in which the waking thread is busy.
    pub waker: Duration,
    /// From pushing a job until a worker that was already searching begins it.
    pub steal: Duration,
    /// How long an idle worker looks for work before it counts as searching. While one counts, no other worker is
    /// woken.
    pub uncounted_search: Duration,
    /// To take chunks of a node by ticket, where another worker has taken some.
    pub ticket: Duration,
    /// To run a chunk, without its own work.
    pub chunk: Duration,
    /// To start and complete a node in a parallel run.
    pub node: Duration,
    /// To start and complete a node in a serial run.
    pub node_serial: Duration,
    /// How much longer a chunk appears in a [timeline](crate::timeline) than it is.
    pub recording: Duration,
}

/// How often each cost is measured. Whatever else the machine does makes most samples longer, so a low one counts.
const SAMPLES: usize = 31;

/// How many empty nodes, or empty chunks of one node, are run to measure the cost of one.
const NODES: usize = 256;
const CHUNKS: usize = 2_048;

/// Steps of work in a chunk whose recording is measured.
const WORK_STEPS: usize = 32;

/// After this time without work a worker certainly sleeps.
const FALL_ASLEEP: Duration = MAX_SPIN_BETWEEN_FRAMES.saturating_mul(2);

/// Timeout for a worker to start.
const TIMEOUT: Duration = Duration::from_millis(1);

impl SchedulerCosts {
    /// A scheduler that costs nothing, as on paper.
    pub const ZERO: Self = Self {
        wake: Duration::ZERO,
        waker: Duration::ZERO,
        steal: Duration::ZERO,
        uncounted_search: Duration::ZERO,
        ticket: Duration::ZERO,
        chunk: Duration::ZERO,
        node: Duration::ZERO,
        node_serial: Duration::ZERO,
        recording: Duration::ZERO,
    };

    /// Costs of which a replay can add as many as fit into memory.
    pub(super) fn bounded(self) -> Self {
        let bounded = |cost: Duration| cost.min(Duration::from_secs(3_600));
        Self {
            wake: bounded(self.wake),
            waker: bounded(self.waker),
            steal: bounded(self.steal),
            uncounted_search: bounded(self.uncounted_search),
            ticket: bounded(self.ticket),
            chunk: bounded(self.chunk),
            node: bounded(self.node),
            node_serial: bounded(self.node_serial),
            recording: bounded(self.recording),
        }
    }

    /// Measures them on this machine, which takes some 50 ms. It starts schedulers of one and of two workers for that,
    /// and stops it.
    ///
    /// # Errors
    /// As [`Scheduler::new`].
    pub fn measure() -> Result<Self, SchedulerError> {
        let scheduler = Scheduler::new(2)?;
        let single = Scheduler::new(1)?;
        let steal = steal_time(&scheduler);
        let pauses = uncounted_pauses();
        let chunk = first_quartile((0..SAMPLES).filter_map(|_| run_time(&single, &mut wide_node(0)?))) / CHUNKS as u32;
        let node = |scheduler: &Scheduler| {
            let mut schedule = chain()?;
            let times = (0..SAMPLES).filter_map(|_| run_time(scheduler, &mut schedule));
            Some((first_quartile(times) / NODES as u32).saturating_sub(chunk))
        };
        Ok(Self {
            wake: scheduler.wake_up_cost(),
            waker: first_quartile((0..SAMPLES).filter_map(|_| waker_time(&scheduler))).min(scheduler.wake_up_cost()),
            steal,
            uncounted_search: first_quartile((0..SAMPLES).map(|_| time(|| (0..pauses).for_each(|_| spin_loop())))),
            // The ticket counter comes from another core's cache: half of a steal, which is a round trip.
            ticket: ticket_time() + steal / 2,
            chunk,
            node: node(&scheduler).unwrap_or_default(),
            node_serial: node(&single).unwrap_or_default(),
            recording: recording_time(&single, chunk).unwrap_or_default(),
        })
    }
}

/// The first quartile, so that samples which the machine disturbed do not count. Zero if there are none.
fn first_quartile(times: impl Iterator<Item = Duration>) -> Duration {
    let mut times: Vec<_> = times.collect();
    times.sort_unstable();
    times.get(times.len() / 4).copied().unwrap_or_default()
}

fn time(call: impl FnOnce()) -> Duration {
    let start = Instant::now();
    call();
    start.elapsed()
}

fn run_time(scheduler: &Scheduler, schedule: &mut Schedule<Closure<'_, ()>>) -> Option<Duration> {
    let start = Instant::now();
    schedule.run(scheduler, &()).ok()?;
    Some(start.elapsed())
}

/// A node whose chunks do `work` steps of work each.
fn busy(work: usize) -> Closure<'static, ()> {
    Closure::new(move |_context, range, _worker| {
        black_box((0..work).fold(range.start, |sum, step| black_box(sum ^ step)));
        Ok(())
    })
}

/// A schedule of one node with many chunks.
fn wide_node(work: usize) -> Option<Schedule<Closure<'static, ()>>> {
    let mut graph = FrameGraph::new();
    let node = graph.add("wide", busy(work).with_width(|_| CHUNKS));
    graph.keep(node);
    graph.compile().ok()
}

/// A schedule of nodes one after another, so that no worker is woken for any of them.
fn chain() -> Option<Schedule<Closure<'static, ()>>> {
    let mut graph = FrameGraph::new();
    let nodes: Vec<_> = (0..NODES).map(|index| graph.add(index.to_string(), busy(0))).collect();
    nodes.windows(2).for_each(|pair| graph.order(pair[0], pair[1]));
    nodes.iter().for_each(|&node| graph.keep(node));
    let mut schedule = graph.compile().ok()?;
    schedule.always_parallel(true);
    Some(schedule)
}

/// How much longer a chunk appears in a timeline than it is. `chunk` is the cost of running one.
fn recording_time(single: &Scheduler, chunk: Duration) -> Option<Duration> {
    let mut schedule = wide_node(WORK_STEPS)?;
    let real = first_quartile((0..SAMPLES).filter_map(|_| run_time(single, &mut schedule))) / CHUNKS as u32;
    single.timeline().start();
    let _times: Vec<_> = (0..SAMPLES).filter_map(|_| run_time(single, &mut schedule)).collect();
    let log = single.timeline().take();
    let recorded = first_quartile(log.runs.iter().filter(|run| run.complete).map(Run::work)) / CHUNKS as u32;
    Some((recorded + chunk).saturating_sub(real))
}

/// How long it takes to spawn a job for which a worker has to be woken.
fn waker_time(scheduler: &Scheduler) -> Option<Duration> {
    thread::sleep(FALL_ASLEEP);
    let begun = OnceLock::new();
    let took = scheduler.scope(|scope| {
        let took = time(|| scope.spawn(|_scope, _worker| _ = begun.set(())));
        wait_until(|| begun.get().is_some()).then_some(took)
    });
    took.ok().flatten()
}

/// How long a job waits for a worker that searches for one.
fn steal_time(scheduler: &Scheduler) -> Duration {
    let begun = [const { OnceLock::new() }; 4 * SAMPLES];
    let spawned = scheduler.scope(|scope| {
        begun.each_ref().map(|begun| {
            let spawned = Instant::now();
            scope.spawn(move |_scope, _worker| _ = begun.set(Instant::now()));
            wait_until(|| begun.get().is_some()).then_some(spawned)
        })
    });
    let pairs = spawned.iter().flatten().zip(&begun);
    first_quartile(pairs.filter_map(|(spawned, begun)| Some(begun.get()?.duration_since((*spawned)?))))
}

/// How long it takes to draw an uncontended ticket.
fn ticket_time() -> Duration {
    let (tickets, chunks) = (Tickets::new(), Chunks::new(CHUNKS, 1));
    let samples = (0..SAMPLES).map(|_| {
        tickets.reset(0);
        let (mut size, mut count) = (tickets.join(), 0);
        let all = time(|| {
            // With this many workers each ticket is for few chunks.
            while !tickets.take(&chunks, &mut size, CHUNKS, Instant::now).is_empty() {
                count += 1;
            }
        });
        all / count.max(1)
    });
    first_quartile(samples)
}

/// Waits for the condition, up to [`TIMEOUT`]. Returns whether it became true.
fn wait_until(condition: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() >= TIMEOUT {
            return false;
        }
        spin_loop();
    }
    true
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::time::Duration;

    use super::{SchedulerCosts, uncounted_pauses};

    #[test]
    fn measured_costs_have_the_expected_order_of_magnitude() {
        let costs = SchedulerCosts::measure().unwrap();
        let is_within = |cost: Duration, min: u64, max: u64| {
            (Duration::from_nanos(min)..=Duration::from_nanos(max)).contains(&cost)
        };
        // Wide enough for any machine, for a busy one, and for code that is not optimised.
        assert!(is_within(costs.wake, 500, 200_000), "{costs:?}");
        assert!(costs.waker <= costs.wake, "{costs:?}");
        assert!(costs.steal <= Duration::from_millis(1), "{costs:?}");
        assert!(is_within(costs.uncounted_search, u64::from(uncounted_pauses()), 100_000), "{costs:?}");
        assert!(is_within(costs.chunk, 1, 20_000), "{costs:?}");
        for cost in [costs.node, costs.node_serial, costs.recording] {
            assert!(cost <= Duration::from_micros(20), "{costs:?}");
        }
    }
}
