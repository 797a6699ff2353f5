//! Static groups, against frames without them.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality, TransformPrecision};
use drawloom::report::{FrameReport, SchedulerCosts};
use drawloom::scene::{
    Blend, Camera, Changes, Light, Material, MaterialPredicate, ObjectSet, RenderObject, Scene, SceneError, SceneRef,
    StaticGroup, ViewFilter,
};
use drawloom::task::Scheduler;
use drawloom::timeline::Log;
use drawloom::view::IssueReason;
use drawloom::{FrameError, FrameStatistics, Renderer, StaticGroupStatistics, Submitter};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::leveled::globe;
use drawloom_testing::scenes::{cube, culled};
use proptest::prelude::*;

fn renderer(quality: Quality, workers: usize) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    renderer_of(Deferred::to_picture(), quality, workers)
}

fn renderer_of(
    deferred: Deferred,
    quality: Quality,
    workers: usize,
) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let builder = Renderer::builder(NullBackend).pipeline(deferred).quality(quality);
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

/// What each process draws in each view: objects with their meshes and states, each once.
type Drawn = Vec<(String, usize, BTreeSet<(u32, u32, usize)>)>;

fn drawn(renderer: &Renderer<NullBackend>, statistics: &FrameStatistics) -> Drawn {
    let mut drawn = Vec::new();
    for process in renderer.plan().processes() {
        for view in 0..statistics.views.len() {
            let Some(list) = renderer.draw_list(&process.name, view) else { continue };
            let mut objects = BTreeSet::new();
            for batch in &list.batches {
                for object in &list.objects[batch.first as usize..][..batch.count as usize] {
                    let is_new = objects.insert((*object, batch.mesh, batch.state.index()));
                    assert!(is_new, "{} draws object {object} twice in view {view}", process.name);
                }
            }
            drawn.push((process.name.clone(), view, objects));
        }
    }
    drawn
}

/// Contiguous static groups of up to `most` objects, with gaps, in a shuffled order.
fn some_static_groups(random: &mut Random, objects: usize, most: usize) -> Vec<StaticGroup> {
    let (mut static_groups, mut first) = (Vec::new(), 0);
    while first < objects {
        let end = first + 1 + random.below(most);
        let step = 1 + random.below(3);
        let objects: ObjectSet = (first as u32..end as u32).step_by(step).collect();
        if random.below(4) > 0 {
            static_groups
                .insert(random.below(static_groups.len() + 1), StaticGroup::new(format!("from {first}"), objects));
        }
        first = end;
    }
    static_groups
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn static_groups_draw_what_a_frame_without_them_draws_and_what_is_out_of_sight(
        seed in any::<u64>(), count in 0_usize..700, workers in 1_usize..3, steps in 5_usize..30,
    ) {
        let (mut world, mut random) = (ChangingWorld::new(seed, count), Random::stream(seed ^ 1));
        let mut static_groups = some_static_groups(&mut random, count, 150);
        let (mut kept, submitter) = renderer(Quality::balanced(), workers);
        let mut log = Vec::new();
        for step in 0..steps {
            match random.below(8) {
                0 => static_groups = some_static_groups(&mut random, count, 150),
                1 => drop(static_groups.pop()),
                _ => {}
            }
            let scene = SceneRef { static_groups: &static_groups, ..world.as_scene_ref() };
            if random.below(9) == 0 {
                let failed = kept.record(SceneRef { cameras: &[], ..scene });
                prop_assert!(failed.is_err());
                log.push("a failed frame".to_owned());
            } else {
                let recorded = kept.record(scene);
                prop_assert!(recorded.is_ok(), "{:?} after {log:#?}", recorded.err());
                let recorded = recorded.unwrap();
                let found = drawn(&kept, recorded.statistics());
                let (mut plain, _) = renderer(Quality::balanced(), 1);
                let without = plain.record(SceneRef { static_groups: &[], changes: Changes::Unknown, ..scene }).unwrap();
                let expected = drawn(&plain, without.statistics());
                prop_assert_eq!(found.len(), expected.len());
                for (index, ((process, view, found), (_, _, expected))) in found.iter().zip(&expected).enumerate() {
                    prop_assert!(found.is_superset(expected), "{process} in view {view} at step {step}, list {index}: {log:#?}");
                    for (object, _, _) in found.difference(expected) {
                        let in_static_group = static_groups.iter().any(|static_group| static_group.objects.contains(*object as usize));
                        prop_assert!(in_static_group, "object {object} is drawn out of sight, but in no static group");
                    }
                }
                for (with, without) in recorded.statistics().views.iter().zip(&without.statistics().views) {
                    prop_assert!(with.visible >= without.visible && with.lights == without.lights);
                    prop_assert!(with.objects_of_static_groups <= with.visible);
                }
                if random.below(3) > 0 {
                    submitter.submit(recorded).unwrap();
                }
            }
            log.push(world.step().unwrap());
        }
    }
}

