//! A frame whose nodes do some work equals, to the byte, one before which the engine does the same work.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use drawloom::backend::SoftwareBackend;
use drawloom::command::DrawList;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{Bounds, Changes, NodeColumn, Scene, SceneRef, StaticGroup, WrittenColumns};
use drawloom::task::Scheduler;
use drawloom::{FrameData, FrameInputs, Renderer};
use drawloom_testing::scenes::field;
use drawloom_testing::scenes::leveled::plates;

use crate::{TestNode, renderer};

#[test]
fn nodes_see_the_objects_of_executed_static_groups() {
    let mut scene = field(300);
    scene.static_groups.push(StaticGroup::new("most", scene.object_set(scene.objects().take(250)).unwrap()));
    let seen = Mutex::new(Vec::new());
    let node = TestNode::new(
        "look",
        |accesses| _ = accesses.reads(FrameData::VisibleObjects),
        |frame, _| {
            assert_eq!(frame.visible_objects(frame.views().len())?.count(), 0);
            seen.lock().unwrap().push(frame.visible_objects(0)?.collect::<Vec<_>>());
            Ok(())
        },
    );
    let (mut renderer, submitter) = renderer(2);
    renderer.set_quality(Quality { occlusion: None, ..Quality::balanced() }).unwrap();
    let mut executed = Vec::new();
    for changes in [Changes::Unknown, Changes::NONE, Changes::NONE, Changes::NONE] {
        let scene = SceneRef { changes, ..scene.as_scene_ref() };
        let recorded = renderer.record_with(FrameInputs { nodes: &[&node], ..FrameInputs::new(scene) }).unwrap();
        executed.push(recorded.statistics().views[0].static_groups);
        submitter.submit(recorded).unwrap();
    }
    assert_eq!(executed, [0, 0, 1, 1]);
    let seen = seen.lock().unwrap();
    assert!(seen.iter().all(|objects| objects.is_sorted()));
    let of_static_groups: BTreeSet<_> = seen[2].iter().collect();
    assert!(
        !seen[0].is_empty() && seen[0].iter().all(|object| of_static_groups.contains(object)),
        "an object that is seen is missing"
    );
}

const FRAMES: usize = 4;

/// The columns of a world that moves.
#[derive(Clone)]
struct Columns {
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
}

fn moved_position(frame: usize, object: usize, position: DVec3) -> DVec3 {
    let angle = (frame * 7 + object) as f64 * 0.37;
    position + DVec3::new(angle.sin(), angle.cos(), 0.0) * 0.3
}

fn moved_orientation(frame: usize, object: usize) -> Quat {
    Quat::from_rotation_y((frame + object) as f32 * 0.1)
}

fn moved_scale(frame: usize, object: usize) -> Vec3 {
    Vec3::new(1.0, 1.0 + (frame + object) as f32 % 3.0 * 0.2, if object.is_multiple_of(5) { -1.0 } else { 1.0 })
}

impl Columns {
    fn new(scene: &SceneRef<'_>) -> Self {
        let (positions, orientations) = (scene.positions.to_vec(), scene.orientations.to_vec());
        Self { positions, orientations, scales: scene.scales.to_vec(), bounds: scene.bounds.to_vec() }
    }

    /// Objects in every third place move, all on one thread.
    fn update(&mut self, frame: usize) {
        for object in (0..self.positions.len()).filter(|object| object.is_multiple_of(3)) {
            self.positions[object] = moved_position(frame, object, self.positions[object]);
            self.orientations[object] = moved_orientation(frame, object);
            self.scales[object] = moved_scale(frame, object);
            self.bounds[object].radius *= 1.01;
        }
    }
}

/// Records frames in which one or four nodes write the columns, and calls `take` after each with the renderer.
fn with_nodes<B: drawloom::backend::Backend, R>(
    renderer: &mut Renderer<B>,
    scene: &Scene,
    mut take: impl FnMut(&mut Renderer<B>, drawloom::RecordedFrame<B>) -> R,
) -> Vec<R> {
    let base = scene.as_scene_ref();
    let mut columns = Columns::new(&base);
    let moving: Vec<u32> = (0..base.object_count() as u32).filter(|object| object.is_multiple_of(3)).collect();
    (0..FRAMES)
        .map(|frame| {
            let positions = NodeColumn::new(&mut columns.positions);
            let orientations = NodeColumn::new(&mut columns.orientations);
            let scales = NodeColumn::new(&mut columns.scales);
            let bounds = NodeColumn::new(&mut columns.bounds);
            let chunks = positions.chunk_count();
            let is_moving = |object: &usize| object.is_multiple_of(3);
            let animate = TestNode::new(
                "animate",
                |accesses| _ = accesses.writes(FrameData::Transforms),
                |_, items| {
                    for chunk in items {
                        let mut values = positions.write(chunk)?;
                        for (object, position) in values.objects().filter(|(object, _)| is_moving(object)) {
                            *position = moved_position(frame, object, *position);
                        }
                        for (object, orientation) in orientations.write(chunk)?.objects() {
                            if is_moving(&object) {
                                *orientation = moved_orientation(frame, object);
                            }
                        }
                    }
                    Ok(())
                },
            );
            let scale = TestNode::new(
                "scale",
                |accesses| _ = accesses.modifies(FrameData::Transforms),
                |_, items| {
                    for chunk in items {
                        for (object, scale) in scales.write(chunk)?.objects().filter(|(object, _)| is_moving(object)) {
                            *scale = moved_scale(frame, object);
                        }
                        bounds.write(chunk)?.objects().filter(|(object, _)| is_moving(object)).for_each(
                            |(_, bounds)| {
                                bounds.radius *= 1.01;
                            },
                        );
                    }
                    Ok(())
                },
            );
            let written = WrittenColumns {
                positions: Some(&positions),
                orientations: Some(&orientations),
                scales: Some(&scales),
                bounds: Some(&bounds),
            };
            let (animate, scale) = (animate.with_width(chunks), scale.with_width(chunks));
            let changes = if frame == 0 { Changes::Unknown } else { Changes::Objects(&moving) };
            // Of the slices none is read.
            let (positions, orientations, scales, bounds) = (&[][..], &[][..], &[][..], &[][..]);
            let lent = SceneRef { written, changes, positions, orientations, scales, bounds, ..base };
            let recorded =
                renderer.record_with(FrameInputs { nodes: &[&animate, &scale], ..FrameInputs::new(lent) }).unwrap();
            take(renderer, recorded)
        })
        .collect()
}

