//! Views that show some objects: those of a list, those that a list leaves, and those of some materials.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::NullBackend;
use drawloom::glam::Vec3;
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, DepthCurve, DepthPrecision, Quality};
use drawloom::scene::{
    Blend, Camera, Changes, FilteredObjects, LayerMask, Light, Material, MaterialPredicate, ObjectSet, Scene, SceneRef,
    ViewFilter,
};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::{FrameError, Granularity, Renderer, Submitter};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::field;
use proptest::prelude::*;

use crate::layers::{Depth, SELECTIONS};
use crate::occlusion::wall_and_cubes;
use crate::reported;

/// A renderer that draws each selection.
fn renderer(
    quality: Quality,
    workers: usize,
    granularity: Granularity,
) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let mut builder = Renderer::builder(NullBackend).quality(quality).granularity(granularity);
    for (index, selection) in SELECTIONS.into_iter().enumerate() {
        builder = builder.process(Depth { name: index.to_string(), selection });
    }
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

/// What decides about materials: some that blending decides, which is part of an object's draw state, and some that
/// other fields do.
const TESTS: [fn(&Material) -> bool; 5] = [
    |material| material.blend == Blend::None,
    |material| material.double_sided,
    |material| material.diffuse.x > 0.5,
    |material| material.name.ends_with('2') || material.opacity > 0.7,
    |_| true,
];

/// A filter, and what it is made of.
#[derive(Clone)]
struct Case {
    filter: ViewFilter,
    /// Whether the list is of the objects that pass, and the list.
    list: Option<(bool, BTreeSet<u32>)>,
    test: Option<usize>,
    layers: LayerMask,
}

impl Case {
    fn any(random: &mut Random, count: usize, predicates: &[MaterialPredicate]) -> Self {
        // Lists of few and of many objects, some of them beyond the scene.
        let density = [0, 1, 10, 50, 99][random.below(5)];
        let listed: BTreeSet<u32> = (0..count as u32 + 70).filter(|_| random.below(100) < density).collect();
        let list = (random.below(4) > 0).then(|| (random.below(2) == 0, listed));
        let test = (random.below(3) > 0).then(|| random.below(TESTS.len()));
        let objects = match &list {
            None => FilteredObjects::All,
            Some((true, listed)) => FilteredObjects::Only(listed.iter().copied().collect()),
            Some((false, listed)) => FilteredObjects::Except(listed.iter().copied().collect()),
        };
        let filter = ViewFilter { objects, materials: test.map(|test| predicates[test].clone()) };
        let layers = if random.below(2) == 0 { LayerMask::ALL } else { LayerMask(random.below(16) as u32) };
        Self { filter, list, test, layers }
    }

    fn passes(&self, object: u32, scene: &SceneRef<'_>) -> bool {
        let is_listed = self.list.as_ref().is_none_or(|(only, listed)| listed.contains(&object) == *only);
        let material = scene.assets.get(scene.materials[object as usize]).unwrap();
        is_listed && self.test.is_none_or(|test| TESTS[test](material))
    }
}

/// Changes how a material looks, which changes no object's draw state.
fn repaint(scene: &mut Scene, random: &mut Random) {
    let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
    let handle = materials[random.below(materials.len())];
    let repainted = Material {
        diffuse: random.vector(0.0, 1.0),
        opacity: random.between(0.5, 1.0) as f32,
        ..scene.assets().get(handle).unwrap().clone()
    };
    scene.replace(handle, repainted).unwrap();
}