/// So that the property is one of executed static groups.
#[test]
fn worlds_that_change_at_random_execute_static_groups() {
    let executed = |seed| {
        let (mut world, mut random) = (ChangingWorld::new(seed, 300), Random::stream(seed));
        let static_groups = some_static_groups(&mut random, 300, 150);
        let (mut renderer, _) = renderer(Quality::balanced(), 1);
        let frames = (0..20).map(|_| {
            let recorded = renderer.record(SceneRef { static_groups: &static_groups, ..world.as_scene_ref() }).unwrap();
            let executed = recorded.statistics().views.iter().map(|view| view.objects_of_static_groups).sum::<usize>();
            world.step().unwrap();
            executed
        });
        frames.filter(|executed| *executed > 0).count()
    };
    let frames: Vec<_> = (0..16).map(executed).collect();
    assert!(frames.iter().sum::<usize>() >= 32, "of 20 frames of each world: {frames:?}");
}

/// Rows of cubes in front of a camera, each row a static group.
struct Rows {
    scene: Scene,
    renderer: Renderer<NullBackend>,
}

const ROWS: usize = 5;
const IN_ROW: usize = 40;

impl Rows {
    fn new() -> Self {
        let mut scene = Scene::new();
        let (mesh, material) = (scene.add(cube()).unwrap(), scene.add(Material::default()).unwrap());
        for object in 0..ROWS * IN_ROW {
            let (row, column) = (object / IN_ROW, object % IN_ROW);
            let position = DVec3::new(column as f64 * 3.0 - 60.0, row as f64 * 3.0, 0.0);
            scene.add_object(RenderObject::new(mesh, material, position)).unwrap();
        }
        for row in 0..ROWS {
            let objects = (row * IN_ROW) as u32..((row + 1) * IN_ROW) as u32;
            scene.static_groups.push(StaticGroup::new(format!("row {row}"), objects.collect()));
        }
        scene.cameras.push(Camera::looking_at("main", DVec3::Z * 200.0, DVec3::ZERO));
        Self { scene, renderer: renderer(Quality::balanced(), 2).0 }
    }

    /// Static groups that are executable, recorded and changed in a frame, and those that the first view executes.
    fn frame(&mut self, changes: Changes<'_>) -> [usize; 4] {
        let recorded = self.renderer.record(SceneRef { changes, ..self.scene.as_scene_ref() }).unwrap();
        let statistics = recorded.statistics();
        let StaticGroupStatistics { executable, recorded, changed } = statistics.static_groups;
        let view = &statistics.views[0];
        assert!(view.objects_of_static_groups <= view.static_groups * IN_ROW);
        [executable, recorded, changed, view.static_groups]
    }

