//! Draws of an engine's own: which items a pass draws, in which order, and what is refused.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::{
    Declare, Draws, Format, ItemContext, ItemDraws, ItemOrder, ItemRange, ItemRecorder, ItemViews, Items, RecordItems,
    RenderProcess,
};
use drawloom::scene::{Assets, Camera, Changes, LayerMask, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::internal::Frustum;
use drawloom::view::{BoundingSphere, IssueReason};
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameError, FrameInputs, Granularity, Renderer, Submitter};
use proptest::prelude::*;

/// Draws items of this name.
struct Own {
    name: &'static str,
    order: ItemOrder,
}

impl RenderProcess for Own {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth(self.name, Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws { order: self.order })
    }
}

/// The null backend calls no code of an engine's.
struct Never;

impl RecordItems for Never {
    fn record<'e>(
        &'e self,
        _: &mut dyn RenderEncoder<'e>,
        _: ItemRange<'e>,
        _: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        Err("nothing is recorded".into())
    }
}

fn items<'a>(process: &'a str, keys: &'a [u64]) -> Items<'a> {
    Items::new(process, keys, ItemRecorder::Any(&Never))
}

fn renderer(workers: usize, granularity: Granularity) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let builder = Renderer::builder(NullBackend)
        .granularity(granularity)
        .process(Own { name: "sorted", order: ItemOrder::ByKey })
        .process(Own { name: "as lent", order: ItemOrder::AsLent });
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

/// Two cameras that look in opposite directions, and draw different layers.
fn cameras() -> [Camera; 2] {
    let one = Camera::looking_at("one", DVec3::ZERO, DVec3::NEG_Z);
    let other = Camera::looking_at("other", DVec3::ZERO, DVec3::Z);
    [Camera { layers: LayerMask(0b01), ..one }, Camera { layers: LayerMask(0b11), ..other }]
}

fn list(renderer: &Renderer<NullBackend>, process: &str, view: usize) -> Vec<u32> {
    renderer.draw_list(process, view).unwrap().items.items().to_vec()
}

/// What a loop over all items draws.
fn naive(camera: &Camera, items: &Items<'_>, sorts: bool) -> Vec<u32> {
    let frustum = Frustum::new(camera);
    let is_seen = |item: &u32| {
        let item = *item as usize;
        let is_near = |sphere: &BoundingSphere| frustum.intersects_sphere(sphere.center, sphere.radius);
        items.bounds.get(item).is_none_or(is_near)
            && items.layers.get(item).is_none_or(|layers| layers.0 & camera.layers.0 != 0)
    };
    let mut seen: Vec<_> = (0..items.keys.len() as u32).filter(is_seen).collect();
    if sorts {
        seen.sort_by_key(|item| items.keys[*item as usize]);
    }
    seen
}

