//! Numbers of schedulers, graphs and timelines.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use drawloom::graph::{Closure, FrameGraph};
use drawloom::report::{FrameReport, Replay, SchedulerCosts, write_chrome_trace, write_page};
use drawloom::task::{AffinityMask, Scheduler};
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{DURATIONS, Fixture, SIZES, ensure, refused, same};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "schedulers_of_no_workers_or_too_many_are_refused",
        numbers: &["task::Scheduler::new", "task::SchedulerBuilder::workers", "task::AffinityMask::new"],
        check: workers,
    },
    NumberCase { name: "loops_of_any_length_and_chunk", numbers: &["task::Scheduler::parallel_for"], check: loops },
    NumberCase {
        name: "background_jobs_run_within_any_budget",
        numbers: &["task::Scheduler::run_background"],
        check: background,
    },
    NumberCase {
        name: "any_number_of_background_workers",
        numbers: &["task::Scheduler::set_background_workers"],
        check: background_workers,
    },
    NumberCase {
        name: "stacks_of_any_size_work_or_are_refused",
        numbers: &["task::SchedulerBuilder::stack_size"],
        check: stacks,
    },
    NumberCase {
        name: "any_cost_of_a_wake_up_and_any_seed",
        numbers: &["task::SchedulerBuilder::wake_up_cost", "task::SchedulerBuilder::shuffle"],
        check: wake_ups,
    },
    NumberCase {
        name: "nodes_of_any_width_and_chunk",
        numbers: &[
            "graph::Closure::with_chunk",
            "graph::Node::width",
            "graph::Node::chunk",
            "graph::Schedule::cost",
            "graph::Schedule::dependencies",
            "graph::Schedule::dependents",
            "graph::Schedule::is_critical",
        ],
        check: nodes,
    },
    NumberCase {
        name: "timelines_of_any_capacity_and_clock",
        numbers: &["task::SchedulerBuilder::timeline_capacity", "task::SchedulerBuilder::timeline_clock"],
        check: timelines,
    },
    NumberCase { name: "counters_of_any_value", numbers: &["timeline::Timeline::count"], check: counters },
    NumberCase {
        name: "frames_are_replayed_on_any_number_of_workers",
        numbers: &[
            "report::FrameReport::new",
            "report::Replay::frame_time",
            "report::Replay::of_frame",
            "report::Replay::run",
            "report::Replay::with_serial_time",
            "report::SchedulerCosts::chunk",
            "report::SchedulerCosts::node",
            "report::SchedulerCosts::node_serial",
            "report::SchedulerCosts::recording",
            "report::SchedulerCosts::steal",
            "report::SchedulerCosts::ticket",
            "report::SchedulerCosts::uncounted_search",
            "report::SchedulerCosts::wake",
            "report::SchedulerCosts::waker",
        ],
        check: replays,
    },
];

fn workers() -> Result<(), Failed> {
    for workers in SIZES {
        let made = [Scheduler::new(workers), Scheduler::builder().workers(workers).build()];
        for made in made {
            match workers {
                0 => refused(made, "worker")?,
                1 => same(made?.workers(), 1, "workers")?,
                _ => refused(made, &workers.to_string())?,
            }
        }
    }
    for processor in [1 << 20, usize::MAX] {
        let mask = move |_| AffinityMask::new([processor]);
        refused(Scheduler::builder().workers(2).affinity(mask).build(), "restricted")?;
        let both = Scheduler::builder().workers(2).affinity(move |_| AffinityMask::new([0, processor])).build();
        // Processor 0 may be forbidden, but then that is said.
        both.map(drop).or_else(|error| refused(Err::<(), _>(error), "restricted"))?;
    }
    Ok(())
}

fn loops() -> Result<(), Failed> {
    for workers in [1, 2] {
        let scheduler = Scheduler::new(workers)?;
        for (length, chunk) in [
            (0, 0),
            (0, usize::MAX),
            (1_000, 0),
            (1_000, usize::MAX),
            (usize::MAX, usize::MAX),
            (usize::MAX, 1 << 61),
            (usize::MAX - 1, usize::MAX / 3),
            (1 << 63, 1 << 60),
        ] {
            let (low, high) = (AtomicU64::new(0), AtomicU64::new(0));
            scheduler.parallel_for(length, chunk, |range, _| {
                let before = low.fetch_add(range.len() as u64, Ordering::Relaxed);
                high.fetch_add(u64::from(before.checked_add(range.len() as u64).is_none()), Ordering::Relaxed);
            })?;
            let counted = (high.into_inner(), low.into_inner());
            same(counted, (0, length as u64), format_args!("{length} in chunks of {chunk}"))?;
        }
    }
    Ok(())
}

