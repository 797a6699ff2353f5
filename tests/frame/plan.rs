//! Plans: what processes may share, and the order of processes and of the kinds of views.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FramePlan, FullScreen, PlanError, RenderProcess, StorageBuffer,
};
use drawloom::scene::{Camera, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, RendererBuilder};

use crate::declaring::Declaring;
use crate::targets::plan_error;

fn clears(declare: &mut Declare, target: &str) {
    declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Background);
}

fn build(builder: RendererBuilder<NullBackend>) -> Renderer<NullBackend> {
    builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
}

fn builder(processes: impl IntoIterator<Item = Declaring>) -> RendererBuilder<NullBackend> {
    processes.into_iter().fold(Renderer::builder(NullBackend), |builder, process| builder.process(process))
}

/// A scene with a camera of each of these names and kinds.
fn views<const N: usize>(views: [(&str, ViewKind); N]) -> Scene {
    let mut scene = Scene::new();
    scene.cameras =
        views.map(|(name, kind)| Camera { kind, ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO) }).to_vec();
    scene
}

/// The processes in the order in which a plan has them, each with its kind of views.
fn planned(renderer: &Renderer<NullBackend>) -> Vec<(&str, ViewKind)> {
    renderer.plan().processes().iter().map(|planned| (planned.name.as_str(), planned.declaration.views)).collect()
}

/// The kinds of views of each group of a plan.
fn view_groups(renderer: &Renderer<NullBackend>) -> Vec<&[ViewKind]> {
    renderer.plan().view_groups().iter().map(|group| group.kinds.as_slice()).collect()
}

/// The renderer after a frame with a main view and a reflection: it has a plan for these.
fn with_mirror(mut renderer: Renderer<NullBackend>) -> Renderer<NullBackend> {
    let scene = views([("main", ViewKind::Main), ("mirror", ViewKind::Reflection)]);
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    renderer
}

#[test]
fn a_replacement_stays_in_a_pipeline_that_keeps_it_even_if_it_keeps_itself() {
    for keeps_itself in [false, true] {
        let glass = Declaring::new("glass", move |declare| {
            clears(declare, "glass");
            if keeps_itself {
                declare.keep();
            }
        });
        let deferred = Deferred::to_picture().keep("transparency").replace("transparency", glass);
        let renderer = build(Renderer::builder(NullBackend).pipeline(deferred));
        assert!(planned(&renderer).contains(&("glass", ViewKind::Main)), "{keeps_itself}");
    }
}

#[test]
fn an_order_between_views_of_two_kinds_is_one_between_these_views() {
    // Reflections go first where nothing orders them.
    for is_ordered in [false, true] {
        let early = Declaring::new("early", move |declare| {
            clears(declare, "early");
            if is_ordered {
                declare.before("mirror");
            }
            declare.keep();
        });
        let mirror = Declaring::new("mirror", |declare| {
            declare.views(ViewKind::Reflection);
            clears(declare, "mirror");
            declare.keep();
        });
        // Draws in both.
        let everywhere = Declaring::new("everywhere", |declare| {
            declare.also_views(ViewKind::Reflection);
            clears(declare, "everywhere");
            declare.keep();
        });
        let renderer = with_mirror(build(builder([early, mirror, everywhere])));
        let groups: &[&[ViewKind]] = if is_ordered {
            &[&[ViewKind::Main], &[ViewKind::Reflection]]
        } else {
            &[&[ViewKind::Reflection], &[ViewKind::Main]]
        };
        assert_eq!(view_groups(&renderer), groups);
    }
}

