//! What the scheduler's own doings cost on this machine.

use std::{hint::black_box, sync::OnceLock, thread, time::Duration};

use crate::{
    graph::{Closure, FrameGraph, Schedule},
    sync::{Instant, spin_loop},
    task::{Chunks, Scheduler, SchedulerError, Tickets},
    timeline::Run,
};

/// What the scheduler's own doings cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Prices {
    /// From the waking of a worker until it begins: [`Scheduler::wake_up_cost`].
    pub wake: Duration,
    /// What of that is the waker's time.
    pub waker: Duration,
    /// From the pushing of a job until a worker begins on it that is awake and has nothing else to do.
    pub steal: Duration,
    /// How long a worker that has nothing to do looks for work before others count on it.
    pub silence: Duration,
    /// To take chunks of a pass by ticket, where another worker has taken some.
    pub ticket: Duration,
    /// To run a chunk, beside what it does.
    pub chunk: Duration,
    /// To start and complete a process in a run that is shared.
    pub process: Duration,
    /// To start and complete a process in a run on one thread.
    pub process_alone: Duration,
    /// How much longer a chunk seems in a [timeline](crate::timeline) than it is.
    pub note: Duration,
}

/// How often each is tried. What else the machine does makes most tries longer, so a low one counts.
const TRIES: usize = 31;

/// How many empty processes, or empty chunks of one, are run to find what one of them costs.
const PROCESSES: usize = 256;
const CHUNKS: usize = 2_048;

/// Steps of a chunk that is recorded.
const WORK: usize = 32;

/// How long to wait until a worker that has nothing to do sleeps for certain.
const NAP: Duration = Duration::from_micros(200);

/// How long to wait for a worker that does not come.
const PATIENCE: Duration = Duration::from_millis(1);

/// How often a worker looks, and for how many pauses of the processor, before it counts as searching.
const PAUSES: usize = 119;

impl Prices {
    /// All for nothing, as on paper.
    pub const FREE: Self = Self {
        wake: Duration::ZERO,
        waker: Duration::ZERO,
        steal: Duration::ZERO,
        silence: Duration::ZERO,
        ticket: Duration::ZERO,
        chunk: Duration::ZERO,
        process: Duration::ZERO,
        process_alone: Duration::ZERO,
        note: Duration::ZERO,
    };

    /// Measures them on this machine, which takes some 20 ms. A scheduler of two workers is started for that, and stopped.
    ///
    /// # Errors
    ///
    /// As [`Scheduler::new`].
    pub fn measure() -> Result<Self, SchedulerError> {
        let scheduler = Scheduler::new(2)?;
        let alone = Scheduler::new(1)?;
        let steal = steal(&scheduler);
        let chunk = lowest((0..TRIES).filter_map(|_| time_of(&alone, &mut pass(0)?))) / CHUNKS as u32;
        let process = |scheduler: &Scheduler| {
            let mut schedule = chain()?;
            let times = (0..TRIES).filter_map(|_| time_of(scheduler, &mut schedule));
            Some((lowest(times) / PROCESSES as u32).saturating_sub(chunk))
        };
        Ok(Self {
            wake: scheduler.wake_up_cost(),
            waker: lowest((0..TRIES).filter_map(|_| waker(&scheduler))).min(scheduler.wake_up_cost()),
            steal,
            silence: lowest((0..TRIES).map(|_| time(|| (0..PAUSES).for_each(|_| spin_loop())))),
            // The count of tickets comes from another core's cache: half of what a steal is, there and back.
            ticket: ticket() + steal / 2,
            chunk,
            process: process(&scheduler).unwrap_or_default(),
            process_alone: process(&alone).unwrap_or_default(),
            note: note(&alone, chunk).unwrap_or_default(),
        })
    }
}

/// Lower than three quarters of them, so that none of those counts that the machine has disturbed; zero of none.
fn lowest(times: impl Iterator<Item = Duration>) -> Duration {
    let mut times: Vec<_> = times.collect();
    times.sort_unstable();
    times.get(times.len() / 4).copied().unwrap_or_default()
}

fn time(call: impl FnOnce()) -> Duration {
    let start = Instant::now();
    call();
    start.elapsed()
}

fn time_of(scheduler: &Scheduler, schedule: &mut Schedule<Closure<'_, ()>>) -> Option<Duration> {
    let start = Instant::now();
    schedule.run(scheduler, &()).ok()?;
    Some(start.elapsed())
}