fn background_workers() -> Result<(), Failed> {
    for limit in SIZES {
        let scheduler = Scheduler::new(3)?;
        scheduler.set_background_workers(limit);
        let jobs = [1, 2, 3].map(|number| scheduler.background(move || number));
        for (job, number) in jobs.into_iter().zip([1, 2, 3]) {
            // A thread that waits runs what no worker may.
            ensure(job.wait() == Ok(number), format_args!("job {number} with a limit of {limit}"))?;
        }
    }
    Ok(())
}

fn stacks() -> Result<(), Failed> {
    for bytes in SIZES {
        match Scheduler::builder().workers(2).stack_size(bytes).build() {
            Ok(scheduler) if bytes < 1 << 62 => {
                ensure(scheduler.background(|| 7).wait() == Ok(7), format_args!("a job on {bytes} bytes"))?;
            }
            Ok(_) => return Err(format!("there is no room for {bytes} bytes").into()),
            // What the system has no address space for, it refuses; not the smallest ones.
            made => {
                ensure(bytes > 1, format_args!("{bytes} bytes count as the smallest size"))?;
                refused(made, "worker 1")?;
            }
        }
    }
    Ok(())
}

fn background() -> Result<(), Failed> {
    for budget in DURATIONS {
        let scheduler = Scheduler::new(1)?;
        let jobs = [scheduler.background(|| 1), scheduler.background(|| 2)];
        let count = scheduler.run_background(budget);
        let allowed = if budget < Duration::from_secs(1) { 0..=2 } else { 2..=2 };
        ensure(allowed.contains(&count), format_args!("{count} jobs within {budget:?}"))?;
        for (job, expected) in jobs.into_iter().zip(1..) {
            same(job.wait()?, expected, "what a job returns")?;
        }
    }
    Ok(())
}

fn wake_ups() -> Result<(), Failed> {
    for cost in DURATIONS {
        let scheduler = Scheduler::builder().workers(2).wake_up_cost(cost).build()?;
        let expected = Duration::from_nanos(cost.as_nanos().try_into().unwrap_or(u64::MAX));
        same(scheduler.wake_up_cost(), expected, "the cost")?;
        run(&scheduler, 1_000, 1)?;
    }
    for seed in [0, 1, 1 << 63, u64::MAX] {
        for workers in [1, 2] {
            run(&Scheduler::builder().workers(workers).shuffle(seed).build()?, 1_000, 3)?;
        }
    }
    Ok(())
}

/// Runs a loop, and a graph of two nodes a few times, as its mode is chosen by what earlier runs took.
fn run(scheduler: &Scheduler, width: usize, chunk: usize) -> Result<(), Failed> {
    let count = AtomicUsize::new(0);
    scheduler.parallel_for(width, chunk, |range, _| _ = count.fetch_add(range.len(), Ordering::Relaxed))?;
    let node = |count| {
        let body = move |count: &AtomicUsize, range: std::ops::Range<usize>, _: &_| {
            count.fetch_add(range.len(), Ordering::Relaxed);
            Ok(())
        };
        Closure::new(body).with_width(move |_| count).with_chunk(chunk)
    };
    let mut graph = FrameGraph::new();
    let [first, last] = [graph.add("first", node(width)), graph.add("last", node(width))];
    graph.order(first, last);
    [first, last].into_iter().for_each(|node| graph.keep(node));
    let mut schedule = graph.compile()?;
    for _ in 0..20 {
        schedule.run(scheduler, &count)?;
    }
    same(count.into_inner(), 41_usize.wrapping_mul(width), format_args!("{width} items in chunks of {chunk}"))?;
    for index in [2, usize::MAX] {
        same(schedule.cost(index), None, "the cost of no node")?;
        same((schedule.dependencies(index).len(), schedule.dependents(index).len()), (0, 0), "no node")?;
        ensure(!schedule.is_critical(index), "no node is critical")?;
    }
    Ok(())
}

