//! Guards that an engine leaks with `mem::forget`. What they locked is usable in the next frame, or the frame is
//! refused with an error.

use std::mem;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Backend, BackendError, BackendLayer, FrameRecorder, FrameRequest, NullBackend, PassRequest};
use drawloom::fence::Fence;
use drawloom::glam::DVec3;
use drawloom::graph::NodeError;
use drawloom::process::Deferred;
use drawloom::scene::{GeneratedBuffer, NodeColumn, SceneRef, WrittenColumns};
use drawloom::task::{Scheduler, Worker};
use drawloom::{CpuNode, FrameData, FrameError, FrameInputs, NodeAccesses, NodeContext};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, ensure, refused, same, scene};

pub const CASES: &[Case] = &[
    ("a_leaked_draw_list_of_a_renderer", draw_lists),
    ("a_leaked_draw_list_of_a_node", node_draw_lists),
    ("leaked_chunks_of_generated_buffers", generated),
    ("leaked_chunks_of_columns", columns),
    ("leaked_blocks_of_the_object_table", object_blocks),
    ("leaked_spans_of_a_timeline", spans),
    ("leaked_frames", frames),
    ("leaked_setters_and_jobs", setters_and_jobs),
];

/// The processes that draw objects.
const PROCESSES: [&str; 3] = ["geometry buffer", "shadow casters", "transparency"];

/// Draws frames whose lists have to be made anew: of another number of objects, another camera, and the usual ones.
fn expect_frames<B: Backend>(fixture: &mut Fixture<B>, when: &str) -> Result<(), Failed> {
    for round in 0..3 {
        let mut scene = scene();
        scene.duplicate_objects(2 + round);
        scene.cameras[0].position.x = 0.1 * round as f64;
        let submitted = fixture.draw(&scene)?;
        same(submitted.statistics.views[0].visible, 2 + round, when)?;
        same(submitted.statistics.views[0].commands, 2 + round, when)?;
    }
    fixture.expect_usual(when)
}

fn leak_draw_lists<B: Backend>(mut fixture: Fixture<B>) -> Result<(), Failed> {
    fixture.expect_usual("the first frame")?;
    for _ in 0..3 {
        let mut leaked = 0;
        for (process, view) in PROCESSES.into_iter().flat_map(|process| (0..8).map(move |view| (process, view))) {
            leaked += usize::from(fixture.renderer.draw_list(process, view).is_some());
            mem::forget(fixture.renderer.draw_list(process, view));
        }
        ensure(leaked >= 2, format_args!("{leaked} lists"))?;
        expect_frames(&mut fixture, "after a leak")?;
    }
    Ok(())
}

fn draw_lists() -> Result<(), Failed> {
    leak_draw_lists(Fixture::null(1))?;
    leak_draw_lists(Fixture::null(2))?;
    leak_draw_lists(Fixture::noop(2, Deferred::to_picture())?)?;
    leak_draw_lists(Fixture::software(Deferred::to_picture())?)
}

/// A node made of closures.
struct Node<D, R>(D, R);

impl<D, R> CpuNode for Node<D, R>
where
    D: Fn(&mut NodeAccesses) + Send + Sync,
    R: Fn(&NodeContext<'_>) -> Result<(), NodeError> + Send + Sync,
{
    fn name(&self) -> &str {
        "leaks"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        (self.0)(accesses);
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        (self.1)(frame)
    }
}

fn record(fixture: &mut Fixture<NullBackend>, scene: SceneRef<'_>, node: &dyn CpuNode) -> Result<(), FrameError> {
    fixture.renderer.record_with(FrameInputs { nodes: &[node], ..FrameInputs::new(scene) }).map(drop)
}

fn node_draw_lists() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::null(workers);
        let declare = |accesses: &mut NodeAccesses| {
            accesses.reads(FrameData::DrawLists).reads(FrameData::VisibleObjects);
        };
        let node = Node(declare, |frame: &NodeContext<'_>| {
            for view in 0..frame.views().len() {
                for process in PROCESSES {
                    mem::forget(frame.draw_list(process, view)?);
                }
                mem::forget(frame.visible_objects(view)?);
            }
            Ok(())
        });
        for _ in 0..3 {
            record(&mut fixture, scene().as_scene_ref(), &node)?;
            expect_frames(&mut fixture, "after a leak")?;
        }
    }
    Ok(())
}