fn any_quality() -> impl Strategy<Value = Quality> {
    let volumes = [CullingVolume::None, CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox];
    (prop::sample::select(volumes.to_vec()), 0_u32..2).prop_map(|(culling, bits)| Quality {
        culling,
        opaque_order: DepthPrecision { bits: bits * 8, curve: DepthCurve::Logarithmic },
        ..Quality::balanced()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Each view is there twice, without a filter and with one, and the filtered one shows those objects of the other
    /// that pass.
    #[test]
    fn a_view_shows_the_objects_that_its_filter_lets_pass(
        seed in any::<u64>(), count in 0_usize..700, quality in any_quality(), workers in 1_usize..5, chunk in 0_usize..300,
    ) {
        let granularity = if chunk < 100 { Granularity::default() } else { Granularity::Chunk(chunk) };
        let (mut renderer, submitter) = renderer(quality, workers, granularity);
        let (mut world, mut random) = (ChangingWorld::new(seed, count), Random::stream(!seed));
        let predicates = TESTS.map(MaterialPredicate::new);
        let mut cases: Vec<_> = (0..2).map(|_| Case::any(&mut random, count, &predicates)).collect();
        for frame in 0..10 {
            let plain = &world.scene.cameras;
            let filtered = plain.iter().zip(&cases).map(|(camera, Case { filter, layers, .. })| Camera {
                name: format!("{} filtered", camera.name),
                filter: filter.clone(),
                layers: *layers,
                ..camera.clone()
            });
            let cameras: Vec<_> = plain.iter().cloned().chain(filtered).collect();
            let scene = world.as_scene_ref();
            let layers: Vec<_> = (0..scene.object_count() as u32).map(|object| LayerMask(object % 13)).collect();
            // Nothing changes in every third frame but the filters.
            let changes = if frame % 3 == 2 { Changes::NONE } else { scene.changes };
            let scene = SceneRef { cameras: &cameras, layers: &layers, changes, ..scene };
            let recorded = renderer.record(scene).unwrap();
            let statistics = recorded.statistics().clone();
            submitter.submit(recorded).unwrap();
            for (view, case) in cases.iter().enumerate() {
                let mut visible = 0;
                for (index, selection) in SELECTIONS.iter().enumerate() {
                    let drawn = |view| renderer.draw_list(&index.to_string(), view).unwrap().objects.clone();
                    let passing: Vec<_> = drawn(view).into_iter().filter(|object| case.passes(*object, &scene)).collect();
                    let in_layers = |object: &u32| case.layers == LayerMask::ALL || LayerMask(object % 13).intersects(case.layers);
                    let mut expected: Vec<_> = passing.iter().copied().filter(in_layers).collect();
                    let mut found = drawn(view + 2);
                    expected.sort_unstable();
                    found.sort_unstable();
                    prop_assert_eq!(found, expected, "{:?} in view {} of frame {}", selection, view, frame);
                    visible = passing.len();
                }
                // The last selection is of all objects.
                prop_assert_eq!(statistics.views[view + 2].visible, visible);
            }
            for case in &mut cases {
                if random.below(2) == 0 {
                    *case = Case::any(&mut random, scene.object_count(), &predicates);
                }
            }
            if frame % 3 != 1 {
                world.step().unwrap();
            }
            if random.below(2) == 0 {
                repaint(&mut world.scene, &mut random);
            }
        }
    }
}

/// The first camera of a field with a filter.
fn filtered(filter: ViewFilter) -> Vec<Camera> {
    vec![Camera { filter, ..field(0).cameras.remove(0) }]
}

#[test]
fn a_list_is_kept_until_the_filter_or_its_answer_changes() {
    let (mut renderer, _) = renderer(Quality::balanced(), 2, Granularity::default());
    let mut scene = field(500);
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    let predicate = MaterialPredicate::new(move |material| {
        counted.fetch_add(1, Ordering::Relaxed);
        material.diffuse.x < 0.7
    });
    let mut frame = |scene: &Scene, objects: &[u32]| {
        let filter = ViewFilter::except(objects.iter().copied().collect()).of_materials(predicate.clone());
        let lent = SceneRef { cameras: &filtered(filter), changes: Changes::NONE, ..scene.as_scene_ref() };
        drop(renderer.record(lent).unwrap());
        let list = renderer.draw_list("2", 0).unwrap();
        (list.version(), list.objects.len(), calls.swap(0, Ordering::Relaxed))
    };
    let first = frame(&scene, &[]);
    assert_eq!(first.2, 5, "once a material, however many objects have it");
    assert_eq!(frame(&scene, &[]), (first.0, first.1, 0), "an equal filter");
    let hidden: Vec<u32> = (0..250).collect();
    let halved = frame(&scene, &hidden);
    assert!(halved.1 < first.1 && halved.1 > 0 && halved.0 != first.0 && halved.2 == 0, "{halved:?}");
    assert_eq!(frame(&scene, &[]).1, first.1);
    let version = frame(&scene, &[]).0;
    let (handle, material) = scene.assets().iter::<Material>().nth(1).unwrap();
    let material = material.clone();
    scene.replace(handle, Material { diffuse: Vec3::splat(0.5), ..material.clone() }).unwrap();
    assert_eq!(frame(&scene, &[]), (version, first.1, 5), "the answer is the same");
    scene.replace(handle, Material { diffuse: Vec3::splat(0.9), ..material }).unwrap();
    let repainted = frame(&scene, &[]);
    assert!(repainted.1 < first.1 && repainted.0 != version && repainted.2 == 5, "{repainted:?}");
}

#[test]
fn a_view_whose_list_and_predicate_go_at_once_shows_all_objects() {
    let (mut renderer, _) = renderer(Quality::balanced(), 1, Granularity::default());
    let scene = field(500);
    let mut drawn = |filter: ViewFilter| {
        let lent = SceneRef { cameras: &filtered(filter), changes: Changes::NONE, ..scene.as_scene_ref() };
        drop(renderer.record(lent).unwrap());
        renderer.draw_list("2", 0).unwrap().objects.len()
    };
    let all = drawn(ViewFilter::ALL);
    let filter = ViewFilter::except((0..250).collect()).of_materials(MaterialPredicate::new(|_| false));
    assert_eq!(drawn(filter), 0);
    assert_eq!(drawn(ViewFilter::ALL), all);
}

#[test]
fn a_predicate_holds_for_objects_that_get_another_material() {
    let (mut renderer, _) = renderer(Quality::balanced(), 1, Granularity::default());
    let scene = field(300);
    let whole = scene.as_scene_ref();
    let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
    let [red, blue] = [materials[0], materials[4]];
    let cameras = filtered(ViewFilter::ALL.of_materials(MaterialPredicate::new(|material| material.diffuse.x < 0.5)));
    let mut painted = vec![blue; 300];
    let mut visible = |painted: &[_], changes| {
        let recorded = renderer.record(SceneRef { materials: painted, cameras: &cameras, changes, ..whole }).unwrap();
        recorded.statistics().views[0].visible
    };
    assert_eq!(visible(&painted, Changes::Unknown), 0);
    painted.fill(red);
    let all = visible(&painted, Changes::Unknown);
    painted.fill(blue);
    assert_eq!(visible(&painted, Changes::Unknown), 0);
    let objects: Vec<u32> = (0..300).collect();
    for changed in objects.chunks(60) {
        changed.iter().for_each(|object| painted[*object as usize] = red);
        visible(&painted, Changes::Objects(changed));
    }
    assert!(all > 0 && visible(&painted, Changes::NONE) == all);
}

#[test]
fn a_filter_that_lets_nothing_pass_makes_an_empty_view() {
    let (mut renderer, submitter) = crate::renderer(2, Granularity::default());
    let scene = field(100);
    let never = MaterialPredicate::new(|_| false);
    for filter in [
        ViewFilter::only(ObjectSet::default()),
        ViewFilter::except((0..100).collect()),
        ViewFilter::ALL.of_materials(never),
    ] {
        let cameras = filtered(filter);
        let recorded = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() }).unwrap();
        let statistics = submitter.submit(recorded).unwrap().statistics;
        let view = &statistics.views[0];
        assert_eq!((view.visible, view.commands, view.batches), (0, 0, 0), "{:?}", cameras[0].filter);
        assert!(statistics.scene_issues.is_empty());
    }
}