fn any_granularity() -> impl Strategy<Value = Granularity> {
    prop_oneof![
        Just(Granularity::Adaptive),
        Just(Granularity::PerCamera),
        Just(Granularity::PerDraw),
        (1..700_usize).prop_map(Granularity::Chunk),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Frames whose items move, come and go. Some of them fail.
    #[test]
    fn views_draw_the_items_that_they_see_in_order(
        workers in 1_usize..4,
        granularity in any_granularity(),
        counts in prop::collection::vec(prop_oneof![0_usize..40, 0_usize..3_000], 1..6),
        spread in 1_u64..2_000,
        seed in any::<u64>(),
        has_layers in any::<bool>(),
        reports in any::<bool>(),
    ) {
        let (mut renderer, submitter) = renderer(workers, granularity);
        let (assets, cameras) = (Assets::default(), cameras());
        let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
        let mut before: Option<(Vec<_>, Vec<_>, Vec<_>)> = None;
        for (frame, count) in (0_u64..).zip(counts.into_iter().flat_map(|count| [count; 2])) {
            let number = |item: usize, of: u64| (item as u64 + 1 + of).wrapping_mul(seed | 1).rotate_left(29);
            let keys: Vec<_> = (0..count).map(|item| number(item, frame / 2) % spread).collect();
            let coordinate = |item, of| (number(item, of) % 1_000) as f64 / 10.0 - 50.0;
            // A third of the items move.
            let moves = |item| u64::from(number(item, 5) % 3 == 0) * frame;
            let center = |item| DVec3::new(coordinate(item, 1), coordinate(item, 2), coordinate(item, 3 + moves(item)));
            let bounds: Vec<_> = (0..count).map(|item| BoundingSphere { center: center(item), radius: 2.0 }).collect();
            let layers: Vec<_> = (0..count).map(|item| LayerMask((number(item, 9) % 4) as u32)).collect();
            let layers = if has_layers { &layers[..] } else { &[] };
            let is_other = |&item: &u32| before.as_ref().is_none_or(|(keys_before, bounds_before, layers_before)| {
                let item = item as usize;
                keys_before.get(item) != keys.get(item)
                    || bounds_before.get(item) != bounds.get(item)
                    || layers_before.get(item) != layers.get(item)
            });
            let others: Vec<_> = (0..count as u32).filter(is_other).collect();
            let changes = if reports { Changes::Objects(&others) } else { Changes::Unknown };
            let of = |process| Items { bounds: &bounds, layers, changes, ..items(process, &keys) };
            let lent = ["sorted", "as lent"].map(of);
            before = Some((keys.clone(), bounds.clone(), layers.to_vec()));
            if frame % 3 == 1 {
                let cameras = [Camera::looking_at("far away", DVec3::splat(1e12), DVec3::ZERO)];
                let scene = SceneRef { cameras: &cameras, ..scene };
                let failed = renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) });
                prop_assert!(failed.is_err());
            }
            let inputs = FrameInputs { items: &lent, ..FrameInputs::new(scene) };
            let recorded = renderer.record_with(inputs).unwrap();
            for (view, camera) in cameras.iter().enumerate() {
                let expected = [true, false].map(|sorts| naive(camera, &lent[0], sorts));
                let found = ["sorted", "as lent"].map(|process| list(&renderer, process, view));
                let statistics = &recorded.statistics().views[view];
                prop_assert_eq!(statistics.items, found[0].len() + found[1].len());
                prop_assert_eq!(found, expected);
            }
            let submitted = submitter.submit(recorded).unwrap();
            for pass in &submitted.submission.passes {
                let expected = list(&renderer, &pass.process, pass.view);
                prop_assert_eq!((pass.items, pass.batches, pass.objects), (expected.len(), 0, 0));
                prop_assert!(pass.bundles >= expected.len().div_ceil(1024));
            }
        }
    }
}

#[test]
fn what_changed_counts_from_the_items_lent_last_for_the_process_even_if_that_frame_failed() {
    let names = ["one", "other"];
    let builder = names
        .into_iter()
        .fold(Renderer::builder(NullBackend), |builder, name| builder.process(Own { name, order: ItemOrder::ByKey }));
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let (assets, cameras) = (Assets::default(), cameras());
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let sphere = |z: f64| BoundingSphere { center: DVec3::Z * z, radius: 1.0 };
    let mut bounds = [[sphere(-5.0), sphere(5.0)], [sphere(5.0), sphere(-5.0)]];
    let mut draw = |bounds: &[[BoundingSphere; 2]; 2], changes, order: [usize; 2]| {
        let lent = order.map(|set| Items { bounds: &bounds[set], changes, ..items(names[set], &[0; 2]) });
        let drawn = renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).map(drop);
        drawn.map(|()| names.map(|process| list(&renderer, process, 0)))
    };
    let expected = [vec![0], vec![1]];
    assert_eq!(draw(&bounds, Changes::Unknown, [0, 1]).unwrap(), expected);
    assert_eq!(draw(&bounds, Changes::NONE, [0, 1]).unwrap(), expected);
    assert_eq!(draw(&bounds, Changes::NONE, [1, 0]).unwrap(), expected, "in another order");
    bounds[1].swap(0, 1);
    assert!(draw(&bounds, Changes::Objects(&[0, 1]), [1, 1]).is_err(), "twice for one process");
    assert_eq!(draw(&bounds, Changes::NONE, [1, 0]).unwrap(), [[0], [0]]);
    bounds[0].swap(0, 1);
    assert_eq!(draw(&bounds, Changes::Ranges(&[0..1, 1..2]), [1, 0]).unwrap(), [[1], [0]]);
    bounds[0][1].center.x = 0.1;
    let unreported = draw(&bounds, Changes::NONE, [1, 0]);
    if cfg!(debug_assertions) {
        let expected = "item 1 of process \"one\" changed, which is not reported";
        assert_eq!(unreported.unwrap_err().to_string(), expected);
        assert_eq!(draw(&bounds, Changes::NONE, [1, 0]).unwrap(), [[1], [0]], "the frame before has failed");
    }
}

