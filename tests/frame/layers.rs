//! Processes that draw the objects of some layers.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::Selection;
use drawloom::process::{CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::quality::{DepthCurve, DepthPrecision, Quality};
use drawloom::scene::{Changes, LayerMask, SceneError, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, Submitter};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::field;
use proptest::prelude::*;

/// Draws the depth of the objects that it selects.
pub struct Depth {
    pub name: String,
    pub selection: Selection,
}

impl RenderProcess for Depth {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth(&self.name, Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { fragment: None, selection: self.selection, ..CommandDraws::default() })
    }
}

/// Of opaque objects, of blended ones, and of all.
pub const SELECTIONS: [Selection; 3] = [Selection::OPAQUE, Selection::BLENDED, Selection::ALL];

/// A renderer with each selection twice: of all layers, and of these.
fn renderer(layers: LayerMask, quality: Quality, workers: usize) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let mut builder = Renderer::builder(NullBackend).quality(quality);
    for (index, selection) in SELECTIONS.into_iter().enumerate() {
        builder = builder.process(Depth { name: format!("all {index}"), selection });
        builder = builder.process(Depth { name: format!("some {index}"), selection: selection.in_layers(layers) });
    }
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

/// Whether the processes of some layers drew what those of all layers did, without the objects of other layers.
fn check(renderer: &Renderer<NullBackend>, drawn: LayerMask, layers: &[LayerMask]) -> Result<(), TestCaseError> {
    for view in 0..2 {
        for index in 0..SELECTIONS.len() {
            let objects = |of: &str| renderer.draw_list(&format!("{of} {index}"), view).unwrap().objects.clone();
            let in_layers = |object: &u32| {
                let own = layers.get(*object as usize).map_or(u32::MAX, |layers| layers.0);
                own & drawn.0 != 0
            };
            let mut expected: Vec<_> = objects("all").into_iter().filter(in_layers).collect();
            let mut found = objects("some");
            expected.sort_unstable();
            found.sort_unstable();
            prop_assert_eq!(found, expected, "selection {} in view {}", index, view);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_process_draws_the_objects_of_its_layers(
        seed in any::<u64>(), count in 0_usize..700, drawn in 0_u32..16, bits in 0_u32..2, workers in 1_usize..3,
    ) {
        let drawn = LayerMask(drawn);
        let quality = Quality {
            opaque_order: DepthPrecision { bits: bits * 8, curve: DepthCurve::Logarithmic },
            ..Quality::balanced()
        };
        let (mut renderer, submitter) = renderer(drawn, quality, workers);
        let (mut world, mut random) = (ChangingWorld::new(seed, count), Random::stream(seed));
        let mut layers: Vec<_> = (0..count).map(|_| LayerMask(random.below(16) as u32)).collect();
        for frame in 0..8 {
            let scene = world.as_scene_ref();
            layers.resize(scene.object_count(), LayerMask(3));
            // Without layers every object belongs to all.
            let lent: &[LayerMask] = if frame == 3 { &[] } else { &layers };
            // The world does not know of layers, which all count as changed if some do.
            let changes = if frame % 2 == 0 || frame == 3 { Changes::Unknown } else { scene.changes };
            let recorded = renderer.record(SceneRef { layers: lent, changes, ..scene });
            submitter.submit(recorded.unwrap()).unwrap();
            check(&renderer, drawn, lent)?;
            if frame % 2 == 1 {
                layers.iter_mut().step_by(3).for_each(|layers| *layers = LayerMask(random.below(16) as u32));
            } else if frame != 2 {
                world.step().unwrap();
            }
        }
    }
}

#[test]
fn a_list_is_kept_until_layers_change() {
    let (mut renderer, _) = renderer(LayerMask(1), Quality::balanced(), 1);
    let scene = field(500);
    let mut layers = vec![LayerMask(1); 500];
    let mut frame = |layers: &[LayerMask], changes| {
        let recorded = renderer.record(SceneRef { layers, changes, ..scene.as_scene_ref() });
        drop(recorded.unwrap());
        let list = renderer.draw_list("some 0", 0).unwrap();
        (list.version(), list.objects.clone())
    };
    let first = frame(&layers, Changes::Unknown);
    assert_eq!(first.0, frame(&layers, Changes::NONE).0, "nothing changed");
    let hidden = first.1[0];
    layers[hidden as usize] = LayerMask(2);
    let changed = frame(&layers, Changes::Objects(&[hidden]));
    assert!(!changed.1.contains(&hidden) && changed.1.len() + 1 == first.1.len());
}

#[test]
fn layers_that_do_not_fit_are_refused() {
    let (mut renderer, _) = renderer(LayerMask(1), Quality::balanced(), 1);
    let scene = field(5);
    let error = renderer.record(SceneRef { layers: &[LayerMask(1); 4], ..scene.as_scene_ref() }).map(drop).unwrap_err();
    let expected = SceneError::UnequalSlices { slice: "layers", count: 4, positions: 5 };
    assert!(matches!(&error, FrameError::Scene(found) if *found == expected), "{error}");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only builds with assertions look for changes that are not reported")]
fn layers_that_change_without_a_report_are_named() {
    let (mut renderer, _) = renderer(LayerMask(1), Quality::balanced(), 1);
    let scene = field(5);
    drop(renderer.record(SceneRef { layers: &[LayerMask(1); 5], ..scene.as_scene_ref() }).unwrap());
    let changed = [1, 1, 2, 1, 1].map(LayerMask);
    let lent = SceneRef { layers: &changed, changes: Changes::Objects(&[1]), ..scene.as_scene_ref() };
    let error = renderer.record(lent).map(drop).unwrap_err();
    assert!(matches!(&error, FrameError::Scene(SceneError::UnreportedChange { object: 2 })), "{error}");
}
