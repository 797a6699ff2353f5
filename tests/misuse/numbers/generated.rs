//! Sizes of generated buffers, and the chunks that nodes ask for.

use std::ops::Range;

use drawloom::glam::Vec3;
use drawloom::graph::NodeError;
use drawloom::process::{Deferred, StorageBuffer};
use drawloom::scene::{GeneratedBuffer, Mesh, NodeColumn, Topology, Vertex};
use drawloom::task::Worker;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::{CpuNode, FrameData, FrameError, FrameInputs, NodeAccesses, NodeContext};
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{Fixture, SIZES, ensure, refused, same, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "generated_buffers_of_any_size",
        numbers: &[
            "scene::GeneratedBuffer::new",
            "scene::GeneratedBuffer::with_chunk",
            "scene::GeneratedBuffer::chunk_range",
            "scene::GeneratedIndices::from",
            "scene::Mesh::generated",
        ],
        check: capacities,
    },
    NumberCase {
        name: "nodes_ask_for_any_chunk_and_view",
        numbers: &[
            "NodeContext::fill",
            "NodeContext::filled",
            "NodeContext::set_count",
            "NodeContext::draw_list",
            "NodeContext::visible_objects",
            "Renderer::draw_list",
        ],
        check: chunks,
    },
    NumberCase {
        name: "columns_have_no_chunk_beyond_their_objects",
        numbers: &["scene::NodeColumn::read", "scene::NodeColumn::write", "scene::NodeColumn::chunk"],
        check: columns,
    },
    NumberCase {
        name: "storage_buffers_of_any_size",
        numbers: &["process::StorageBuffer::new", "process::StorageBuffer::at"],
        check: storage,
    },
];

/// A node made of a closure that has access to everything.
struct Node<'a, F> {
    fills: &'a GeneratedBuffer<[u32; 4]>,
    run: F,
}