#[test]
fn views_have_items_of_their_own() {
    let (mut renderer, _) = renderer(2, Granularity::Adaptive);
    let (assets, cameras) = (Assets::default(), cameras());
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let as_lent = items("as lent", &[0; 4]);
    let own = |views, keys| Items { views, ..items("sorted", keys) };
    let mut draw = |sets: &[Items<'_>]| {
        let lent: Vec<_> = sets.iter().copied().chain([as_lent]).collect();
        drop(renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).unwrap());
        let of = |process| [0, 1].map(|view| list(&renderer, process, view));
        assert_eq!(of("as lent"), [[0, 1, 2, 3]; 2]);
        of("sorted")
    };
    let (named, of_kind) = (ItemViews::Named("one"), ItemViews::OfKind(ViewKind::Main));
    let [first, second] = [own(named, &[2, 1, 3]), own(ItemViews::Named("other"), &[5, 4])];
    let nobodys = [ItemViews::Named("nobody"), ItemViews::OfKind(ViewKind::Shadow)].map(|views| own(views, &[1]));
    assert_eq!(draw(&[first, second]), [vec![1, 0, 2], vec![1, 0]]);
    assert_eq!(draw(&[second, nobodys[0], nobodys[1], first]), [vec![1, 0, 2], vec![1, 0]], "in another order");
    assert_eq!(draw(&[own(of_kind, &[9, 8])]), [[1, 0], [1, 0]]);
    assert_eq!(draw(&[own(ItemViews::All, &[9, 8, 7])]), [[2, 1, 0], [2, 1, 0]]);
    assert_eq!(draw(&[first, second]), [vec![1, 0, 2], vec![1, 0]], "as before");
}

#[test]
fn a_view_whose_layers_change_sees_other_items() {
    let (mut renderer, _) = renderer(1, Granularity::Adaptive);
    let (assets, [mut camera, _]) = (Assets::default(), cameras());
    let layers = [LayerMask::layer(0), LayerMask::layer(1), LayerMask::ALL];
    let lent = ["sorted", "as lent"].map(|process| Items { layers: &layers, ..items(process, &[0; 3]) });
    for (layer, expected) in [(0, [0, 2]), (1, [1, 2]), (0, [0, 2])] {
        camera.layers = LayerMask::layer(layer);
        let cameras = [camera.clone()];
        let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
        drop(renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).unwrap());
        assert_eq!(list(&renderer, "sorted", 0), expected);
    }
}

