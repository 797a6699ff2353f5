//! Memory that nodes fill in a frame, and that this frame draws, on the software backend.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::backend::SoftwareBackend;
use drawloom::graph::{GraphProblem, NodeError};
use drawloom::process::Deferred;
use drawloom::scene::{GeneratedBuffer, Vertex};
use drawloom::task::Scheduler;
use drawloom::{FrameError, FrameInputs, NodeAccesses, NodeContext, Renderer, Submitter};
use drawloom_testing::hills::{self, GeneratedHills};

use crate::{TestNode, renderer};

const FRAMES: usize = 4;

fn software(workers: usize) -> (Renderer<SoftwareBackend>, Submitter<SoftwareBackend>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let backend = SoftwareBackend::new(Arc::clone(&scheduler));
    Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}

#[test]
fn a_mesh_that_nodes_make_looks_like_one_that_the_engine_makes() {
    let expected = [0, 1, 2, 3].map(|frame| {
        let (mut renderer, submitter) = software(1);
        let scene = hills::scene(hills::mesh(frame).unwrap()).unwrap();
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        submitted.submission.read(0, "picture").unwrap()
    });
    assert!(expected[0] != expected[1] && expected[0] != expected[2], "nothing moves");
    for workers in [1, 2, 4] {
        let (mut renderer, submitter) = software(workers);
        let made = GeneratedHills::new();
        let scene = hills::scene(made.mesh().unwrap()).unwrap();
        // All are in flight at the same time.
        let recorded = [0, 1, 2, 3].map(|frame| {
            let (vertices, indices) = made.nodes(frame);
            renderer
                .record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene.as_scene_ref()) })
                .unwrap()
        });
        for (frame, recorded) in recorded.into_iter().enumerate() {
            let picture = submitter.submit(recorded).unwrap().submission.read(0, "picture").unwrap();
            assert!(picture == expected[frame], "frame {frame} on {workers} workers");
        }
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let picture = submitter.submit(recorded).unwrap().submission.read(0, "picture").unwrap();
        assert!(picture == expected[FRAMES - 1], "without nodes it stays as it was");
    }
}

#[test]
fn a_mesh_that_nobody_has_filled_is_not_drawn() {
    let (mut renderer, submitter) = software(2);
    let made = GeneratedHills::new();
    let mut scene = hills::scene(made.mesh().unwrap()).unwrap();
    let mut picture = |scene: &drawloom::scene::Scene| {
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        submitter.submit(recorded).unwrap().submission.read(0, "picture").unwrap()
    };
    let empty = picture(&scene);
    let hills = scene.objects().next().unwrap();
    scene.remove_object(hills).unwrap();
    assert!(picture(&scene) == empty);
}

#[test]
fn what_is_no_mesh_is_left_out_and_the_next_frame_is_right() {
    let (mut renderer, submitter) = software(2);
    let vertices = GeneratedBuffer::<Vertex>::with_chunk("vertices", 3, 2);
    let corners = [drawloom::glam::Vec3::NEG_ONE, drawloom::glam::Vec3::ONE];
    let mesh = drawloom::scene::Mesh::generated("leaf", Default::default(), corners, &vertices, vec![0, 1, 2]).unwrap();
    let scene = hills::scene(mesh).unwrap();
    let mut submit = |x: f32| {
        let node = TestNode::new(
            "grow",
            |accesses| _ = accesses.fills(&vertices),
            |frame, items| {
                for chunk in items {
                    let corner = Vertex { position: [x, 0.0, 0.0], ..Vertex::default() };
                    frame.fill(&vertices, chunk)?.fill(corner);
                }
                Ok(())
            },
        );
        let recorded = renderer
            .record_with(FrameInputs { nodes: &[&node.with_width(2)], ..FrameInputs::new(scene.as_scene_ref()) })
            .unwrap();
        submitter.submit(recorded).unwrap().submission.read(0, "picture").unwrap()
    };
    let expected = submit(0.0);
    for bad in [f32::NAN, f32::INFINITY] {
        let without = submit(bad);
        assert!(without == submit(bad), "it is left out in every such frame");
        assert!(submit(0.0) == expected);
    }
}

