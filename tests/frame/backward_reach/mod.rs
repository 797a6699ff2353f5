//! A frame is the backward reach of its outputs: over random scenes and random processes of an engine, it has the
//! passes, the targets and the shadow maps that a naive oracle predicts, and no others.

mod cases;
mod engine;
mod oracle;
mod spec;

use drawloom::backend::NullBackend;
use drawloom::scene::ViewKind;
use drawloom::{FrameError, Renderer};
use drawloom_testing::random::Random;
use proptest::prelude::*;

use self::engine::{new_renderer, scene};
use self::oracle::{Frame, predict};
use self::spec::{Pipeline, World};

/// What the renderer makes of a world.
fn recorded(renderer: &mut Renderer<NullBackend>, world: &World) -> Frame {
    let scene = scene(world);
    let recorded = match renderer.record(scene.as_scene_ref()) {
        Ok(recorded) => recorded,
        Err(FrameError::NoProcess { view, .. }) => return Frame { refused: Some(view), ..Frame::default() },
        Err(error) => panic!("{error}\n{world:#?}"),
    };
    let plan = renderer.plan();
    let views = &recorded.statistics().views;
    let passes = recorded.queues().iter().flat_map(|queue| &queue.passes).map(|(pass, _)| *pass);
    let shadows = views.iter().filter(|view| view.kind == ViewKind::Shadow);
    // The maps of one light differ behind a comma.
    let light_of = |view: &str| view.split(',').next().unwrap_or_default().to_owned();
    let targets = plan.targets().iter().map(|target| (target.views.name().to_owned(), target.name.clone()));
    let name_of = |process: usize| plan.processes()[process].name.clone();
    let mut frame = Frame {
        passes: passes.map(|pass| (light_of(&views[pass.view_index].name), name_of(pass.process_index))).collect(),
        targets: targets.collect(),
        shadow_views: shadows.map(|view| light_of(&view.name)).collect(),
        refused: None,
    };
    frame.sort();
    frame
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_frame_is_the_backward_reach_of_its_outputs(seed in any::<u64>()) {
        let mut random = Random::stream(seed);
        let pipeline = Pipeline::random(&mut random);
        let mut renderer = new_renderer(&pipeline);
        // The renderer keeps its plans from one world to the next.
        for _ in 0..3 {
            let world = World::random(&mut random);
            prop_assert_eq!(recorded(&mut renderer, &world), predict(&pipeline, &world), "{:#?}\n{:#?}", pipeline, world);
        }
    }
}

/// The random worlds reach and drop each of the processes: without this the comparison would prove little.
#[test]
fn random_frames_have_each_process_and_lack_it() {
    let mut random = Random::new();
    let (mut there, mut frames) = (std::collections::BTreeMap::<(String, String), usize>::new(), 0);
    for _ in 0..200 {
        let pipeline = Pipeline::random(&mut random);
        let world = World::random(&mut random);
        let mut passes = predict(&pipeline, &world).passes;
        let kind_of = |view: &str| if view.starts_with("shadow") { "shadow" } else { world.kind_of(view) };
        passes.iter_mut().for_each(|(view, _)| *view = kind_of(view).to_owned());
        passes.sort();
        passes.dedup();
        passes.into_iter().for_each(|pass| *there.entry(pass).or_default() += 1);
        frames += 1;
    }
    let lights = ["directional", "point", "spot", "hemispherical"];
    let lights = lights.into_iter().flat_map(|kind| [format!("{kind} lights"), format!("shadowed {kind} lights")]);
    let names: Vec<_> = lights.chain(["transparency", "own 0", "own 2"].map(str::to_owned)).collect();
    let expected = ["main", "reflection"].into_iter().flat_map(|kind| names.iter().map(move |name| (kind, &**name)));
    for (kind, name) in expected.chain([("shadow", "shadow casters"), ("reflection", "tone mapping")]) {
        let count = there.get(&(kind.to_owned(), name.to_owned())).copied().unwrap_or(0);
        assert!((frames / 40..frames - frames / 40).contains(&count), "{name} in {kind} views: {count} of {frames}");
    }
}