    /// Makes all static groups be recorded.
    fn settle(&mut self) {
        self.frame(Changes::NONE);
        assert_eq!(self.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
    }
}

#[test]
fn a_static_group_is_recorded_once_and_executed_until_an_object_of_it_changes() {
    let mut rows = Rows::new();
    assert_eq!(rows.frame(Changes::Unknown), [0, 0, 0, 0], "any object may have changed");
    assert_eq!(rows.frame(Changes::NONE), [0, ROWS, 0, 0]);
    for _ in 0..3 {
        assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
    }
    let object = rows.scene.objects().nth(IN_ROW).unwrap();
    let moved = RenderObject { position: DVec3::Y, ..rows.scene.object(object).unwrap() };
    rows.scene.replace_object(object, moved).unwrap();
    assert_eq!(rows.frame(Changes::Objects(&[IN_ROW as u32])), [ROWS - 1, 0, 1, ROWS - 1]);
    assert_eq!(rows.frame(Changes::Ranges(std::slice::from_ref(&(0..1)))), [ROWS - 2, 1, 1, ROWS - 2]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS - 1, 1, 0, ROWS - 1]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
}

#[test]
fn a_static_group_of_another_mesh_or_material_is_recorded_anew_and_others_are_not() {
    let mut rows = Rows::new();
    rows.settle();
    // An asset that no static group has.
    let material = rows.scene.add(Material { name: "other".to_owned(), ..Material::default() }).unwrap();
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
    let object = rows.scene.objects().nth(3).unwrap();
    let now = RenderObject { material, ..rows.scene.object(object).unwrap() };
    rows.scene.replace_object(object, now).unwrap();
    assert_eq!(rows.frame(Changes::Objects(&[3])), [ROWS - 1, 0, 1, ROWS - 1]);
    rows.settle();
    // The one object with that material is blended from now on, so it is drawn with others.
    rows.scene.replace(material, Material { blend: Blend::Alpha, ..Material::default() }).unwrap();
    assert_eq!(rows.frame(Changes::NONE), [ROWS - 1, 1, 0, ROWS - 1]);
    rows.settle();
    let recorded = rows.renderer.record(SceneRef { changes: Changes::NONE, ..rows.scene.as_scene_ref() }).unwrap();
    let view = &recorded.statistics().views[0];
    assert_eq!((view.objects_of_static_groups, view.visible), (ROWS * IN_ROW - 1, ROWS * IN_ROW));
}

#[test]
fn objects_whose_mesh_depends_on_the_view_are_drawn_beside_their_static_group() {
    let absolute = Quality { transforms: TransformPrecision::Absolute, ..Quality::balanced() };
    for (mesh, quality, beside) in
        [(globe(), Quality::balanced(), 1), (culled(&cube()), Quality::balanced(), 1), (culled(&cube()), absolute, 0)]
    {
        let mut rows = Rows::new();
        rows.renderer = renderer(quality, 2).0;
        let object = rows.scene.objects().nth(3).unwrap();
        let mesh = rows.scene.add(mesh).unwrap();
        let now = RenderObject { mesh, ..rows.scene.object(object).unwrap() };
        rows.scene.replace_object(object, now).unwrap();
        rows.settle();
        let recorded = rows.renderer.record(SceneRef { changes: Changes::NONE, ..rows.scene.as_scene_ref() }).unwrap();
        assert_eq!(recorded.statistics().views[0].objects_of_static_groups, ROWS * IN_ROW - beside);
    }
}

#[test]
fn other_static_groups_keep_what_is_recorded_when_static_groups_come_and_go() {
    let mut rows = Rows::new();
    rows.settle();
    let removed = rows.scene.static_groups.remove(1);
    assert_eq!(rows.frame(Changes::NONE), [ROWS - 1, 0, 0, ROWS - 1]);
    rows.scene.static_groups.push(StaticGroup::new("again", removed.objects));
    assert_eq!(rows.frame(Changes::NONE), [ROWS - 1, 1, 0, ROWS - 1]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
    rows.scene.static_groups.reverse();
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
    // Another set of the same name.
    rows.scene.static_groups[0].objects = ObjectSet::new([IN_ROW as u32]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS - 1, 1, 0, ROWS - 1]);
    // Without static groups, and with them again.
    let static_groups = std::mem::take(&mut rows.scene.static_groups);
    assert_eq!(rows.frame(Changes::NONE), [0, 0, 0, 0]);
    rows.scene.static_groups = static_groups;
    assert_eq!(rows.frame(Changes::NONE), [0, ROWS, 0, 0]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS]);
}

#[test]
fn a_view_executes_the_static_groups_that_it_sees_and_that_its_filter_shows_as_a_whole() {
    let mut rows = Rows::new();
    let away = Camera::looking_at("away", DVec3::Z * 200.0, DVec3::Z * 300.0);
    rows.scene.cameras.push(away);
    rows.settle();
    let views = |rows: &mut Rows| -> Vec<(usize, usize)> {
        let recorded = rows.renderer.record(SceneRef { changes: Changes::NONE, ..rows.scene.as_scene_ref() }).unwrap();
        recorded.statistics().views.iter().map(|view| (view.static_groups, view.visible)).collect()
    };
    assert_eq!(views(&mut rows), [(ROWS, ROWS * IN_ROW), (0, 0)]);
    let half_a_row: ObjectSet = (0..IN_ROW as u32 / 2).collect();
    let first_two: ObjectSet = (0..2 * IN_ROW as u32).collect();
    for (filter, expected) in [
        (ViewFilter::only(half_a_row.clone()), (0, IN_ROW / 2)),
        (ViewFilter::except(half_a_row), (ROWS - 1, ROWS * IN_ROW - IN_ROW / 2)),
        (ViewFilter::only(first_two.clone()), (2, 2 * IN_ROW)),
        (ViewFilter::except(first_two), (ROWS - 2, (ROWS - 2) * IN_ROW)),
        (ViewFilter::ALL, (ROWS, ROWS * IN_ROW)),
    ] {
        rows.scene.cameras[0].filter = filter;
        assert_eq!(views(&mut rows)[0], expected, "{:?}", rows.scene.cameras[0].filter);
    }
    // What the objects of a static group are made of is asked of each.
    let materials = Some(MaterialPredicate::new(|material| material.name == "other"));
    rows.scene.cameras[0].filter = ViewFilter { materials, ..ViewFilter::ALL };
    assert_eq!(views(&mut rows)[0], (0, 0));
    // All rows lie on both sides of the far plane.
    rows.scene.cameras[0] = Camera { far: 200.0, ..Camera::looking_at("main", DVec3::Z * 200.0, DVec3::X * 60.0) };
    let (static_groups, visible) = views(&mut rows)[0];
    assert!(static_groups == 0 && (1..ROWS * IN_ROW).contains(&visible), "{static_groups} {visible}");
}