/// A process that does so many steps of work a chunk.
fn busy(work: usize) -> Closure<'static, ()> {
    Closure::new(move |_context, range, _worker| {
        black_box((0..work).fold(range.start, |sum, step| black_box(sum ^ step)));
        Ok(())
    })
}

/// One process of many chunks.
fn pass(work: usize) -> Option<Schedule<Closure<'static, ()>>> {
    let mut graph = FrameGraph::new();
    let process = graph.add("pass", busy(work).with_width(|_| CHUNKS));
    graph.keep(process);
    graph.compile().ok()
}

/// One process after another, so that nobody is woken for any of them.
fn chain() -> Option<Schedule<Closure<'static, ()>>> {
    let mut graph = FrameGraph::new();
    let processes: Vec<_> = (0..PROCESSES).map(|index| graph.add(index.to_string(), busy(0))).collect();
    processes.windows(2).for_each(|pair| graph.order(pair[0], pair[1]));
    processes.iter().for_each(|&process| graph.keep(process));
    let mut schedule = graph.compile().ok()?;
    schedule.always_parallel(true);
    Some(schedule)
}

/// How much longer a chunk seems than it is, where to run one costs so much.
fn note(alone: &Scheduler, chunk: Duration) -> Option<Duration> {
    let mut schedule = pass(WORK)?;
    let is = lowest((0..TRIES).filter_map(|_| time_of(alone, &mut schedule))) / CHUNKS as u32;
    alone.timeline().start();
    let _times: Vec<_> = (0..TRIES).filter_map(|_| time_of(alone, &mut schedule)).collect();
    let log = alone.timeline().take();
    let seems = lowest(log.runs.iter().filter(|run| run.complete).map(Run::work)) / CHUNKS as u32;
    Some((seems + chunk).saturating_sub(is))
}

/// How long it takes to spawn a job for which a worker has to be woken.
fn waker(scheduler: &Scheduler) -> Option<Duration> {
    thread::sleep(NAP);
    let begun = OnceLock::new();
    let took = scheduler.scope(|scope| {
        let took = time(|| scope.spawn(|_scope, _worker| _ = begun.set(())));
        wait_until(|| begun.get().is_some()).then_some(took)
    });
    took.ok().flatten()
}

/// How long a job waits for a worker that looks for one.
fn steal(scheduler: &Scheduler) -> Duration {
    let begun = [const { OnceLock::new() }; 4 * TRIES];
    let spawned = scheduler.scope(|scope| {
        begun.each_ref().map(|begun| {
            let spawned = Instant::now();
            scope.spawn(move |_scope, _worker| _ = begun.set(Instant::now()));
            wait_until(|| begun.get().is_some()).then_some(spawned)
        })
    });
    let pairs = spawned.iter().flatten().zip(&begun);
    lowest(pairs.filter_map(|(spawned, begun)| Some(begun.get()?.duration_since((*spawned)?))))
}

/// How long it takes to draw a ticket that nobody else wants.
fn ticket() -> Duration {
    let (tickets, chunks) = (Tickets::new(), Chunks::new(CHUNKS, 1));
    let tries = (0..TRIES).map(|_| {
        tickets.reset(0);
        let (mut pace, mut count) = (tickets.join(), 0);
        let all = time(|| {
            // So many workers that each gets few chunks at once.
            while !tickets.take(&chunks, &mut pace, CHUNKS, Instant::now).is_empty() {
                count += 1;
            }
        });
        all / count.max(1)
    });
    lowest(tries)
}

/// Waits for that as long as there is patience, and says whether it came.
fn wait_until(condition: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() >= PATIENCE {
            return false;
        }
        spin_loop();
    }
    true
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::time::Duration;

    use super::Prices;

    #[test]
    fn prices_are_of_the_order_that_is_to_be_expected() {
        let prices = Prices::measure().unwrap();
        let is_within = |price: Duration, least: u64, most: u64| {
            (Duration::from_nanos(least)..=Duration::from_nanos(most)).contains(&price)
        };
        // Wide enough for any machine, for one that does something else, and for code that is not optimised.
        assert!(is_within(prices.wake, 500, 200_000), "{prices:?}");
        assert!(prices.waker <= prices.wake, "{prices:?}");
        assert!(prices.steal <= Duration::from_millis(1), "{prices:?}");
        assert!(is_within(prices.silence, 119, 100_000), "{prices:?}");
        assert!(is_within(prices.chunk, 1, 20_000), "{prices:?}");
        for price in [prices.process, prices.process_alone, prices.note] {
            assert!(price <= Duration::from_micros(20), "{prices:?}");
        }
    }
}