fn nodes() -> Result<(), Failed> {
    for workers in [1, 2] {
        let scheduler = Scheduler::new(workers)?;
        for (width, chunk) in [(0, 0), (500, 0), (500, usize::MAX), (usize::MAX, usize::MAX), (usize::MAX, 1 << 61)] {
            run(&scheduler, width, chunk)?;
        }
    }
    Ok(())
}

fn timelines() -> Result<(), Failed> {
    for capacity in SIZES {
        let scheduler = Scheduler::builder().workers(1).timeline_capacity(capacity).build()?;
        if capacity <= 1 {
            scheduler.timeline().start();
            run(&scheduler, 10, 1)?;
            let dropped: u64 = scheduler.timeline().take().workers.iter().map(|worker| worker.dropped).sum();
            ensure(dropped > 0, "what has no room is counted")?;
        }
    }
    for time in DURATIONS {
        let scheduler = Scheduler::builder().workers(2).timeline_clock(move || time).build()?;
        scheduler.timeline().start();
        for _ in 0..2 {
            scheduler.timeline().mark_frame();
            drop(scheduler.timeline().span("a span"));
            run(&scheduler, 100, 1)?;
            let log = scheduler.timeline().take();
            ensure(log.spans.iter().all(|span| span.began == span.ended), "time stands still")?;
            write_chrome_trace(&log, std::io::sink())?;
            write_page(&log, &SchedulerCosts::ZERO, std::io::sink())?;
        }
    }
    Ok(())
}

fn counters() -> Result<(), Failed> {
    let scheduler = Scheduler::new(1)?;
    scheduler.timeline().start();
    let values = [0.0, -0.0, f64::MAX, f64::MIN, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 5e-324];
    values.iter().for_each(|value| scheduler.timeline().count("value", *value));
    let log = scheduler.timeline().take();
    let bits = |value: &f64| value.to_bits();
    let found: Vec<_> = log.counters.iter().map(|counter| bits(&counter.value)).collect();
    same(found, values.iter().map(bits).collect(), "the values")?;
    let mut trace = Vec::new();
    write_chrome_trace(&log, &mut trace)?;
    let parsed: serde_json::Value = serde_json::from_slice(&trace)?;
    ensure(parsed.is_object() || parsed.is_array(), "the trace is JSON")?;
    let mut page = Vec::new();
    write_page(&log, &SchedulerCosts::ZERO, &mut page)?;
    Ok(())
}

fn replays() -> Result<(), Failed> {
    let mut fixture = Fixture::null(2);
    fixture.renderer.scheduler().timeline().start();
    fixture.expect_usual("a frame")?;
    let log = fixture.renderer.scheduler().timeline().take();
    let costs = SchedulerCosts::measure()?;
    refused(Replay::of_frame(&log, u64::MAX, costs), &u64::MAX.to_string())?;
    let frame = log.frames[0].number;
    let replay = Replay::of_frame(&log, frame, costs)?;
    for time in DURATIONS {
        let longer = replay.clone().with_serial_time(time);
        for workers in [0, 1, 2, 64] {
            let expected = replay.frame_time(workers).saturating_add(time);
            same(longer.frame_time(workers), expected, format_args!("a frame with {time:?} more"))?;
        }
    }
    for (workers, simulated) in [(0, 1), (1 << 20, Scheduler::MAX_WORKERS), (usize::MAX, Scheduler::MAX_WORKERS)] {
        same(replay.run(workers), replay.run(simulated), format_args!("a frame on {workers} workers"))?;
    }
    refused(FrameReport::new(&log, u64::MAX, &costs), &u64::MAX.to_string())?;
    let fields: [fn(&mut SchedulerCosts) -> &mut Duration; 9] = [
        |costs| &mut costs.chunk,
        |costs| &mut costs.node,
        |costs| &mut costs.node_serial,
        |costs| &mut costs.recording,
        |costs| &mut costs.steal,
        |costs| &mut costs.ticket,
        |costs| &mut costs.uncounted_search,
        |costs| &mut costs.wake,
        |costs| &mut costs.waker,
    ];
    for time in DURATIONS {
        let mut all = costs;
        for field in fields {
            let mut one = costs;
            (*field(&mut one), *field(&mut all)) = (time, time);
            Replay::of_frame(&log, frame, one)?.run(4);
            let _ = FrameReport::new(&log, frame, &one)?.to_string();
        }
        Replay::of_frame(&log, frame, all)?.run(4);
        let _ = FrameReport::new(&log, frame, &all)?.to_string();
    }
    Ok(())
}