/// The shadow of the sun is drawn by a process for all materials, which may walk the objects in the order of their
/// bins.
#[test]
fn a_view_without_culling_executes_the_static_groups_that_it_does_not_see() {
    let mut rows = Rows::new();
    rows.scene.cameras[0] = Camera::looking_at("away", DVec3::Z * 200.0, DVec3::Z * 300.0);
    for (culling, executed) in [(CullingVolume::Sphere, 0), (CullingVolume::None, ROWS)] {
        rows.renderer = renderer(Quality { culling, ..Quality::balanced() }, 2).0;
        rows.frame(Changes::NONE);
        assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, executed], "{culling:?}");
    }
}

#[test]
fn objects_that_come_later_belong_to_the_static_groups_that_list_them() {
    let mut rows = Rows::new();
    let (first, second) = ((ROWS * IN_ROW) as u32, (ROWS * IN_ROW) as u32 + 1);
    rows.scene.static_groups[1].objects = ObjectSet::new([first]);
    rows.scene.static_groups[2].objects = ObjectSet::new([second]);
    rows.scene.static_groups[3].objects = ObjectSet::new([second]);
    rows.frame(Changes::NONE);
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS - 3]);
    let object = rows.scene.object(rows.scene.objects().next().unwrap()).unwrap();
    rows.scene.add_object(object).unwrap();
    assert_eq!(rows.frame(Changes::Objects(&[first])), [ROWS - 1, 0, 1, ROWS - 3]);
    rows.frame(Changes::NONE);
    assert_eq!(rows.frame(Changes::Objects(&[first])), [ROWS - 1, 0, 1, ROWS - 3]);
    rows.scene.add_object(object).unwrap();
    let error = rows.renderer.record(rows.scene.as_scene_ref()).map(drop).unwrap_err().to_string();
    assert!(error.contains("object 201 is in the static groups"), "{error}");
}

#[test]
fn shares_of_materials_draw_each_object_once_with_static_groups_and_without() {
    const SHARES: u32 = 3;
    let mut rows = Rows::new();
    rows.renderer = renderer_of(Deferred::to_picture().geometry_shares(SHARES), Quality::balanced(), 2).0;
    rows.scene.lights.push(sun());
    let materials: Vec<_> = (0..SHARES).map(|_| rows.scene.add(Material::default()).unwrap()).collect();
    let objects: Vec<_> = rows.scene.objects().collect();
    for (object, material) in objects.into_iter().zip(materials.into_iter().cycle()) {
        let now = RenderObject { material, ..rows.scene.object(object).unwrap() };
        rows.scene.replace_object(object, now).unwrap();
    }
    rows.frame(Changes::Unknown);
    rows.settle();
    for static_groups in [ROWS, 0] {
        rows.scene.static_groups.truncate(static_groups);
        for _ in 0..4 {
            rows.frame(Changes::NONE);
        }
        let scene = SceneRef { changes: Changes::NONE, ..rows.scene.as_scene_ref() };
        let recorded = rows.renderer.record(scene).unwrap();
        assert_eq!(recorded.statistics().views[0].static_groups, static_groups);
        let of_shares: Vec<_> = drawn(&rows.renderer, recorded.statistics())
            .into_iter()
            .filter(|(process, view, _)| process.starts_with("geometry buffer") && *view == 0)
            .map(|(.., objects)| objects.into_iter().map(|(object, ..)| object as usize).collect::<Vec<_>>())
            .collect();
        assert_eq!(of_shares.len(), SHARES as usize);
        let mut together: Vec<_> = of_shares.iter().flatten().copied().collect();
        together.sort_unstable();
        assert_eq!(together, (0..ROWS * IN_ROW).collect::<Vec<_>>());
        for objects in of_shares {
            assert!(
                objects.iter().all(|object| object % SHARES as usize == objects[0] % SHARES as usize),
                "{objects:?}"
            );
        }
    }
}

