//! The tracing spans of a frame. Each test sets its own subscriber on its own threads.

// The tests of runs use the rest of it.
#[allow(dead_code)]
#[path = "../../jobs/tests/spans/recorder.rs"]
mod recorder;

use std::collections::BTreeSet;
use std::io;
use std::sync::{Arc, Mutex};

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer};
use drawloom_testing::demo;
use serde_json::Value;
use tracing::level_filters::LevelFilter;
use tracing::{Dispatch, Level, dispatcher};
use tracing_chrome::ChromeLayerBuilder;

use recorder::{Origin, Recorder, scheduler, subscriber};

/// Draws two frames of the sample scene. Returns its number of objects and the names of the frame's nodes.
fn draw_two_frames(workers: usize, dispatch: &Dispatch) -> (usize, BTreeSet<String>) {
    let scheduler = Arc::new(scheduler(Scheduler::builder().workers(workers), dispatch));
    dispatcher::with_default(dispatch, || {
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
        let (mut renderer, submitter) = builder.granularity(Granularity::Chunk(16)).build(scheduler).unwrap();
        let scene = demo::colonnade().unwrap();
        let timeline = Arc::clone(renderer.scheduler());
        timeline.timeline().start();
        for _frame in 0..2 {
            submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        }
        let log = timeline.timeline().take();
        let names = log.runs[0].graph.nodes.iter().map(|node| node.name.clone()).collect();
        (scene.as_scene_ref().object_count(), names)
    })
}

#[test]
fn the_spans_record_and_submit_contain_the_nodes_of_a_frame() {
    for workers in [1, 2, 4] {
        let recorder = Recorder::default();
        let (objects, names) = draw_two_frames(workers, &subscriber(recorder.clone(), LevelFilter::DEBUG));
        let record = recorder.take();
        record.check_nesting();
        let frames: Vec<_> = record.named("record").collect();
        assert_eq!((frames.len(), record.named("submit").count()), (2, 2));
        let parts = ["record", "submit"].map(|name| Origin { target: "drawloom", name, level: Level::DEBUG });
        for span in record.spans.iter().filter(|span| span.parent.is_none()) {
            assert!(parts.contains(&span.origin), "{span:?}");
        }
        for &frame in &frames {
            assert_eq!(record.spans[frame].fields["objects"], objects.to_string());
            let jobs = record.spans.iter().filter(|span| span.parent == Some(frame));
            let found: Vec<_> = jobs.map(|job| job.fields["name"].clone()).collect();
            assert_eq!(found.len(), names.len());
            assert_eq!(found.into_iter().collect::<BTreeSet<_>>(), names);
        }
        let stages: BTreeSet<_> = record.spans.iter().filter_map(|span| span.fields.get("stage")).collect();
        for stage in ["visibility", "fill", "sort", "record"] {
            assert!(stages.iter().any(|found| found.contains(stage)), "{stage} is not among {stages:?}");
        }
        assert!(record.spans.iter().any(|span| span.fields.get("view").is_some_and(|view| view == "main")));
        assert!(record.spans.iter().any(|span| span.fields.contains_key("process")));
    }
}

/// A file in memory.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl io::Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn tracing_chrome_writes_the_spans_to_a_trace() {
    let file = Memory::default();
    let (layer, written) = ChromeLayerBuilder::new().writer(file.clone()).include_args(true).build();
    let (_objects, names) = draw_two_frames(2, &subscriber(layer, LevelFilter::TRACE));
    drop(written);
    let trace: Vec<Value> = serde_json::from_slice(&file.0.lock().unwrap()).unwrap();
    let begins = |name: &str| trace.iter().filter(|event| event["ph"] == "B" && event["name"] == name).count();
    let ends = |name: &str| trace.iter().filter(|event| event["ph"] == "E" && event["name"] == name).count();
    for name in ["record", "submit", "node", "chunk"] {
        assert!(begins(name) >= 2 && begins(name) == ends(name), "{name}: {} and {}", begins(name), ends(name));
    }
    // It writes strings in quotes.
    let found: BTreeSet<_> = trace.iter().filter_map(|event| event["args"]["name"].as_str()).collect();
    let missing: Vec<_> = names
        .iter()
        .filter(|name| !found.contains(format!("{name:?}").as_str()) && !found.contains(name.as_str()))
        .collect();
    assert!(missing.is_empty(), "{missing:?} are not among {found:?}");
}
