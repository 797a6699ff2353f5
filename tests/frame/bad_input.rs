//! Invalid input is refused with an error that names it, or counted and left out. No case panics, and the next frame is
//! complete.

use std::f32::consts::PI;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::process::{
    CommandDraws, ComputeDispatch, Declare, Deferred, DrawCount, Draws, Format, GeometryBuffer, GeometryFormats,
    LightVolumes, PlanError, ProceduralDraws, RenderProcess, StorageBuffer, ToneMapping, Workgroups,
};
use drawloom::scene::{
    Bounds, Camera, Changes, ClipPlane, ColumnValues, Light, LightKind, Mesh, ObjectColumn, Projection, Scene,
    SceneError, SceneRef, VertexAttribute, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom::{BuildError, FrameError, Granularity, Renderer, SubmitError};
use drawloom_testing::scenes::{cube, field};
use drawloom_testing::tinted::{TINT, Tinted};

use crate::renderer;

fn error_of(scene: SceneRef<'_>) -> FrameError {
    let (mut renderer, submitter) = renderer(2, Granularity::default());
    let error = renderer.record(scene).err().expect("the scene cannot be drawn");
    let good = field(50);
    let recorded = renderer.record(good.as_scene_ref()).expect("the next frame is complete");
    submitter.submit(recorded).unwrap();
    error
}

fn rejected(scene: SceneRef<'_>) -> Vec<(IssueReason, usize, usize)> {
    let (mut renderer, submitter) = renderer(2, Granularity::Chunk(5));
    let recorded = renderer.record(scene).unwrap();
    let statistics = submitter.submit(recorded).unwrap().statistics;
    let scene_issues = statistics.scene_issues.iter();
    scene_issues.map(|issue| (issue.reason, issue.count, issue.first)).collect()
}

#[test]
fn an_empty_scene_draws_its_background() {
    let mut scene = Scene::new();
    scene.cameras = field(0).cameras.clone();
    let (mut renderer, submitter) = renderer(2, Granularity::default());
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let submitted = submitter.submit(recorded).unwrap();
    assert_eq!(submitted.statistics.objects, 0);
    // The geometry buffer and tone mapping in each of two views; there are no lights.
    assert_eq!(submitted.submission.passes.len(), 4);
}

#[test]
fn a_scene_without_a_camera_is_refused() {
    let mut scene = field(10);
    scene.cameras.clear();
    assert!(matches!(error_of(scene.as_scene_ref()), FrameError::NoView));
}

#[test]
fn a_picture_without_pixels_is_refused_naming_the_view() {
    for size in [[0, 0], [0, 100], [100, 0]] {
        let mut scene = field(10);
        scene.cameras[1].size = size;
        let error = error_of(scene.as_scene_ref());
        assert!(matches!(&error, FrameError::EmptyTarget { view, .. } if view == "side"), "{error}");
    }
}

#[test]
fn an_invalid_camera_is_refused_by_name() {
    let perspective =
        |camera: &mut Camera, field_of_view| camera.projection = Projection::Perspective { field_of_view };
    let orthographic = |camera: &mut Camera, height| {
        camera.projection = Projection::Orthographic { height };
        camera.far = 10.0;
    };
    let plane = |normal| ClipPlane { point: DVec3::ZERO, normal };
    let bad: [&dyn Fn(&mut Camera); 23] = [
        &|camera| camera.position.y = f64::NAN,
        &|camera| camera.position.y = f64::INFINITY,
        &|camera| camera.orientation = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        &|camera| camera.orientation.x = f32::NAN,
        &|camera| perspective(camera, 0.0),
        &|camera| perspective(camera, PI),
        &|camera| perspective(camera, f32::NAN),
        &|camera| camera.near = 0.0,
        &|camera| camera.near = f32::INFINITY,
        &|camera| camera.near = f32::NAN,
        &|camera| camera.far = camera.near,
        &|camera| camera.far = f32::NAN,
        &|camera| orthographic(camera, 0.0),
        &|camera| orthographic(camera, f32::NAN),
        // Without a far plane.
        &|camera| camera.projection = Projection::Orthographic { height: 1.0 },
        &|camera| camera.shift.x = f32::NAN,
        &|camera| camera.shift.y = 1e6,
        &|camera| camera.clip_plane = Some(plane(Vec3::ZERO)),
        &|camera| camera.clip_plane = Some(plane(Vec3::new(f32::NAN, 1.0, 0.0))),
        &|camera| camera.clip_plane = Some(ClipPlane { point: DVec3::INFINITY, ..plane(Vec3::X) }),
        // Only in perspective.
        &|camera| {
            orthographic(camera, 1.0);
            camera.shift = Vec2::X;
        },
        &|camera| {
            orthographic(camera, 1.0);
            camera.clip_plane = Some(plane(Vec3::X));
        },
        // Only lights have this projection.
        &|camera| (camera.projection, camera.far) = (Projection::Paraboloid, 10.0),
    ];
    for invalidate in bad {
        let mut scene = field(10);
        invalidate(&mut scene.cameras[1]);
        let error = error_of(scene.as_scene_ref());
        let named = matches!(&error, FrameError::Scene(SceneError::InvalidCamera { camera, .. }) if camera == "side");
        assert!(named, "{error}");
    }
    let mut scene = field(10);
    scene.cameras[0].position.x = 1e10;
    assert!(matches!(error_of(scene.as_scene_ref()), FrameError::Backend(_)));
}

#[test]
fn a_failed_frame_leaves_no_draw_list_of_an_earlier_one() {
    let (mut renderer, submitter) = renderer(2, Granularity::default());
    let mut scene = field(300);
    submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let views = scene.cameras.len();
    scene.cameras.push(Camera::looking_at("far away", DVec3::splat(1e12), DVec3::ZERO));
    assert!(matches!(renderer.record(scene.as_scene_ref()), Err(FrameError::Backend(_))));
    for view in 0..=views {
        assert!(renderer.draw_list("geometry buffer", view).is_none_or(|list| list.objects.is_empty()), "view {view}");
    }
}

#[test]
fn a_view_that_no_process_draws_is_refused_by_name() {
    let mut scene = field(10);
    scene.cameras[1].kind = ViewKind::Reflection;
    let error = error_of(scene.as_scene_ref());
    assert!(matches!(&error, FrameError::NoProcess { view, .. } if view == "side"), "{error}");
}

#[test]
fn slices_of_different_lengths_are_refused_by_name() {
    let scene = field(10);
    let whole = scene.as_scene_ref();
    let short = [
        ("orientations", SceneRef { orientations: &whole.orientations[1..], ..whole }),
        ("scales", SceneRef { scales: &whole.scales[1..], ..whole }),
        ("bounds", SceneRef { bounds: &whole.bounds[1..], ..whole }),
        ("meshes", SceneRef { meshes: &whole.meshes[1..], ..whole }),
        ("materials", SceneRef { materials: &whole.materials[1..], ..whole }),
    ];
    for (name, scene) in short {
        let error = error_of(scene);
        let named = matches!(
            &error,
            FrameError::Scene(SceneError::UnequalSlices { slice, count: 9, positions: 10 }) if *slice == name
        );
        assert!(named, "{error}");
    }
}

/// Renders with a process that reads the column `tint`, after which a good scene is drawn. Returns the error of the
/// first scene.
fn error_of_columns(columns: &[ColumnValues<'_>]) -> FrameError {
    let builder = Renderer::builder(NullBackend).process(Tinted).output("tinted");
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let (scene, tints) = (field(10), [[0.0; 4]; 10]);
    let error = renderer.record(SceneRef { columns, ..scene.as_scene_ref() }).map(drop).unwrap_err();
    let good = SceneRef { columns: &[TINT.values(&tints)], ..scene.as_scene_ref() };
    drop(renderer.record(good).expect("the next frame is complete"));
    error
}

#[test]
fn columns_that_do_not_fit_are_refused_by_name() {
    let (tints, narrow) = ([[0.0; 4]; 11], [0.0; 10]);
    let missing = error_of_columns(&[]);
    assert!(
        matches!(&missing, FrameError::Plan(PlanError::MissingColumn { process, column: "tint" }) if process == "tinted"),
        "{missing}"
    );
    let unequal = error_of_columns(&[TINT.values(&tints[..9])]);
    let is_named =
        matches!(unequal, FrameError::Scene(SceneError::UnequalColumn { column: "tint", count: 9, positions: 10 }));
    assert!(is_named, "{unequal}");
    let repeated = error_of_columns(&[TINT.values(&tints[..10]), TINT.values(&tints[1..])]);
    assert!(matches!(repeated, FrameError::Scene(SceneError::RepeatedColumn { column: "tint" })), "{repeated}");
    let other_size = error_of_columns(&[ObjectColumn::<f32>::new("tint").values(&narrow)]);
    let is_named = matches!(
        &other_size,
        FrameError::Plan(PlanError::ColumnSize { process, column: "tint", declared: 16, found: 4 }) if process == "tinted"
    );
    assert!(is_named, "{other_size}");
}

#[test]
fn processes_that_disagree_about_a_column_are_refused() {
    struct Other;
    impl RenderProcess for Other {
        fn name(&self) -> &str {
            "other"
        }
        fn declare(&self, declare: &mut Declare) {
            Tinted.declare(declare);
            declare.after("tinted");
            declare.reads_column(ObjectColumn::<u32>::new("tint"));
        }
        fn draws(&self) -> Draws<'_> {
            Tinted.draws()
        }
    }
    let builder = Renderer::builder(NullBackend).process(Tinted).process(Other).output("tinted");
    let error = builder.build(Arc::new(Scheduler::new(1).unwrap())).err().expect("they disagree");
    let is_named = matches!(
        &error,
        BuildError::Plan(PlanError::ConflictingColumns { process, column: "tint", first: 16, second: 4 }) if process == "other"
    );
    assert!(is_named, "{error}");
}

#[test]
fn processes_that_disagree_about_an_attribute_are_refused() {
    const WEIGHT: VertexAttribute<f32> = VertexAttribute::new("weight");
    struct Reading(&'static str, fn(&mut Declare));
    impl RenderProcess for Reading {
        fn name(&self) -> &str {
            self.0
        }
        fn declare(&self, declare: &mut Declare) {
            declare.clears_depth(self.0, Format::Depth32Float);
            declare.keep();
            (self.1)(declare);
        }
        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws::default())
        }
    }
    let others: [fn(&mut Declare); 2] = [
        |declare| declare.reads_attribute(WEIGHT, 0.5),
        |declare| declare.reads_attribute(VertexAttribute::<u32>::new("weight"), 1),
    ];
    for other in others {
        let first = Reading("first", |declare| declare.reads_attribute(WEIGHT, 1.0));
        let builder = Renderer::builder(NullBackend).process(first).process(Reading("second", other));
        let error = builder.build(Arc::new(Scheduler::new(1).unwrap())).err().expect("they disagree");
        let is_named = matches!(
            &error,
            BuildError::Plan(PlanError::ConflictingAttributes { process, attribute: "weight" }) if process == "second"
        );
        assert!(is_named, "{error}");
    }
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only builds with assertions look for changes that are not reported")]
fn a_column_that_changes_without_a_report_is_named() {
    let builder = Renderer::builder(NullBackend).process(Tinted).output("tinted");
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let (scene, mut tints) = (field(300), vec![[0.5; 4]; 300]);
    let mut frame = |tints: &[[f32; 4]], changes| {
        renderer.record(SceneRef { columns: &[TINT.values(tints)], changes, ..scene.as_scene_ref() }).map(drop)
    };
    frame(&tints, Changes::Unknown).unwrap();
    (tints[70][0], tints[211][3]) = (0.25, 0.25);
    let error = frame(&tints, Changes::Objects(&[70, 212])).unwrap_err();
    let is_named =
        matches!(error, FrameError::Scene(SceneError::UnreportedColumnChange { column: "tint", object: 211 }));
    assert!(is_named, "{error}");
    frame(&tints, Changes::NONE).expect("after a failed frame all objects count as changed");
    frame(&tints, Changes::NONE).expect("nothing changed");
}

#[test]
fn invalid_colours_are_refused() {
    for bad in [Vec3::splat(f32::NAN), Vec3::splat(f32::INFINITY), Vec3::splat(-1.0)] {
        let mut scene = field(10);
        scene.background = bad;
        assert!(error_of(scene.as_scene_ref()).to_string().contains("background"));
        let mut scene = field(10);
        scene.ambient = bad;
        assert!(error_of(scene.as_scene_ref()).to_string().contains("ambient"));
    }
}

#[test]
fn invalid_objects_are_counted_and_left_out() {
    let scene = field(40);
    let whole = scene.as_scene_ref();
    let mut positions = whole.positions.to_vec();
    let mut orientations = whole.orientations.to_vec();
    let mut scales = whole.scales.to_vec();
    let mut bounds = whole.bounds.to_vec();
    positions[3].x = f64::NAN;
    positions[4].y = f64::NEG_INFINITY;
    positions[5].z = 1e12;
    orientations[6] = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    scales[7].z = f32::NAN;
    bounds[8] = Bounds { center: Vec3::ZERO, radius: f32::NAN };
    bounds[9] = Bounds { center: Vec3::ZERO, radius: -1.0 };
    (bounds[10].radius, scales[10]) = (1e30, Vec3::splat(1e20));
    let invalid =
        SceneRef { positions: &positions, orientations: &orientations, scales: &scales, bounds: &bounds, ..whole };
    let expected =
        [(IssueReason::InvalidTransform, 4, 3), (IssueReason::InvalidBounds, 3, 8), (IssueReason::OutOfReach, 1, 5)];
    assert_eq!(rejected(invalid), expected);
    assert_eq!(rejected(whole), []);
}

#[test]
fn extreme_scales_are_drawn() {
    for scale in [0.0, -1.0, 1e-20, 1e20, f32::MIN_POSITIVE / 4.0] {
        let mut scene = field(20);
        for handle in scene.objects().collect::<Vec<_>>() {
            let mut object = scene.object(handle).unwrap();
            object.scale.y = scale;
            scene.replace_object(handle, object).unwrap();
        }
        assert_eq!(rejected(scene.as_scene_ref()), [], "{scale}");
    }
}

#[test]
fn objects_of_removed_meshes_or_materials_are_counted_and_left_out() {
    let mut scene = field(30);
    let reference = scene.as_scene_ref();
    let (mesh, material) = (reference.meshes[1], reference.materials[0]);
    scene.remove(mesh).unwrap();
    scene.remove(material).unwrap();
    // Every third object has this mesh, and every fifth of the others this material.
    let expected = [(IssueReason::StaleMesh, 10, 1), (IssueReason::StaleMaterial, 4, 0)];
    assert_eq!(rejected(scene.as_scene_ref()), expected);

    // The slot is reused, and the stale handles stay invalid.
    let new: drawloom::handle::Handle<Mesh> = scene.add(cube()).unwrap();
    assert_eq!(new.index(), mesh.index());
    assert_eq!(rejected(scene.as_scene_ref()), expected);
}

#[test]
fn invalid_lights_are_counted_and_left_out() {
    let mut scene = field(10);
    let point = |intensity: f32, range| Light::Point {
        position: DVec3::ZERO,
        intensity: Vec3::splat(intensity),
        range,
        casts_shadow: false,
    };
    let spot = |inner_angle, outer_angle| Light::Spot {
        position: DVec3::ZERO,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        range: 1.0,
        inner_angle,
        outer_angle,
        casts_shadow: true,
    };
    scene.lights.extend([
        point(f32::NAN, 1.0),
        point(f32::INFINITY, 1.0),
        point(-1.0, 1.0),
        point(1.0, 0.0),
        point(1.0, f32::INFINITY),
        Light::Directional { direction: Vec3::ZERO, illuminance: Vec3::ONE, casts_shadow: true },
        Light::Point { position: DVec3::NAN, intensity: Vec3::ONE, range: 1.0, casts_shadow: false },
        spot(0.0, 0.0),
        spot(0.5, 0.4),
        spot(0.0, PI),
        Light::Hemispherical {
            position: DVec3::ZERO,
            direction: Vec3::ONE,
            intensity: Vec3::ONE,
            range: 1.0,
            casts_shadow: true,
        },
    ]);
    assert_eq!(rejected(scene.as_scene_ref()), [(IssueReason::InvalidLight, 11, 2)]);
    scene.lights.truncate(2);
    scene.lights.extend([point(1.0, 1.0), spot(0.0, 0.5)]);
    assert_eq!(rejected(scene.as_scene_ref()), []);
    scene.lights.extend([point(0.0, 1.0), point(-0.0, 1.0)]);
    assert_eq!(rejected(scene.as_scene_ref()), [(IssueReason::DarkLight, 2, 4)]);
}

#[test]
fn invalid_renderers_are_refused() {
    let scheduler = || Arc::new(Scheduler::new(1).unwrap());
    let empty_chunk = Renderer::builder(NullBackend)
        .pipeline(Deferred::to_picture())
        .granularity(Granularity::Chunk(0))
        .build(scheduler());
    assert!(matches!(empty_chunk.err(), Some(BuildError::EmptyChunk)));
    let no_processes = Renderer::builder(NullBackend).build(scheduler());
    assert!(matches!(no_processes.err(), Some(BuildError::Plan(PlanError::Empty))));
    let formats = GeometryFormats::default();
    let lights = LightVolumes::new(LightKind::Point, formats);
    let unlit = Renderer::builder(NullBackend).process(lights).process(ToneMapping::default()).output("picture");
    let error = unlit.build(scheduler()).err().unwrap().to_string();
    assert!(error.contains("point lights"), "{error}");
    let deferred = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let twice = deferred.process(GeometryBuffer::new(formats)).build(scheduler());
    assert!(twice.err().unwrap().to_string().contains("geometry buffer"));
}

#[test]
fn a_frame_of_another_renderer_is_refused() {
    let scene = field(10);
    let (mut one, _) = renderer(1, Granularity::default());
    let (_, other) = renderer(1, Granularity::default());
    let recorded = one.record(scene.as_scene_ref()).unwrap();
    assert!(matches!(other.submit(recorded), Err(SubmitError::ForeignFrame)));
}

/// A process whose use of buffers and arguments is wrong in one way or another.
struct Buffering {
    name: &'static str,
    declare: fn(&mut Declare),
    draws: fn() -> Draws<'static>,
}

impl RenderProcess for Buffering {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.keep();
        (self.declare)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        (self.draws)()
    }
}

