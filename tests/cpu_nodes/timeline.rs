//! Nodes are in timelines, reports, traces and statistics under their names, as stages are.

use std::io;
use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

use drawloom::report::{FrameReport, Replay, SchedulerCosts, write_chrome_trace, write_page};
use drawloom::{FrameData, FrameInputs, NodeContext};
use drawloom_testing::scenes::field;
use tracing::Dispatch;
use tracing::subscriber::NoSubscriber;
use tracing_subscriber::fmt::format::FmtSpan;

use crate::{TestNode, lent, renderer};

/// Works for so long.
fn spin(time: Duration) {
    let end = Instant::now() + time;
    while Instant::now() < end {}
}

fn nodes() -> Vec<TestNode<'static>> {
    let work = |_: &NodeContext<'_>, items: std::ops::Range<usize>| {
        items.for_each(|_| spin(Duration::from_micros(300)));
        Ok(())
    };
    let mut animation =
        TestNode::new("animation", |accesses| _ = accesses.writes(FrameData::Transforms), work).with_width(8);
    animation.items_per_job = None;
    vec![animation, TestNode::new("sound", |_| (), work).with_width(2)]
}

#[test]
fn reports_and_traces_name_nodes() {
    let scene = field(500);
    for workers in [1, 2] {
        let (mut renderer, submitter) = renderer(workers);
        let nodes = nodes();
        for _frame in 0..3 {
            submitter
                .submit(
                    renderer
                        .record_with(FrameInputs { nodes: &lent(&nodes), ..FrameInputs::new(scene.as_scene_ref()) })
                        .unwrap(),
                )
                .unwrap();
        }
        renderer.scheduler().timeline().start();
        let recorded = renderer
            .record_with(FrameInputs { nodes: &lent(&nodes), ..FrameInputs::new(scene.as_scene_ref()) })
            .unwrap();
        assert!(recorded.statistics().stages.nodes >= Duration::from_micros(3_000));
        let submitted = submitter.submit(recorded).unwrap();
        assert!(submitted.statistics.stages.total() >= submitted.statistics.stages.nodes);
        let sizes = &submitted.statistics.tuning.job_sizes;
        let sized = |name: &str| sizes.iter().find(|size| size.labels.stage.as_deref() == Some(name));
        assert_eq!(sized("animation").unwrap().items, 8);
        assert!(sized("animation").unwrap().nanoseconds_per_item.unwrap() > 200_000.0);
        assert!(sized("sound").is_none(), "its jobs have a fixed size");

        let log = renderer.scheduler().timeline().take();
        let run = &log.runs[0];
        for (name, items) in [("animation", 8), ("sound", 2)] {
            let index = run.graph.nodes.iter().position(|node| node.name == name).unwrap();
            assert_eq!(run.graph.nodes[index].labels.stage.as_deref(), Some(name));
            assert_eq!(run.width(index), items);
            assert_eq!(run.graph.nodes[index].chunked_by_cost, name == "animation");
        }
        let report = FrameReport::new(&log, log.frames[0].number, &SchedulerCosts::ZERO).unwrap();
        let text = report.to_string();
        assert!(text.contains("animation"), "it is on the critical path:\n{text}");
        let replay = Replay::of_frame(&log, log.frames[0].number, SchedulerCosts::ZERO).unwrap();
        assert!(replay.frame_time(8) < replay.frame_time(1));
        let (mut trace, mut page) = (Vec::new(), Vec::new());
        write_chrome_trace(&log, &mut trace).unwrap();
        write_page(&log, &SchedulerCosts::ZERO, &mut page).unwrap();
        for written in [trace, page] {
            let written = String::from_utf8(written).unwrap();
            assert!(written.contains("animation") && written.contains("sound"));
        }
    }
}

#[test]
fn a_changed_declaration_has_another_graph_and_an_equal_one_the_same() {
    let scene = field(200);
    let (mut renderer, _submitter) = renderer(1);
    let node = |is_early: bool| {
        let declare = move |accesses: &mut drawloom::NodeAccesses| {
            _ = if is_early {
                accesses.writes(FrameData::Transforms)
            } else {
                accesses.reads(FrameData::VisibleObjects)
            };
        };
        [TestNode::new("node", declare, |_, _| Ok(()))]
    };
    let mut graph_of = |is_early: bool| {
        drop(
            renderer
                .record_with(FrameInputs { nodes: &lent(&node(is_early)), ..FrameInputs::new(scene.as_scene_ref()) })
                .unwrap(),
        );
        renderer.stage_graph_to_dot().unwrap()
    };
    let [early, late] = [graph_of(true), graph_of(false)];
    assert!(early != late && early == graph_of(true) && late == graph_of(false));
    assert!(early.contains("\"node\""), "{early}");
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    assert!(!renderer.stage_graph_to_dot().unwrap().contains("\"node\""));
}

/// What a subscriber writes.
#[derive(Clone, Default)]
struct Written(Arc<Mutex<Vec<u8>>>);

impl io::Write for Written {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn spans_name_nodes() {
    /// While there is only one subscriber, the thread that is first to reach a span decides for all threads whether a
    /// subscriber wants it.
    static SECOND: LazyLock<Dispatch> = LazyLock::new(|| Dispatch::new(NoSubscriber::default()));
    LazyLock::force(&SECOND);
    let (scene, written) = (field(100), Written::default());
    let writer = written.clone();
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(tracing::Level::DEBUG)
        .with_span_events(FmtSpan::NEW)
        .with_writer(move || writer.clone())
        .with_ansi(false)
        .finish();
    tracing::subscriber::with_default(subscriber, || {
        let (mut renderer, _submitter) = renderer(1);
        drop(
            renderer
                .record_with(FrameInputs { nodes: &lent(&nodes()), ..FrameInputs::new(scene.as_scene_ref()) })
                .unwrap(),
        );
    });
    let written = String::from_utf8(written.0.lock().unwrap().clone()).unwrap();
    for name in ["animation", "sound"] {
        let span = format!("node{{name=\"{name}\" stage=\"{name}\"}}");
        assert!(written.contains(&span), "{span} is not in\n{written}");
    }
}
