//! What is kept from frame to frame, against renderers that keep nothing.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::Batch;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, DepthCurve, DepthPrecision, Quality};
use drawloom::scene::{Camera, Changes, Light, RenderObject, SceneError, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::{FrameError, FrameStatistics, Renderer, Submitter, ViewStatistics};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::scenes::field;
use proptest::prelude::*;

/// What a frame is made of: its statistics, and the objects and batches of each process in each view.
type Contents = (Vec<ViewStatistics>, Vec<SceneIssue>, Vec<(String, usize, Vec<Batch>, Vec<u32>)>);

fn renderer(quality: Quality, workers: usize) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

fn contents(renderer: &Renderer<NullBackend>, statistics: &FrameStatistics) -> Contents {
    let mut lists = Vec::new();
    for process in renderer.plan().processes() {
        for view in 0..statistics.views.len() {
            if let Some(list) = renderer.draw_list(&process.name, view) {
                lists.push((process.name.clone(), view, list.batches.clone(), list.objects.clone()));
            }
        }
    }
    (statistics.views.clone(), statistics.scene_issues.clone(), lists)
}

/// The contents of a frame of a new renderer, which is told nothing.
fn of_a_new_renderer(quality: Quality, scene: SceneRef<'_>) -> Contents {
    let (mut renderer, _) = renderer(quality, 1);
    let recorded = renderer.record(SceneRef { changes: Changes::Unknown, ..scene }).unwrap();
    contents(&renderer, recorded.statistics())
}

/// What differs first between two frames, in a line.
fn difference(found: &Contents, expected: &Contents) -> Option<String> {
    if (&found.0, &found.1) != (&expected.0, &expected.1) {
        return Some(format!("{:?}, {:?} instead of {:?}, {:?}", found.0, found.1, expected.0, expected.1));
    }
    let differing = found.2.iter().zip(&expected.2).find(|(one, other)| one != other);
    differing
        .map(|((process, view, batches, objects), other)| {
            let objects = objects.iter().zip(&other.3).position(|(one, other)| one != other);
            let batches = batches.iter().zip(&other.2).position(|(one, other)| one != other);
            format!("{process} in view {view}: object {objects:?}, batch {batches:?}")
        })
        .or_else(|| (found.2.len() != expected.2.len()).then(|| "the number of lists".to_owned()))
}

fn any_quality() -> impl Strategy<Value = Quality> {
    let order = prop_oneof![
        3 => Just(DepthPrecision::UNORDERED),
        1 => Just(DepthPrecision { bits: 8, curve: DepthCurve::Logarithmic }),
    ];
    let culling = prop_oneof![2 => Just(CullingVolume::Sphere), 1 => Just(CullingVolume::OrientedBox)];
    (order, culling).prop_map(|(opaque_order, culling)| Quality { opaque_order, culling, ..Quality::balanced() })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn reported_changes_make_the_frames_of_a_renderer_that_is_told_nothing(
        seed in any::<u64>(), count in 0_usize..700, quality in any_quality(), workers in 1_usize..3, steps in 5_usize..25,
    ) {
        let mut world = ChangingWorld::new(seed, count);
        let (mut kept, submitter) = renderer(quality, workers);
        let mut log = Vec::new();
        for step in 0..steps {
            if step % 7 == 6 {
                // A frame that fails sees the reported changes, and the next one is not told of them again.
                let mut scene = world.as_scene_ref();
                let far_away = [Camera::looking_at("far away", DVec3::splat(1e12), DVec3::ZERO)];
                scene.cameras = if step % 2 == 0 { &[] } else { &far_away };
                prop_assert!(kept.record(scene).is_err());
                log.push("a failed frame".to_owned());
            } else {
                let recorded = kept.record(world.as_scene_ref());
                prop_assert!(recorded.is_ok(), "{:?} after {log:#?}", recorded.err());
                let recorded = recorded.unwrap();
                let found = contents(&kept, recorded.statistics());
                let difference = difference(&found, &of_a_new_renderer(quality, world.as_scene_ref()));
                prop_assert!(difference.is_none(), "{difference:?} after {log:#?}");
                // Some frames are dropped.
                if step % 3 > 0 {
                    submitter.submit(recorded).unwrap();
                }
            }
            log.push(world.step().unwrap());
        }
    }
}

#[test]
fn a_frame_in_which_nothing_changed_tests_describes_and_orders_no_object() {
    let scene = field(5_000);
    let (mut renderer, submitter) = renderer(Quality::balanced(), 1);
    // The second frame orders all objects by bin.
    for _frame in 0..2 {
        submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    }
    renderer.scheduler().timeline().start();
    let still = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
    submitter.submit(renderer.record(still).unwrap()).unwrap();
    let log = renderer.scheduler().timeline().take();
    for (index, node) in log.runs[0].graph.nodes.iter().enumerate() {
        let stage = node.labels.stage.as_deref().unwrap();
        let works = ["bins", "compact", "prepare", "record", "finish", "upload"].contains(&stage);
        assert!(works || log.runs[0].width(index) == 0, "{stage} has {} items", log.runs[0].width(index));
    }
}

#[test]
fn views_and_passes_keep_what_they_have_when_others_come_or_go() {
    let scene = field(2_000);
    let main = scene.cameras[0].clone();
    let with_other =
        [Camera { name: "other".to_owned(), position: main.position + DVec3::X, ..main.clone() }, main.clone()];
    let point = Light::Point { position: main.position, intensity: Vec3::ONE, range: 50.0, casts_shadow: false };
    let sun = Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true };
    let (mut renderer, submitter) = renderer(Quality::balanced(), 1);
    // A view comes before the main one, and goes; a process of lights comes before others; maps come.
    let frames: [(&[Camera], &[Light]); 6] = [
        (std::slice::from_ref(&main), &[]),
        (std::slice::from_ref(&main), &[]),
        (&with_other, &[]),
        (&with_other, &[point]),
        (&with_other, &[sun, point]),
        (std::slice::from_ref(&main), &[sun]),
    ];
    for (frame, (cameras, lights)) in frames.into_iter().enumerate() {
        renderer.scheduler().timeline().start();
        let changes = if frame < 2 { Changes::Unknown } else { Changes::NONE };
        let now = SceneRef { cameras, lights, changes, ..scene.as_scene_ref() };
        let recorded = renderer.record(now).unwrap();
        let difference =
            difference(&contents(&renderer, recorded.statistics()), &of_a_new_renderer(Quality::balanced(), now));
        assert_eq!(difference, None, "frame {frame}");
        submitter.submit(recorded).unwrap();
        let log = renderer.scheduler().timeline().take();
        let nodes = log.runs[0].graph.nodes.iter().enumerate();
        let of_main = nodes.filter(|(_, node)| node.labels.view.as_deref() == Some(&*main.name));
        let width_of = |name: &str| {
            let of_stage = of_main.clone().filter(|(_, node)| node.labels.stage.as_deref() == Some(name));
            of_stage.map(|(index, _)| log.runs[0].width(index)).sum::<usize>()
        };
        let widths = ["visibility", "bin", "fill", "sort"].map(width_of);
        assert_eq!(widths == [0; 4], frame >= 2, "frame {frame}: {widths:?}");
    }
}

