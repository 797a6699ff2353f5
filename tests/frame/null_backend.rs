//! The null backend refuses frames that break a rule between frame and backend.

use std::ops::Range;
use std::slice;
use std::sync::Arc;

use drawloom::Granularity;
use drawloom::backend::{Backend, BackendError, FrameRecorder, FrameRequest, NullBackend, PassRequest, SceneLimits};
use drawloom::command::DrawList;
use drawloom::command::internal::Bucket;
use drawloom::process::internal::SampledViews;
use drawloom::process::{FramePlan, GeometryBuffer, GeometryFormats, Pass};
use drawloom::quality::Quality;
use drawloom::scene::Scene;
use drawloom::view::internal::{LightTable, ObjectTable};
use drawloom::view::{RenderView, SceneIssues};
use drawloom_testing::scenes::field;

use crate::renderer;

const PASS: Pass = Pass { process_index: 0, view_index: 0 };

type NullFrame = <NullBackend as FrameRecorder>::Frame;

/// Makes `calls` with a frame of the field's first view, and returns the broken rule.
fn broken_rule(calls: impl FnOnce(&NullFrame, &DrawList, &FrameRequest<'_>) -> Result<(), BackendError>) -> String {
    let scene = one_view();
    let (mut renderer, _) = renderer(1, Granularity::default());
    // A list that is ordered by depth has commands.
    renderer.set_quality(Quality::exact()).unwrap();
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let list = renderer.draw_list("geometry buffer", 0).unwrap().clone();

    let geometry_buffer = GeometryBuffer::new(GeometryFormats::default());
    let plan = FramePlan::new(vec![Arc::new(geometry_buffer)], &["diffuse".to_owned()]).unwrap();
    let views = [RenderView::new(&scene.cameras[0])];
    let mut objects = ObjectTable::default();
    objects.update(&scene.as_scene_ref());
    let request = FrameRequest {
        plan: &plan,
        draws: &plan.draws().unwrap(),
        views: &views,
        lights: &[],
        light_tables: &[LightTable::default()],
        passes: &[PASS],
        sampled_views: &SampledViews::default(),
        scene: &scene.as_scene_ref(),
        items: &[],
        items_of_passes: &[],
        objects: &objects,
        list_capacity: objects.len(),
        generated: &[],
        records_bundles: false,
        workers: 1,
        quality: &Quality::balanced(),
        limits: SceneLimits::NONE,
        scene_issues: &SceneIssues::default(),
    };
    let frame = NullBackend.begin(&request).unwrap();
    calls(&frame, &list, &request).err().map_or_else(String::new, |error| error.to_string())
}

fn pass<'a>(frame: &'a FrameRequest<'a>, list: &'a DrawList) -> PassRequest<'a> {
    PassRequest { frame, index: 0, pass: PASS, list }
}

fn record(
    frame: &NullFrame,
    pass: &PassRequest<'_>,
    bundles: Range<usize>,
) -> Result<Vec<<NullBackend as FrameRecorder>::Part>, BackendError> {
    let mut recorded = Vec::new();
    NullBackend.record(frame, pass, bundles, &mut |bundle| recorded.push(bundle))?;
    Ok(recorded)
}

fn finish(
    frame: &NullFrame,
    pass: &PassRequest<'_>,
    bundles: Vec<<NullBackend as FrameRecorder>::Part>,
) -> Result<(), BackendError> {
    NullBackend.finish(frame, slice::from_ref(pass), &mut [bundles], &mut |_| ())
}

fn one_view() -> Scene {
    let mut scene = field(300);
    scene.cameras.truncate(1);
    scene
}

#[test]
fn a_valid_frame_is_accepted() {
    let rule = broken_rule(|frame, list, request| {
        NullBackend.prepare(frame, &pass(request, list))?;
        let bundles = record(frame, &pass(request, list), 0..list.bundle_count())?;
        finish(frame, &pass(request, list), bundles)
    });
    assert_eq!(rule, "");
}

#[test]
fn commands_out_of_order_are_refused() {
    let rule = broken_rule(|frame, list, request| {
        let mut part = Bucket {
            commands: list.commands().rev().copied().collect(),
            batches: list.batches.clone(),
            objects: list.objects.clone(),
        };
        let mut reversed = DrawList::default();
        reversed.append(&mut part, |_| true);
        NullBackend.prepare(frame, &pass(request, &reversed))
    });
    assert!(rule.contains("commands are sorted"), "{rule}");
}

#[test]
fn a_missing_bundle_or_one_recorded_twice_is_refused() {
    let lost = broken_rule(|frame, list, request| {
        NullBackend.prepare(frame, &pass(request, list))?;
        finish(frame, &pass(request, list), Vec::new())
    });
    assert!(lost.contains("objects are recorded"), "{lost}");
    let twice = broken_rule(|frame, list, request| {
        record(frame, &pass(request, list), 0..1)?;
        record(frame, &pass(request, list), 0..1).map(|_| ())
    });
    assert!(twice.contains("recorded once"), "{twice}");
}

#[test]
fn batches_that_overlap_or_draw_no_mesh_are_refused() {
    let overlap = broken_rule(|frame, list, request| {
        let mut list = list.clone();
        list.batches[1].first -= 1;
        record(frame, &pass(request, &list), 0..1).map(|_| ())
    });
    assert!(overlap.contains("overlap"), "{overlap}");
    let no_mesh = broken_rule(|frame, list, request| {
        let mut list = list.clone();
        list.batches[0].mesh = 99;
        record(frame, &pass(request, &list), 0..1).map(|_| ())
    });
    assert!(no_mesh.contains("slot 99"), "{no_mesh}");
}

#[test]
fn a_pass_finished_twice_and_objects_uploaded_twice_are_refused() {
    let twice = broken_rule(|frame, list, request| {
        NullBackend.prepare(frame, &pass(request, list))?;
        let bundles = record(frame, &pass(request, list), 0..list.bundle_count())?;
        finish(frame, &pass(request, list), bundles)?;
        finish(frame, &pass(request, list), Vec::new())
    });
    assert!(twice.contains("finished once"), "{twice}");
    let uploaded = broken_rule(|frame, _, request| {
        NullBackend.upload_objects(frame, request, 0..request.objects.block_count())?;
        NullBackend.upload_objects(frame, request, 0..1)
    });
    assert!(uploaded.contains("uploaded once"), "{uploaded}");
}
