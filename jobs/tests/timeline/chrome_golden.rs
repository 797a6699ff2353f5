//! A whole trace, compared byte by byte. `UPDATE_EXPECT=1` renews the golden file.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph};
use drawloom_jobs::report::write_chrome_trace;
use drawloom_jobs::task::Scheduler;
use expect_test::expect_file;

#[test]
fn the_trace_of_a_frame_equals_the_golden_file() {
    // The calling thread gets a name, because the test harness names a test's own thread.
    let trace = thread::Builder::new().name("engine".to_owned()).spawn(trace_of_a_frame).unwrap().join().unwrap();
    expect_file!["golden_trace.json"].assert_eq(&trace);
}

/// Four nodes, one of them without items, in a span. The clock advances by about a microsecond with each reading.
fn trace_of_a_frame() -> String {
    let readings = AtomicU64::new(0);
    let clock = move || Duration::from_nanos(readings.fetch_add(1_001, Ordering::Relaxed));
    let scheduler = Scheduler::builder().workers(1).timeline_clock(clock).build().unwrap();
    let mut graph = FrameGraph::new();
    let mut add = |name: &str, width: usize| {
        let items = Closure::new(|_: &(), _range, _worker| Ok(())).with_width(move |_| width).with_chunk(8);
        let node = graph.add(name, items);
        graph.keep(node);
        node
    };
    let [cull, shadows, fill, sort] =
        [("cull", 20), ("shadows", 0), ("fill \"all\"", 8), ("sort", 1)].map(|(name, width)| add(name, width));
    for (before, after) in [(cull, fill), (shadows, fill), (fill, sort), (cull, sort)] {
        graph.order(before, after);
    }
    let mut schedule = graph.compile().unwrap();
    let timeline = scheduler.timeline();
    timeline.start();
    timeline.mark_frame();
    let span = timeline.span("frame");
    schedule.run(&scheduler, &()).unwrap();
    timeline.count("objects", 20.0);
    drop(span);
    let mut trace = Vec::new();
    write_chrome_trace(&timeline.take(), &mut trace).unwrap();
    String::from_utf8(trace).unwrap()
}