#[test]
fn what_was_measured_holds_when_the_scene_requires_something_else() {
    let scene = field(2_000);
    let (mut renderer, submitter) = renderer(Quality::balanced(), 2);
    let mut frame = |lights: &[Light]| {
        let recorded = renderer.record(SceneRef { lights, ..scene.as_scene_ref() }).unwrap();
        submitter.submit(recorded).unwrap().statistics.tuning
    };
    (0..8).for_each(|_| drop(frame(&[])));
    let before = frame(&[]);
    let now = frame(&[Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 50.0, casts_shadow: false }]);
    let stages_before: Vec<_> = before.job_sizes.iter().map(|size| &size.labels).collect();
    let known = now.job_sizes.iter().filter(|size| stages_before.contains(&&size.labels));
    assert!(known.clone().count() > 3);
    known.for_each(|size| assert!(size.nanoseconds_per_item.is_some(), "{:?}", size.labels));
}

/// Enough objects that several jobs order what a view sees.
#[test]
fn cameras_that_turn_draw_the_lists_of_a_new_renderer() {
    let mut scene = field(9_000);
    scene.cameras.truncate(1);
    scene.cameras[0].position.z = 100.0;
    let (mut renderer, submitter) = renderer(Quality::balanced(), 2);
    let mut visible = Vec::new();
    for frame in 0..24 {
        let turned = Quat::from_rotation_y(0.04 * frame as f32);
        scene.cameras[0].orientation = turned;
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        visible.push(recorded.statistics().views[0].visible);
        let expected = of_a_new_renderer(Quality::balanced(), scene.as_scene_ref());
        assert_eq!(difference(&contents(&renderer, recorded.statistics()), &expected), None, "frame {frame}");
        submitter.submit(recorded).unwrap();
    }
    assert!(visible.iter().any(|count| (8_192..9_000).contains(count)), "{visible:?}");
}