fn generated() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::null(workers);
        let buffer = GeneratedBuffer::<u32>::with_chunk("buffer", 8, 4);
        let declare = |accesses: &mut NodeAccesses| {
            accesses.fills(&buffer);
        };
        let fill = |leaked: Option<usize>| {
            let buffer = &buffer;
            Node(declare, move |frame: &NodeContext<'_>| {
                for chunk in 0..2 {
                    let mut filled = frame.fill(buffer, chunk)?;
                    filled.fill(7);
                    if leaked == Some(chunk) {
                        mem::forget(filled);
                    }
                }
                for chunk in (0..2).filter(|chunk| leaked != Some(*chunk)) {
                    mem::forget(frame.filled(buffer, chunk)?);
                }
                Ok(())
            })
        };
        for leaked in [0, 1] {
            let recorded = record(&mut fixture, scene().as_scene_ref(), &fill(Some(leaked)));
            refused(recorded, &format!("chunk {leaked} of buffer"))?;
            record(&mut fixture, scene().as_scene_ref(), &fill(None))?;
            expect_frames(&mut fixture, "after a leak")?;
        }
    }
    Ok(())
}

fn columns() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::null(workers);
        let scene = scene();
        let mut positions = vec![DVec3::ZERO; scene.object_count()];
        let column = NodeColumn::new(&mut positions);
        let written = WrittenColumns { positions: Some(&column), ..WrittenColumns::default() };
        let parts = SceneRef { written, positions: &[], ..scene.as_scene_ref() };
        let declare = |accesses: &mut NodeAccesses| {
            accesses.writes(FrameData::Transforms);
        };
        let node = Node(declare, |_: &NodeContext<'_>| {
            let mut chunk = column.write(0)?;
            chunk[0] = DVec3::X;
            mem::forget(chunk);
            Ok(())
        });
        // It may wait for the chunk for a while, and then says which chunk.
        refused(record(&mut fixture, parts, &node), "chunk")?;
        expect_frames(&mut fixture, "after a leak")?;
    }
    Ok(())
}

/// A backend that leaks what it reads of the objects.
struct Leaks;

type NullFrame = <NullBackend as FrameRecorder>::Frame;

impl BackendLayer for Leaks {
    type Inner = NullBackend;

    fn inner(&self) -> &NullBackend {
        &NullBackend
    }

    fn upload_objects(
        &self,
        frame: &NullFrame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        self.inner().upload_objects(frame, request, blocks.clone())?;
        for block in blocks {
            mem::forget(request.objects.block(block));
            mem::forget(request.objects.gpu_objects(block));
        }
        Ok(())
    }

    fn prepare(&self, frame: &NullFrame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        mem::forget(pass.frame.objects.bins());
        self.inner().prepare(frame, pass)
    }
}

fn object_blocks() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::new(Leaks, workers, Deferred::to_picture())?;
        for _ in 0..3 {
            expect_frames(&mut fixture, "after a leak")?;
        }
    }
    Ok(())
}

fn spans() -> Result<(), Failed> {
    let scheduler = Scheduler::new(1)?;
    scheduler.timeline().start();
    mem::forget(scheduler.timeline().span("leaked"));
    drop(scheduler.timeline().span("next"));
    let names: Vec<_> = scheduler.timeline().take().spans.into_iter().map(|span| span.name).collect();
    same(names, vec!["next".to_owned()], "spans")
}

fn frames() -> Result<(), Failed> {
    fn leak<B: Backend>(mut fixture: Fixture<B>) -> Result<(), Failed> {
        for _ in 0..3 {
            let mut recorded = fixture.record(&scene())?;
            mem::forget(recorded.read_back_whole(0, "picture"));
            mem::forget(recorded);
            expect_frames(&mut fixture, "after a frame was leaked")?;
            mem::forget(fixture.draw(&scene())?);
            expect_frames(&mut fixture, "after a submission was leaked")?;
        }
        Ok(())
    }
    leak(Fixture::null(2))?;
    leak(Fixture::noop(2, Deferred::to_picture())?)?;
    leak(Fixture::software(Deferred::to_picture())?)
}

fn setters_and_jobs() -> Result<(), Failed> {
    let (setter, fence) = Fence::new("never");
    mem::forget(setter);
    refused(fence.wait(Duration::from_millis(1)), "never")?;
    let mut fixture = Fixture::null(1);
    let mut recorded = fixture.record(&scene())?;
    recorded.submit_after(&fence, Duration::from_millis(1));
    refused(fixture.submitter.submit(recorded), "never")?;
    expect_frames(&mut fixture, "after a leak")?;
    for workers in [1, 2] {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        mem::forget(scheduler.background(|| 3));
        same(scheduler.background(|| 4).wait()?, 4, "the next job")?;
        ensure(scheduler.parallel_for(100, 1, |_, _| ()).is_ok(), "a loop")?;
    }
    Ok(())
}