const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 8);

fn dispatch() -> Draws<'static> {
    Draws::Compute(ComputeDispatch::default())
}

#[test]
fn buffers_that_nothing_writes_or_that_differ_are_refused() {
    let build = |processes: Vec<Buffering>| {
        let builder = processes.into_iter().fold(Renderer::builder(NullBackend), |builder, one| builder.process(one));
        builder.build(Arc::new(Scheduler::new(1).unwrap())).map(drop)
    };
    let reads = || Buffering { name: "reads", declare: |declare| declare.reads_buffer(COUNTS), draws: dispatch };
    let error = build(vec![reads()]).unwrap_err().to_string();
    assert!(error.contains("nothing writes \"buffer counts\"") && error.contains("\"reads\""), "{error}");

    let changes = Buffering { name: "changes", declare: |declare| declare.changes_buffer(COUNTS), draws: dispatch };
    build(vec![reads(), changes]).unwrap();

    let other = |declare: &mut Declare| declare.changes_buffer(StorageBuffer::<[u32; 4]>::new("counts", 8));
    let other = Buffering { name: "other", declare: other, draws: dispatch };
    let both = |declare: &mut Declare| {
        declare.changes_buffer(COUNTS);
        declare.reads_arguments(COUNTS);
    };
    let error = build(vec![Buffering { name: "both", declare: both, draws: dispatch }]).unwrap_err().to_string();
    assert!(error.contains("\"both\" changes the buffer \"counts\""), "{error}");

    let error = build(vec![reads(), other]).unwrap_err();
    let is_named = matches!(
        &error,
        BuildError::Plan(PlanError::ConflictingBuffers { buffer: "counts", first, second, .. })
            if [*first, *second] == [128, 32]
    );
    assert!(is_named, "{error}");
}