#[test]
fn a_camera_that_sees_the_same_objects_keeps_the_order_of_opaque_ones() {
    let mut scene = field(500);
    // It sees all, wherever it is.
    scene.cameras.truncate(1);
    scene.cameras[0].position.z = 2_000.0;
    let (mut renderer, submitter) = renderer(Quality::balanced(), 1);
    submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    renderer.scheduler().timeline().start();
    scene.cameras[0].position.x += 1.0;
    submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let log = renderer.scheduler().timeline().take();
    let width = |name: &str| {
        let nodes = log.runs[0].graph.nodes.iter().enumerate();
        let of_stage = nodes.filter(|(_, node)| node.labels.stage.as_deref() == Some(name));
        of_stage.map(|(index, _)| log.runs[0].width(index)).sum::<usize>()
    };
    assert_eq!([width("visibility"), width("bin")], [500_usize.div_ceil(64), 0]);
    assert!(width("sort") > 0, "blended objects have another order");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only builds with assertions look for changes that are not reported")]
fn a_change_that_is_not_reported_is_named_and_the_next_frame_is_right() {
    let scene = field(300);
    let (mut renderer, _) = renderer(Quality::balanced(), 2);
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let mut positions = scene.as_scene_ref().positions.to_vec();
    positions[211].x += 1.0;
    let moved = SceneRef { positions: &positions, changes: Changes::Objects(&[1, 212]), ..scene.as_scene_ref() };
    let error = renderer.record(moved).map(drop).unwrap_err();
    assert!(matches!(error, FrameError::Scene(SceneError::UnreportedChange { object: 211 })), "{error}");
    let told_nothing_more = SceneRef { changes: Changes::NONE, ..moved };
    let recorded = renderer.record(told_nothing_more).unwrap();
    assert_eq!(contents(&renderer, recorded.statistics()), of_a_new_renderer(Quality::balanced(), moved));
}

/// A lamp with a paraboloid map above an object whose edges it sees under few degrees, or under too many.
#[test]
fn the_list_of_a_paraboloid_is_kept_unless_edges_are_too_coarse() {
    for (scale, is_coarse) in [(1.0, false), (1e5, true)] {
        let mut scene = field(200);
        let SceneRef { assets, meshes: &[mesh, ..], materials: &[material, ..], .. } = scene.as_scene_ref() else {
            panic!()
        };
        let vertices = assets.get(mesh).unwrap().vertices().iter();
        let top = vertices.map(|vertex| vertex.position[1]).fold(f32::MIN, f32::max) * scale;
        let object = RenderObject::new(mesh, material, DVec3::NEG_Y * f64::from(top));
        scene.add_object(RenderObject { scale: Vec3::splat(scale), ..object }).unwrap();
        let position = DVec3::Y * 3.0;
        let (intensity, direction) = (Vec3::splat(900.0), Vec3::NEG_Y);
        scene.lights = vec![Light::Hemispherical { position, intensity, range: 50.0, direction, casts_shadow: true }];
        let (mut renderer, submitter) = renderer(Quality::balanced(), 1);
        let expected = of_a_new_renderer(Quality::balanced(), scene.as_scene_ref());
        assert_eq!(expected.1.iter().any(|issue| issue.reason == IssueReason::CoarseEdges), is_coarse, "{expected:?}");
        for frame in 0..4 {
            renderer.scheduler().timeline().start();
            let changes = if frame == 0 { Changes::Unknown } else { Changes::NONE };
            let recorded = renderer.record(SceneRef { changes, ..scene.as_scene_ref() }).unwrap();
            assert_eq!(difference(&contents(&renderer, recorded.statistics()), &expected), None, "frame {frame}");
            submitter.submit(recorded).unwrap();
            let log = renderer.scheduler().timeline().take();
            let nodes = log.runs[0].graph.nodes.iter().enumerate();
            let fills = nodes.filter(|(_, node)| node.labels.stage.as_deref() == Some("fill"));
            let filled: usize = fills.map(|(index, _)| log.runs[0].width(index)).sum();
            assert_eq!(filled > 0, is_coarse || frame == 0, "frame {frame}: {filled}");
        }
    }
}

#[test]
fn a_shadow_map_of_another_projection_keeps_no_list() {
    let mut scene = field(200);
    let [cone, hemisphere] = [
        Light::Spot {
            position: DVec3::Y * 60.0,
            intensity: Vec3::splat(900.0),
            range: 500.0,
            direction: Vec3::NEG_Y,
            inner_angle: 0.6,
            outer_angle: 0.8,
            casts_shadow: true,
        },
        Light::Hemispherical {
            position: DVec3::Y * 60.0,
            intensity: Vec3::splat(900.0),
            range: 500.0,
            direction: Vec3::NEG_Y,
            casts_shadow: true,
        },
    ];
    for quality in [Quality::balanced(), Quality::exact()] {
        let (mut renderer, _) = renderer(quality, 1);
        for light in [cone, hemisphere, cone, hemisphere] {
            scene.lights = vec![light];
            let still = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
            let recorded = renderer.record(still).unwrap();
            let found = contents(&renderer, recorded.statistics());
            let difference = difference(&found, &of_a_new_renderer(quality, still));
            assert!(difference.is_none(), "{difference:?} with {light:?}");
        }
    }
}