#[test]
fn listed_objects_that_the_scene_lacks_are_counted_once_and_warned_of() {
    let (mut renderer, _) = crate::renderer(2, Granularity::default());
    let mut scene = field(10);
    scene.cameras[0].filter = ViewFilter::only(ObjectSet::new([3, 9, 10, u32::MAX]));
    scene.cameras[1].filter = ViewFilter::except(ObjectSet::new([10, 11]));
    let mut scene_issues = Vec::new();
    let mut frame = |scene: &Scene| {
        reported(|| scene_issues = renderer.record(scene.as_scene_ref()).unwrap().statistics().scene_issues.clone())
    };
    let warning = frame(&scene);
    assert!(warning.contains("object that a filter lists and the scene does not have"), "{warning}");
    assert_eq!(frame(&scene), "", "nothing new");
    assert_eq!(scene_issues, [SceneIssue { reason: IssueReason::UnknownObject, count: 3, first: 10, name: None }]);
}

#[test]
fn a_predicate_that_panics_fails_the_frame_and_names_the_view() {
    let (mut renderer, submitter) = crate::renderer(2, Granularity::default());
    let mut scene = field(200);
    let mut frame = |scene: &Scene| {
        let recorded = renderer.record(scene.as_scene_ref())?;
        Ok::<_, FrameError>(submitter.submit(recorded).unwrap().statistics.views)
    };
    let before = frame(&scene).unwrap();
    let fifth = MaterialPredicate::new(|material| {
        assert!(!material.name.ends_with('4'), "no such material");
        true
    });
    scene.cameras[1].filter = ViewFilter::ALL.of_materials(fifth);
    for _ in 0..2 {
        let error = frame(&scene).unwrap_err();
        let is_named = matches!(&error, FrameError::FilterPanicked { view, message } if view == "side" && message == "no such material");
        assert!(is_named, "{error}");
        assert!(error.to_string().contains("\"side\""), "{error}");
    }
    scene.cameras[1].filter = ViewFilter::ALL;
    assert_eq!(frame(&scene).unwrap(), before);
}