#[test]
fn a_buffer_is_filled_as_declared() {
    let buffer = GeneratedBuffer::<u32>::with_chunk("numbers", 10, 4);
    let scene = drawloom_testing::scenes::field(50);
    for workers in [1, 2] {
        let (mut renderer, submitter) = renderer(workers);
        let half = TestNode::new(
            "half",
            |accesses| _ = accesses.fills(&buffer),
            |frame, _| {
                frame.fill(&buffer, 1)?.fill(1);
                Ok(())
            },
        );
        match renderer.record_with(FrameInputs { nodes: &[&half], ..FrameInputs::new(scene.as_scene_ref()) }).map(drop)
        {
            Err(FrameError::UnfilledBuffer { buffer, chunk: 0 }) => assert_eq!(buffer, "numbers"),
            other => panic!("{other:?}"),
        }
        let undeclared = TestNode::new(
            "sly",
            |_| (),
            |frame, _| {
                frame.fill(&buffer, 1)?.fill(1);
                Ok(())
            },
        );
        let error = renderer
            .record_with(FrameInputs { nodes: &[&undeclared], ..FrameInputs::new(scene.as_scene_ref()) })
            .map(drop)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("sly failed: the node does not declare that it fills Buffer"), "{error}");
        let both =
            ["one", "two"].map(|name| TestNode::new(name, |accesses| _ = accesses.fills(&buffer), |_, _| Ok(())));
        match renderer
            .record_with(FrameInputs { nodes: &[&both[0], &both[1]], ..FrameInputs::new(scene.as_scene_ref()) })
            .map(drop)
        {
            Err(FrameError::Nodes(GraphProblem::UnorderedWriters { resource, .. })) => {
                assert!(resource.starts_with("numbers"), "{resource}");
            }
            other => panic!("{other:?}"),
        }
        // One fills it, another one reads that, and the frame is told of the rest.
        let fill = TestNode::new(
            "count up",
            |accesses| _ = accesses.fills(&buffer),
            |frame, items| {
                for chunk in items {
                    buffer.chunk_range(chunk).zip(&mut *frame.fill(&buffer, chunk)?).for_each(|(index, number)| {
                        *number = index as u32;
                    });
                }
                Ok(frame.set_count(&buffer, 7)?)
            },
        );
        let sum = AtomicU32::new(0);
        let add = TestNode::new(
            "add",
            |accesses| _ = accesses.reads(&buffer),
            |frame, items| {
                for chunk in items {
                    let numbers: u32 = frame.filled(&buffer, chunk)?.iter().sum();
                    sum.fetch_add(numbers, Ordering::Relaxed);
                }
                Ok(())
            },
        );
        let (fill, add) = (fill.with_width(2), add.with_width(2));
        let recorded = renderer
            .record_with(FrameInputs { nodes: &[&add, &fill], ..FrameInputs::new(scene.as_scene_ref()) })
            .unwrap();
        // 0 to 6, in 7 elements of 4 bytes.
        assert_eq!((sum.load(Ordering::Relaxed), recorded.statistics().generated), (21, 28));
        drop(submitter.submit(recorded).unwrap());
    }
}

/// The error of a frame in which one node fills a buffer, and another one that comes after it does this.
fn error_of_reader(
    declare: impl Fn(&mut NodeAccesses, &GeneratedBuffer<u32>) + Send + Sync,
    run: impl Fn(&NodeContext<'_>, &GeneratedBuffer<u32>) -> Result<(), NodeError> + Send + Sync,
) -> String {
    let buffer = GeneratedBuffer::<u32>::with_chunk("numbers", 8, 4);
    let scene = drawloom_testing::scenes::field(50);
    let (mut renderer, _submitter) = renderer(2);
    let make = TestNode::new(
        "make",
        |accesses| _ = accesses.fills(&buffer),
        |frame, _| {
            frame.fill(&buffer, 0)?.fill(1);
            frame.set_count(&buffer, 4)?;
            Ok(())
        },
    );
    let reader = TestNode::new(
        "reader",
        |accesses| {
            accesses.after("make");
            declare(accesses, &buffer);
        },
        |frame, _| run(frame, &buffer),
    );
    renderer
        .record_with(FrameInputs { nodes: &[&make, &reader], ..FrameInputs::new(scene.as_scene_ref()) })
        .map(drop)
        .unwrap_err()
        .to_string()
}

#[test]
fn a_node_gets_what_it_declares_and_waits_for_nobody_who_never_ends() {
    let reads = |accesses: &mut NodeAccesses, buffer: &GeneratedBuffer<u32>| _ = accesses.reads(buffer);
    let error = error_of_reader(|_, _| (), |frame, buffer| frame.filled(buffer, 0).map(drop).map_err(Into::into));
    assert!(error.starts_with("reader failed: the node does not declare that it reads Buffer"), "{error}");
    let error = error_of_reader(reads, |frame, buffer| frame.set_count(buffer, 3).map_err(Into::into));
    assert!(error.starts_with("reader failed: the node does not declare that it fills Buffer"), "{error}");
    let error = error_of_reader(reads, |frame, buffer| {
        assert_eq!((frame.count(buffer)?, frame.filled(buffer, 1)?.len()), (4, 0));
        frame.filled(buffer, 2).map(drop).map_err(Into::into)
    });
    assert!(error.contains("has no chunk 2"), "{error}");
    let modifies = |accesses: &mut NodeAccesses, buffer: &GeneratedBuffer<u32>| _ = accesses.modifies(buffer);
    let error = error_of_reader(modifies, |frame, buffer| {
        let _held = frame.fill(buffer, 0)?;
        frame.fill(buffer, 0).map(drop).map_err(Into::into)
    });
    assert!(error.contains("chunk 0 of") && error.contains("does not let go of it"), "{error}");
}

#[test]
#[should_panic(expected = "filled_by_nodes")]
fn a_storage_buffer_that_nodes_do_not_fill_has_no_generated_buffer() {
    let _ = drawloom::process::StorageBuffer::<u32>::new("sparks", 10).generated();
}