/// The same frames, with the work done before each is recorded.
fn before_record<B: drawloom::backend::Backend, R>(
    renderer: &mut Renderer<B>,
    scene: &Scene,
    mut take: impl FnMut(&mut Renderer<B>, drawloom::RecordedFrame<B>) -> R,
) -> Vec<R> {
    let base = scene.as_scene_ref();
    let mut columns = Columns::new(&base);
    (0..FRAMES)
        .map(|frame| {
            columns.update(frame);
            let Columns { positions, orientations, scales, bounds } = &columns;
            let recorded = renderer.record(SceneRef { positions, orientations, scales, bounds, ..base }).unwrap();
            take(renderer, recorded)
        })
        .collect()
}

#[test]
fn draw_lists_are_the_same() {
    let scene = field(1_500);
    let lists = |renderer: &mut Renderer<_>, _| -> Vec<DrawList> {
        let lists =
            ["geometry buffer", "transparency"].into_iter().flat_map(|process| [0, 1].map(|view| (process, view)));
        lists.map(|(process, view)| renderer.draw_list(process, view).unwrap().clone()).collect()
    };
    let expected = before_record(&mut renderer(1).0, &scene, lists);
    assert!(expected[0] != expected[3], "nothing moves");
    for workers in [1, 2, 4] {
        assert!(with_nodes(&mut renderer(workers).0, &scene, lists) == expected, "{workers} workers");
    }
}

#[test]
fn pictures_are_the_same() {
    let mut small = field(120);
    small.cameras.iter_mut().for_each(|camera| camera.size = [96, 64]);
    // Levels of detail, boxes and occlusion read transforms, too.
    let mut leveled = plates();
    leveled.cameras.iter_mut().for_each(|camera| camera.size = [96, 64]);
    for (scene, quality) in [
        (small, Quality::balanced()),
        (leveled, Quality { culling: CullingVolume::OrientedBox, level_of_detail: 1.0, ..Quality::balanced() }),
    ] {
        let new = |workers: usize| {
            let scheduler = Arc::new(Scheduler::new(workers).unwrap());
            let backend = SoftwareBackend::new(Arc::clone(&scheduler));
            Renderer::builder(backend).pipeline(Deferred::to_picture()).quality(quality).build(scheduler).unwrap()
        };
        let pictures_of = |workers: usize, by_nodes: bool| {
            let (mut renderer, submitter) = new(workers);
            let picture = |_: &mut Renderer<_>, recorded| {
                let submission = submitter.submit(recorded).unwrap().submission;
                submission.read(0, "picture").unwrap()
            };
            match by_nodes {
                true => with_nodes(&mut renderer, &scene, picture),
                false => before_record(&mut renderer, &scene, picture),
            }
        };
        let expected = pictures_of(1, false);
        assert!(expected[0] != expected[3], "nothing moves");
        for workers in [1, 2, 4] {
            assert!(pictures_of(workers, true) == expected, "{workers} workers");
        }
    }
}

#[test]
fn nodes_see_what_the_frame_draws() {
    let scene = field(2_000);
    for workers in [1, 2, 4] {
        let (mut renderer, _submitter) = renderer(workers);
        let (seen, drawn) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
        let visible = TestNode::new(
            "visible",
            |accesses| _ = accesses.reads(FrameData::VisibleObjects),
            |frame, _| {
                *seen.lock().unwrap() = frame.visible_objects(0)?.collect();
                Ok(())
            },
        );
        let lists = TestNode::new(
            "lists",
            |accesses| _ = accesses.reads(FrameData::DrawLists),
            |frame, _| {
                assert_eq!(frame.views()[0].name(), scene.cameras[0].name);
                assert!(frame.draw_list("nobody", 0)?.is_none() && frame.draw_list("ambient light", 0)?.is_none());
                for process in ["geometry buffer", "transparency"] {
                    drawn.lock().unwrap().extend(frame.draw_list(process, 0)?.unwrap().objects.iter().copied());
                }
                Ok(())
            },
        );
        for _frame in 0..2 {
            seen.lock().unwrap().clear();
            drawn.lock().unwrap().clear();
            let recorded = renderer
                .record_with(FrameInputs { nodes: &[&visible, &lists], ..FrameInputs::new(scene.as_scene_ref()) })
                .unwrap();
            assert_eq!(seen.lock().unwrap().len(), recorded.statistics().views[0].visible);
            let seen: BTreeSet<_> = seen.lock().unwrap().iter().copied().collect();
            let drawn: BTreeSet<_> = drawn.lock().unwrap().iter().map(|object| *object as usize).collect();
            assert!(!seen.is_empty() && seen == drawn, "{} are seen, and {} drawn", seen.len(), drawn.len());
        }
    }
}