impl<F: Fn(&NodeContext<'_>) -> Result<(), NodeError> + Send + Sync> CpuNode for Node<'_, F> {
    fn name(&self) -> &str {
        "a node"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(self.fills).reads(FrameData::DrawLists).reads(FrameData::VisibleObjects);
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        (self.run)(frame)
    }
}

fn record(
    fixture: &mut Fixture<drawloom::backend::NullBackend>,
    buffer: &GeneratedBuffer<[u32; 4]>,
    run: impl Fn(&NodeContext<'_>) -> Result<(), NodeError> + Send + Sync,
) -> Result<(), FrameError> {
    let node = Node { fills: buffer, run };
    fixture.renderer.record_with(FrameInputs { nodes: &[&node], ..FrameInputs::new(scene().as_scene_ref()) }).map(drop)
}

fn capacities() -> Result<(), Failed> {
    let mut fixture = Fixture::null(2);
    for capacity in SIZES.into_iter().filter(|capacity| *capacity > u32::MAX as usize) {
        for chunk in [1 << 20, 1 << 62, usize::MAX] {
            let buffer = GeneratedBuffer::with_chunk("huge", capacity, chunk);
            ensure(buffer.chunk_range(usize::MAX).is_empty(), "there is no such chunk")?;
            let last = buffer.chunk_range(buffer.chunk_count() - 1);
            same(last.end, capacity, "the chunks are all elements")?;
            let recorded = record(&mut fixture, &buffer, |_| Err("it runs".into()));
            refused(recorded, "not enough memory for the")?;
            fixture.expect_usual("the next frame")?;
        }
        let buffer = GeneratedBuffer::new("huge", capacity);
        refused(record(&mut fixture, &buffer, |_| Ok(())), "\"huge\"")?;
    }
    // A device draws no meshes of them, which frames say.
    for capacity in [u32::MAX as usize, 1 << 62, usize::MAX] {
        let corners = [Vec3::NEG_ONE, Vec3::ONE];
        let (vertices, indices) =
            (GeneratedBuffer::<Vertex>::new("vertices", capacity), GeneratedBuffer::new("indices", 3));
        let mesh = Mesh::generated("made", Topology::TriangleList, corners, &vertices, &indices)?;
        let mut scene = scene();
        let object = scene.objects().next().ok_or("one")?;
        let (object, mesh) = (scene.object(object)?, scene.add(mesh)?);
        scene.add_object(drawloom::scene::RenderObject { mesh, ..object })?;
        let drawn = Fixture::noop(1, Deferred::to_picture())?.draw(&scene)?;
        let is_named =
            |issue: &SceneIssue| issue.reason == IssueReason::UndrawableMesh && issue.name.as_deref() == Some("made");
        let scene_issues = &drawn.statistics.scene_issues;
        ensure(scene_issues.iter().any(is_named), format_args!("{capacity} elements: {scene_issues:?}"))?;
        Fixture::software(Deferred::to_picture())?.draw(&scene)?;
    }
    Ok(())
}

fn chunks() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::null(workers);
        let buffer = GeneratedBuffer::with_chunk("buffer", 8, 4);
        for chunk in [2, 1 << 61, 1 << 62, 1 << 63, usize::MAX - 1, usize::MAX] {
            let text = format!("has no chunk {chunk}");
            refused(
                record(&mut fixture, &buffer, |frame| frame.fill(&buffer, chunk).map(drop).map_err(Into::into)),
                &text,
            )?;
            refused(
                record(&mut fixture, &buffer, |frame| frame.filled(&buffer, chunk).map(drop).map_err(Into::into)),
                &text,
            )?;
            fixture.expect_usual("the next frame")?;
        }
        for count in SIZES {
            record(&mut fixture, &buffer, |frame| {
                frame.set_count(&buffer, count)?;
                for chunk in 0..2 {
                    frame.fill(&buffer, chunk)?.fill([7; 4]);
                }
                let found = frame.count(&buffer)?;
                if found == count.min(8) { Ok(()) } else { Err(format!("{found} of {count}").into()) }
            })?;
        }
        for view in [100, usize::MAX] {
            record(&mut fixture, &buffer, |frame| {
                frame.set_count(&buffer, 0)?;
                let (list, objects) = (frame.draw_list("geometry buffer", view)?, frame.visible_objects(view)?.count());
                if list.is_none() && objects == 0 { Ok(()) } else { Err("there is no such view".into()) }
            })?;
            ensure(fixture.renderer.draw_list("geometry buffer", view).is_none(), "there is no such view")?;
        }
    }
    Ok(())
}

/// They panic, as slices do, and a node's panic fails its frame.
fn columns() -> Result<(), Failed> {
    let mut values = vec![drawloom::glam::DVec3::ZERO; 300];
    let column = NodeColumn::new(&mut values);
    let mut fixture = Fixture::null(2);
    let buffer = GeneratedBuffer::with_chunk("buffer", 1, 1);
    for chunk in [2, usize::MAX] {
        refused(record(&mut fixture, &buffer, |_| column.write(chunk).map(drop).map_err(Into::into)), "a node")?;
        refused(record(&mut fixture, &buffer, |_| Ok(_ = column.read(chunk))), "a node")?;
        fixture.expect_usual("the next frame")?;
    }
    Ok(())
}

fn storage() -> Result<(), Failed> {
    let buffer = StorageBuffer::<[u32; 4]>::new("buffer", u32::MAX);
    same(buffer.bytes(), 16 * u64::from(u32::MAX), "its size")?;
    same(buffer.at(u32::MAX).bytes, 16 * u64::from(u32::MAX), "an offset")?;
    // A type of 2⁴⁰ bytes: what it is multiplied by may overflow.
    type Large = [[u32; 1 << 16]; 1 << 22];
    let overflows = drawloom::task::catch(|| StorageBuffer::<[[u32; 1 << 16]; 1 << 22]>::new("large", u32::MAX));
    let large = StorageBuffer::<Large>::new("large", 1);
    ensure(overflows.is_err() && drawloom::task::catch(|| large.at(u32::MAX)).is_err(), "it says that it overflows")
}