#[test]
fn an_order_through_an_absent_process_holds_within_each_kind_of_views() {
    let around = |name, declares: fn(&mut Declare)| {
        Declaring::new(name, move |declare: &mut Declare| {
            declare.also_views(ViewKind::Reflection);
            declare.draws_over("radiance");
            declares(declare);
            declare.keep();
        })
    };
    let rain = around("rain", |declare| declare.after("transparency"));
    let fog = around("fog", |declare| {
        declare.before("transparency");
        declare.after("shadowed hemispherical lights");
    });
    let builder = builder([rain, fog]).pipeline(Deferred::to_picture());
    let mut renderer = build(builder);
    let scene = views([("main", ViewKind::Main), ("mirror", ViewKind::Reflection)]);
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let in_views = |kind| planned(&renderer).into_iter().filter(move |(_, views)| *views == kind);
    for kind in [ViewKind::Reflection, ViewKind::Main] {
        let names: Vec<_> =
            in_views(kind).map(|(name, _)| name).filter(|name| ["fog", "rain"].contains(name)).collect();
        assert_eq!(names, ["fog", "rain"], "{kind:?}");
    }
    assert_eq!(view_groups(&renderer), [&[ViewKind::Reflection][..], &[ViewKind::Main]]);
}

#[test]
fn a_view_that_samples_one_that_depends_on_it_is_an_error() {
    let caster = Declaring::new("caster", |declare| {
        declare.views(ViewKind::Shadow);
        declare.samples_view(ViewKind::Main, "main", "picture");
        declare.clears_depth_layer("maps", Format::Depth32Float);
    });
    let lit = Declaring::new("lit", |declare| {
        declare.samples_layers(ViewKind::Shadow, "maps");
        clears(declare, "picture");
    });
    let mut renderer = build(builder([caster, lit]).output("picture"));
    let scene = views([("main", ViewKind::Main), ("map", ViewKind::Shadow)]);
    let error = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err();
    assert!(matches!(error, FrameError::CircularViews(_)), "{error}");
    let text = error.to_string();
    assert!(text.contains(r#"view 0 \"main\""#) && !text.contains("process by process"), "{text}");
}

#[test]
fn views_that_are_submitted_process_by_process_are_named_together_in_errors() {
    let first = Declaring::new("first", |declare| declare.clears_depth_layer("first", Format::Depth32Float));
    let second = Declaring::new("second", |declare| {
        // Reads the layers of all main views, so these are submitted process by process.
        declare.samples_layers(ViewKind::Main, "first");
        declare.samples_view(ViewKind::Main, "side", "second");
        clears(declare, "second");
    });
    let mut renderer = build(builder([first, second]).output("second"));
    let scene = views([("main", ViewKind::Main), ("side", ViewKind::Main)]);
    let error = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err().to_string();
    assert!(error.contains(r#"view 0 \"main\" and view 1 \"side\", process by process"#), "{error}");
}

/// A process whose destructor panics.
struct PanickingDrop;

impl Drop for PanickingDrop {
    fn drop(&mut self) {
        panic!("the process is dropped");
    }
}

impl RenderProcess for PanickingDrop {
    fn name(&self) -> &str {
        "panicking"
    }

    fn declare(&self, declare: &mut Declare) {
        clears(declare, "own");
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

#[test]
fn a_plan_contains_the_panics_of_its_processes_destructors() {
    let plan = FramePlan::new(vec![Arc::new(PanickingDrop)], &[]).unwrap();
    assert_eq!(plan.processes().len(), 1);
    drop(plan);
}

#[test]
fn raw_passes_write_targets_that_can_be_stored() {
    let renderer = build(builder([
        Declaring::new("first", |declare| {
            declare.writes("stored", Format::Rgba8Unorm);
            // No device stores it, so the raw pass draws into it.
            declare.writes("drawn", Format::Rgba8Srgb);
            clears(declare, "picture");
            declare.keep();
        }),
        Declaring::new("second", |declare| {
            declare.changes("stored");
            declare.changes("drawn");
            declare.keep();
        }),
    ]));
    let targets: Vec<_> = renderer.plan().targets().iter().map(|found| (found.name.as_str(), found.stored)).collect();
    assert_eq!(targets, [("stored", true), ("drawn", false), ("picture", false)]);
}

#[test]
fn a_target_is_an_output_where_processes_declare_to_draw_it() {
    let both = Declaring::new("both", |declare| {
        declare.also_views(ViewKind::Reflection);
        clears(declare, "picture");
        clears(declare, "other");
        declare.samples_view(ViewKind::Reflection, "mirror", "picture");
        declare.samples_view(ViewKind::Reflection, "mirror", "other");
    });
    let renderer = build(builder([both]).output("picture"));
    let outputs = renderer.plan().targets().iter().filter(|target| target.output);
    let outputs: Vec<_> = outputs.map(|target| (target.name.as_str(), target.views)).collect();
    assert_eq!(outputs, [("picture", ViewKind::Main)]);
}

#[test]
fn a_target_that_only_other_views_have_is_an_output_there() {
    let mirror = Declaring::new("mirror", |declare| {
        declare.views(ViewKind::Reflection);
        clears(declare, "mirror");
    });
    let picture = Declaring::new("picture", |declare| {
        clears(declare, "picture");
        declare.keep();
    });
    let renderer = with_mirror(build(builder([mirror, picture]).output("mirror")));
    let outputs = renderer.plan().targets().iter().map(|target| (target.name.as_str(), target.output));
    assert_eq!(outputs.collect::<Vec<_>>(), [("mirror", true), ("picture", false)]);
}

#[test]
fn a_process_may_draw_in_views_of_three_kinds() {
    let everywhere = Declaring::new("everywhere", |declare| {
        declare.also_views(ViewKind::Reflection);
        declare.also_views(ViewKind::Post);
        clears(declare, "own");
        declare.keep();
    });
    let renderer = with_mirror(build(builder([everywhere])));
    let kinds: Vec<_> = planned(&renderer).into_iter().map(|(_, kind)| kind).collect();
    assert_eq!(kinds, [ViewKind::Reflection, ViewKind::Main, ViewKind::Post]);
}

#[test]
fn depth_and_colour_are_not_used_as_each_other() {
    let depth = || Declaring::new("first", |declare| declare.clears_depth("own", Format::Depth32Float));
    let colour = || Declaring::new("first", |declare| clears(declare, "own"));
    let second = |uses: fn(&mut Declare)| {
        Declaring::new("second", move |declare| {
            uses(declare);
            declare.keep();
        })
    };
    let errors = [
        plan_error([depth(), second(|declare| declare.draws_over("own"))]),
        plan_error([colour(), second(|declare| declare.draws_depth("own"))]),
        plan_error([colour(), second(|declare| declare.tests_depth("own"))]),
        plan_error([depth(), second(|declare| declare.tests_stencil("own"))]),
    ];
    for error in errors {
        let is_named =
            matches!(&error, PlanError::WrongFormat { process, target, .. } if process == "second" && target == "own");
        assert!(is_named, "{error}");
    }
}

#[test]
fn processes_that_disagree_about_layers_or_samples_are_refused() {
    let first = || {
        Declaring::new("first", |declare| {
            declare.clears_depth("own", Format::Depth32Float);
            declare.keep();
        })
    };
    let second = |differs: fn(&mut Declare)| {
        Declaring::new("second", move |declare| {
            declare.after("first");
            differs(declare);
            declare.keep();
        })
    };
    let error = plan_error([first(), second(|declare| declare.clears_depth_layer("own", Format::Depth32Float))]);
    let expected = PlanError::LayeringMismatch { process: "second".to_owned(), target: "own".to_owned() };
    assert_eq!(error, expected);
    let error = plan_error([
        first(),
        second(|declare| {
            declare.clears_depth("own", Format::Depth32Float);
            declare.multisampled("own");
        }),
    ]);
    let problem = "another process creates it with another number of samples";
    let (process, target) = ("second".to_owned(), "own".to_owned());
    assert_eq!(error, PlanError::Multisampling { process, target, problem: problem.into() });
}

#[test]
fn the_format_of_a_multisampled_target_is_its_own() {
    let process = |multisampled: &'static str| {
        Declaring::new("own", move |declare| {
            declare.clears_color("numbers", Format::R32Uint, ClearColor::Value([0.0; 4]));
            clears(declare, "colour");
            declare.multisampled(multisampled);
            declare.keep();
        })
    };
    // The two differ in their number of samples, which is looked at last.
    assert!(matches!(plan_error([process("colour")]), PlanError::UnequalSamples { .. }));
    assert!(matches!(plan_error([process("numbers")]), PlanError::Multisampling { .. }));
}

#[test]
fn what_cannot_be_a_layer_of_an_array_may_be_sampled_alone() {
    fn views(declares: fn(&mut Declare)) -> Declaring {
        Declaring::new("views", move |declare| {
            declare.views(ViewKind::Reflection);
            declares(declare);
        })
    }
    let multisampled = || {
        views(|declare| {
            clears(declare, "own");
            declare.multisampled("own");
        })
    };
    let raw = || views(|declare| declare.writes("own", Format::Rgba8Unorm));
    let layered = || views(|declare| declare.clears_depth_layer("own", Format::Depth32Float));
    let reader = |samples: fn(&mut Declare)| {
        Declaring::new("reader", move |declare| {
            samples(declare);
            clears(declare, "picture");
            declare.keep();
        })
    };
    let alone = || reader(|declare| declare.samples_view(ViewKind::Reflection, "mirror", "own"));
    let layers = || reader(|declare| declare.samples_view_layers(ViewKind::Reflection, "mirror", "own", 2));
    type Views = fn() -> Declaring;
    let cases: [(Views, &str); 3] = [
        (multisampled, "it is multisampled"),
        (raw, "a raw pass uses it as a texture of its own"),
        (layered, "it is a layer of an array already"),
    ];
    for (views, expected) in cases {
        build(builder([views(), alone()]));
        let error = plan_error([views(), layers()]);
        assert!(matches!(error, PlanError::SampledLayers { problem, .. } if problem == expected), "{error}");
    }
}

#[test]
fn the_graph_of_processes_is_labelled_with_what_they_pass_on() {
    const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 16);
    const OTHER: StorageBuffer<u32> = StorageBuffer::new("other", 16);
    let write = Declaring::new("write", |declare| {
        clears(declare, "read");
        clears(declare, "unread");
        declare.changes_buffer(COUNTS);
        declare.changes_buffer(OTHER);
    });
    let other = Declaring::new("other", |declare| clears(declare, "other"));
    let read = Declaring::new("read", |declare| {
        declare.after("write");
        declare.samples("read");
        declare.samples("other");
        clears(declare, "unread");
        declare.reads_buffer(COUNTS);
        clears(declare, "picture");
        declare.keep();
    });
    let renderer = build(builder([write, other, read]));
    let dot = renderer.plan().to_dot();
    for label in [r#"[label="counts, read"]"#, r#"[label="other"]"#] {
        assert!(dot.contains(label), "{dot}");
    }
}

#[test]
fn views_that_read_the_layers_of_all_views_of_their_kind_are_submitted_process_by_process() {
    let layers = Declaring::new("layers", |declare| declare.clears_depth_layer("layers", Format::Depth32Float));
    let reader = |name| {
        Declaring::new(name, move |declare| {
            declare.samples_layers(ViewKind::Main, "layers");
            clears(declare, name);
            declare.keep();
        })
    };
    let builder = builder([layers, reader("first"), reader("second")]);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let scene = views([("main", ViewKind::Main), ("side", ViewKind::Main)]);
    let submission = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap().submission;
    let passes: Vec<_> = submission.passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    assert_eq!(passes, [("layers", 0), ("layers", 1), ("first", 0), ("first", 1), ("second", 0), ("second", 1)]);
}