#[test]
fn arguments_are_in_a_buffer_that_the_process_declares() {
    type Case = (fn(&mut Declare), fn() -> Draws<'static>, &'static str);
    let cases: [Case; 4] = [
        (
            |declare| declare.changes_buffer(COUNTS),
            || {
                let workgroups = Workgroups::Indirect(COUNTS.at(0));
                Draws::Compute(ComputeDispatch { workgroups, ..ComputeDispatch::default() })
            },
            "\"counts\", which it does not declare",
        ),
        (
            |declare| declare.reads_arguments(COUNTS),
            || {
                let workgroups = Workgroups::Indirect(COUNTS.at(6));
                Draws::Compute(ComputeDispatch { workgroups, ..ComputeDispatch::default() })
            },
            "past its end",
        ),
        (
            |declare| declare.reads_arguments(COUNTS),
            || {
                let count = DrawCount::Indirect(COUNTS.at(5));
                Draws::Procedural(ProceduralDraws { count, ..ProceduralDraws::default() })
            },
            "past its end",
        ),
        (
            |declare| declare.clears_depth("depth", Format::Depth32Float),
            dispatch,
            "a compute shader, which cannot draw into target \"depth\"",
        ),
    ];
    for (declare, draws, problem) in cases {
        let process = Buffering { name: "wrong", declare, draws };
        let writer = Buffering { name: "writer", declare: |declare| declare.changes_buffer(COUNTS), draws: dispatch };
        let mut builder = Renderer::builder(NullBackend).process(process);
        if !problem.contains("does not declare") {
            builder = builder.process(writer);
        }
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let error = renderer.record(field(3).as_scene_ref()).map(drop).unwrap_err().to_string();
        assert!(error.contains(problem) && error.contains("\"wrong\""), "{error}");
    }
}