fn sun() -> Light {
    Light::Directional { direction: Vec3::NEG_ONE.normalize(), illuminance: Vec3::ONE, casts_shadow: true }
}

#[test]
fn shadow_maps_execute_static_groups() {
    let mut rows = Rows::new();
    rows.scene.cameras[0] = Camera::looking_at("main", DVec3::Z * 40.0, DVec3::ZERO);
    rows.scene.lights.push(sun());
    rows.settle();
    let recorded = rows.renderer.record(SceneRef { changes: Changes::NONE, ..rows.scene.as_scene_ref() }).unwrap();
    let views = &recorded.statistics().views;
    assert!(views.len() > 1 && views[1..].iter().any(|view| view.static_groups > 0), "{views:?}");
}

#[test]
fn static_groups_that_contradict_each_other_are_errors_and_the_next_frame_is_right() {
    let mut rows = Rows::new();
    rows.settle();
    let error = |rows: &mut Rows| rows.renderer.record(rows.scene.as_scene_ref()).map(drop).unwrap_err();
    rows.scene.static_groups[2].objects = ObjectSet::new([7, 1000]);
    let FrameError::Scene(shared) = error(&mut rows) else { panic!("another error") };
    assert_eq!(shared.to_string(), "object 7 is in the static groups \"row 0\" and \"row 2\", and can be in one only");
    rows.scene.static_groups[2].objects = ObjectSet::new([1000]);
    let recorded = rows.renderer.record(rows.scene.as_scene_ref()).unwrap();
    let issue = &recorded.statistics().scene_issues[0];
    assert_eq!((issue.reason, issue.count, issue.first), (IssueReason::UnknownObject, 1, 1000));
    rows.scene.static_groups[2].name = "row 4".to_owned();
    let FrameError::Scene(SceneError::RepeatedStaticGroup { static_group }) = error(&mut rows) else {
        panic!("another error")
    };
    assert_eq!(static_group, "row 4");
    rows.scene.static_groups[2].name = "row 2".to_owned();
    assert_eq!(rows.frame(Changes::NONE), [0, ROWS, 0, 0]);
    assert_eq!(rows.frame(Changes::NONE), [ROWS, 0, 0, ROWS - 1]);
}

#[test]
fn a_timeline_has_slices_of_the_static_groups_that_a_frame_records_and_executes() {
    let mut rows = Rows::new();
    let log = |rows: &mut Rows| {
        rows.renderer.scheduler().timeline().start();
        rows.frame(Changes::NONE);
        rows.renderer.scheduler().timeline().take()
    };
    let width_of = |log: &Log, stage: &str| {
        let nodes = log.runs[0].graph.nodes.iter().enumerate();
        let of_stage = nodes.filter(|(_, node)| node.labels.stage.as_deref() == Some(stage));
        of_stage.map(|(index, _)| log.runs[0].width(index)).sum::<usize>()
    };
    let counter = |log: &Log, name: &str| {
        log.counters.iter().find(|counter| counter.name == name).map_or(f64::NAN, |counter| counter.value)
    };
    let recording = log(&mut rows);
    assert_eq!(width_of(&recording, "record static groups"), ROWS);
    let mut names: Vec<_> = recording.spans.iter().map(|span| span.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names[1..], (0..ROWS).map(|row| format!("record static group \"row {row}\"")).collect::<Vec<_>>());
    assert_eq!(counter(&recording, "static groups recorded"), ROWS as f64);
    // In the first frame that executes them, and where nothing is made anew.
    for _ in 0..3 {
        let executing = log(&mut rows);
        assert_eq!(
            (width_of(&executing, "record static groups"), width_of(&executing, "execute static groups")),
            (0, 1)
        );
        assert_eq!(executing.spans.len(), 1, "{:?}", executing.spans);
        assert_eq!(counter(&executing, "static groups executed"), ROWS as f64);
        assert_eq!(counter(&executing, "objects of executed static groups"), (ROWS * IN_ROW) as f64);
        let report = FrameReport::new(&executing, executing.frames[0].number, &SchedulerCosts::ZERO).unwrap();
        assert!(report.slack.iter().any(|slack| slack.name.contains("execute static groups")), "{:?}", report.slack);
    }
}