#[test]
fn what_a_view_leaves_out_hides_nothing() {
    let quality = Quality { occlusion: Some(8), ..Quality::balanced() };
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, _) = builder.build(scheduler).unwrap();
    let mut scene = wall_and_cubes();
    let mut first = |scene: &Scene| {
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let view = &recorded.statistics().views[0];
        (view.visible, view.occluded)
    };
    let (visible, occluded) = first(&scene);
    assert!(occluded > 100);
    // The first object is the wall.
    scene.cameras[0].filter = ViewFilter::except(ObjectSet::new([0]));
    assert_eq!(first(&scene), (visible + occluded - 1, 0));
    scene.cameras[0].filter = ViewFilter::ALL;
    assert_eq!(first(&scene), (visible, occluded));
}

#[test]
fn shadow_maps_ignore_the_filters_of_the_views_that_they_light() {
    let (mut renderer, _) = crate::renderer(2, Granularity::default());
    let mut scene = field(200);
    scene.lights = vec![Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true }];
    let mut visible = |scene: &Scene| {
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        recorded.statistics().views.iter().map(|view| view.visible).collect::<Vec<_>>()
    };
    let before = visible(&scene);
    scene.cameras.iter_mut().for_each(|camera| camera.filter = ViewFilter::only(ObjectSet::new([0])));
    let after = visible(&scene);
    assert!(after.len() == 4 && after[..2].iter().all(|visible| *visible <= 1), "{after:?}");
    assert!(before[2..].iter().all(|visible| *visible > 1) && after[2..] == before[2..], "{before:?}, {after:?}");
}