#[test]
fn items_that_do_not_fit_the_processes_are_refused_by_name_and_the_next_frame_is_right() {
    let (mut renderer, _) = renderer(2, Granularity::Adaptive);
    let (assets, cameras) = (Assets::default(), cameras());
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let (sorted, as_lent) = (items("sorted", &[3, 1, 2]), items("as lent", &[]));
    let one_sphere = [BoundingSphere { center: DVec3::ZERO, radius: 1.0 }];
    let two_layers = [LayerMask::ALL; 2];
    let cases = [
        (vec![sorted], "process \"as lent\" draws items in view \"one\", and none are lent for it"),
        (vec![sorted, as_lent, sorted], "two sets of items are lent for process \"sorted\" in view \"one\""),
        (
            vec![as_lent, Items { views: ItemViews::Named("other"), ..sorted }],
            "process \"sorted\" draws items in view \"one\", and none are lent for it",
        ),
        (
            vec![as_lent, sorted, Items { views: ItemViews::Named("other"), ..sorted }],
            "two sets of items are lent for process \"sorted\" in view \"other\"",
        ),
        (
            vec![as_lent, Items { data: &[0; 6], ..sorted }],
            "the items of process \"sorted\" have 6 bytes of data, which is not a multiple of 4",
        ),
        (
            vec![Items { bounds: &one_sphere, ..sorted }, as_lent],
            "the items of process \"sorted\" have 3 keys but 1 bounds",
        ),
        (
            vec![as_lent, Items { layers: &two_layers, ..sorted }],
            "the items of process \"sorted\" have 3 keys but 2 layers",
        ),
        (
            vec![as_lent, Items { versions: &[0; 4], ..sorted }],
            "the items of process \"sorted\" have 3 keys but 4 versions",
        ),
    ];
    for (lent, expected) in cases {
        let error = renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).err().unwrap();
        assert_eq!(error.to_string(), expected);
        // Items for a process that there is not are nobody's.
        let lent = [as_lent, sorted, items("none", &[1])];
        drop(renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).unwrap());
        assert_eq!(list(&renderer, "sorted", 0), [1, 2, 0]);
    }
}

#[test]
fn items_for_a_process_that_draws_none_are_refused() {
    struct Nothing;
    impl RenderProcess for Nothing {
        fn name(&self) -> &str {
            "nothing"
        }

        fn declare(&self, declare: &mut Declare) {
            declare.clears_depth("nothing", Format::Depth32Float);
            declare.keep();
        }

        fn draws(&self) -> Draws<'_> {
            Draws::FullScreen(drawloom::process::FullScreen::default())
        }
    }
    let builder = Renderer::builder(NullBackend).process(Nothing);
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let (assets, cameras) = (Assets::default(), cameras());
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let lent = [items("nothing", &[1])];
    let error = renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).err().unwrap();
    assert!(matches!(&error, FrameError::UnexpectedItems { process } if process == "nothing"), "{error}");
}

#[test]
fn items_with_invalid_bounds_are_left_out_counted_and_named() {
    let (mut renderer, _) = renderer(2, Granularity::Adaptive);
    let (assets, cameras) = (Assets::default(), cameras());
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let at = |center: DVec3, radius: f32| BoundingSphere { center, radius };
    let seen = DVec3::NEG_Z * 5.0;
    let bounds = [
        at(seen, 1.0),
        at(DVec3::NAN, 1.0),
        at(DVec3::X * f64::INFINITY, 1.0),
        at(seen, -1.0),
        at(seen, f32::NAN),
        // Seen by every view.
        at(DVec3::Z * 1e9, f32::INFINITY),
        at(seen, 0.0),
    ];
    let lent = [items("as lent", &[0; 10]), Items { bounds: &bounds, ..items("sorted", &[0; 7]) }];
    let recorded = renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene) }).unwrap();
    assert_eq!([0, 1].map(|view| list(&renderer, "sorted", view)), [vec![0, 5, 6], vec![5]]);
    let issues = &recorded.statistics().scene_issues;
    let found: Vec<_> = issues.iter().map(|issue| (issue.reason, issue.count, issue.first)).collect();
    assert_eq!(found, [(IssueReason::InvalidItemBounds, 4, 11)]);
    assert_eq!(issues[0].name.as_deref(), Some("sorted"));
}
