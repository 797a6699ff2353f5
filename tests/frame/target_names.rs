//! A target that no process writes is an error of `build`, whatever names it, and lists the targets that there are.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::process::{
    ClearColor, Declare, Deferred, Format, FramePlan, PlanError, RenderProcess, Target, TargetSize, targets,
};
use drawloom::scene::ViewKind;
use drawloom::task::Scheduler;
use drawloom::{BuildError, Renderer, RendererBuilder};

use crate::declaring::Declaring;

const OWN: Target = Target::new("own");
const MISSPELT: Target = Target::new("radience");

fn error_of(add: impl FnOnce(RendererBuilder<NullBackend>) -> RendererBuilder<NullBackend>) -> PlanError {
    let builder = add(Renderer::builder(NullBackend).pipeline(Deferred::to_picture()));
    match builder.build(Arc::new(Scheduler::new(1).unwrap())).err() {
        Some(BuildError::Plan(error)) => error,
        other => panic!("no error of a plan, but {other:?}"),
    }
}

fn clears_own(declare: &mut Declare) {
    declare.clears_color(OWN, Format::Rgba8Unorm, ClearColor::Background);
}

#[test]
fn what_a_process_names_and_nobody_writes_is_an_error_of_build_whether_the_process_is_needed_or_not() {
    let reflection = ViewKind::Reflection;
    // Each with a target that the error lists.
    type Case = (fn(&mut Declare), &'static str);
    let cases: [Case; 21] = [
        (|declare| declare.samples(MISSPELT), "radiance"),
        (|declare| declare.draws_over(MISSPELT), "radiance"),
        (|declare| declare.draws_depth(MISSPELT), "depth"),
        (|declare| declare.tests_depth(MISSPELT), "depth"),
        (|declare| declare.matches_depth(MISSPELT), "depth"),
        (|declare| declare.marks_stencil(MISSPELT), "depth"),
        (|declare| declare.tests_stencil(MISSPELT), "depth"),
        (|declare| declare.reads(MISSPELT), "picture"),
        (|declare| declare.changes(MISSPELT), "picture"),
        (|declare| declare.samples_previous(MISSPELT), "radiance"),
        (|declare| declare.samples_layers(ViewKind::Shadow, MISSPELT), "shadow map"),
        (|declare| declare.samples_view(ViewKind::Reflection, "mirror", MISSPELT), "radiance"),
        (|declare| declare.samples_view_layers(ViewKind::Reflection, "mirror", MISSPELT, 2), "radiance"),
        (|declare| declare.samples_view_cube(ViewKind::Reflection, "mirror", MISSPELT), "radiance"),
        (|declare| declare.samples_view_previous(ViewKind::Reflection, "mirror", MISSPELT), "radiance"),
        (|declare| declare.size(MISSPELT, TargetSize::Divided(2)), "own"),
        (|declare| declare.multisampled(MISSPELT), "own"),
        (|declare| declare.mipmapped(MISSPELT), "own"),
        (|declare| declare.resolves(MISSPELT, "resolved", Format::Rgba8Unorm), "own"),
        (|declare| declare.samples(String::from("radience")), "radiance"),
        (|declare| declare.samples("radience"), "radiance"),
    ];
    for (index, (declare, known)) in cases.into_iter().enumerate() {
        for views in [ViewKind::Main, reflection] {
            for keeps in [true, false] {
                let misspelt = Declaring::new("misspelt", move |declaration| {
                    declaration.views(views);
                    clears_own(declaration);
                    declare(declaration);
                    if keeps {
                        declaration.keep();
                    }
                });
                let error = error_of(|builder| builder.process(misspelt)).to_string();
                let is_named = error.contains("\"misspelt\"") && error.contains("radience");
                // Nothing else samples what reflections draw, so they may have no target but this one.
                let is_listed = [known, "own"].iter().any(|known| error.contains(&format!("{known}\"")));
                let is_listed = is_listed && (views == reflection || error.contains(&format!("{known}\"")));
                assert!(is_named && is_listed, "case {index} in {views:?} views, kept: {keeps}: {error}");
            }
        }
    }
}

#[test]
fn an_output_that_nobody_writes_is_an_error_of_build() {
    let error = error_of(|builder| builder.output("pictur"));
    let is_listed = matches!(&error, PlanError::UnknownOutput { target, known } if target == "pictur" && known.contains("\"picture\""));
    assert!(is_listed, "{error}");
}

#[test]
fn the_only_process_is_told_of_its_misspelt_target_and_not_only_that_nothing_needs_it() {
    let misspelt: Arc<dyn RenderProcess> = Arc::new(Declaring::new("misspelt", |declare| declare.draws_over(MISSPELT)));
    let error = FramePlan::new(vec![misspelt], &[]).err();
    let (target, processes, known) = ("radience".to_owned(), "\"misspelt\"".to_owned(), "none".to_owned());
    assert_eq!(error, Some(PlanError::UnknownTarget { target, processes, known }));
}

#[test]
fn a_replacement_that_nothing_needs_is_told_of_its_misspelt_target_too() {
    for name in ["transparency", "of the engine's"] {
        let build = |target: Target| {
            let replacement = Declaring::new(name, move |declare| {
                clears_own(declare);
                declare.samples(target);
            });
            // Reflections lack it. Nothing depends on what the replacement would draw there.
            let extra = Declaring::new("extra", |declare| {
                declare.clears_color("extra", Format::Rgba8Unorm, ClearColor::Background);
            });
            let pipeline = Deferred::to_picture().replace("transparency", replacement);
            let builder = Renderer::builder(NullBackend).pipeline(pipeline).process(extra);
            builder.build(Arc::new(Scheduler::new(1).unwrap())).map(drop)
        };
        let error = build(MISSPELT).unwrap_err().to_string();
        assert!(error.contains(&format!("{name:?}")) && error.contains("radience"), "{error}");
        build(targets::RADIANCE).unwrap();
        build(Target::new("extra")).unwrap();
    }
}

#[test]
fn a_process_that_nothing_needs_may_name_whatever_some_frames_write() {
    for declare in [
        (|declare| declare.samples(targets::RADIANCE)) as fn(&mut Declare),
        |declare| declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP),
        |declare| declare.samples_view(ViewKind::Reflection, "mirror", targets::PICTURE),
        |declare| declare.samples_view_previous(ViewKind::Reflection, "mirror", targets::PICTURE),
        |declare| declare.samples_previous(OWN),
    ] {
        let unneeded = Declaring::new("unneeded", move |declaration| {
            clears_own(declaration);
            declare(declaration);
        });
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(unneeded);
        let (renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        assert_eq!(renderer.plan().dropped(), ["unneeded"]);
    }
}

#[cfg(feature = "wgpu")]
#[test]
fn what_is_read_back_and_is_not_there_is_an_error_that_lists_what_is() {
    use drawloom::backend::{BackendError, WgpuBackend};
    use drawloom_testing::adapter;
    use drawloom_testing::scenes::field;

    let (device, queue) = adapter::noop_device().unwrap();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let scene = field(5);
    let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let mut errors = vec![
        recorded.read_back(0, MISSPELT, [0, 0], [1, 1]).err(),
        recorded.read_back_whole(0, MISSPELT).err(),
        recorded.read_back_whole(9, targets::PICTURE).err(),
    ];
    recorded.read_back(0, targets::PICTURE, [0, 0], [1, 1]).unwrap();
    let submission = submitter.submit(recorded).unwrap().submission;
    errors.extend([submission.texture(0, MISSPELT).err(), submission.read(0, MISSPELT).err()]);
    assert!(submission.texture(0, targets::PICTURE).is_ok() && submission.texture(0, "picture").is_ok());
    for (index, error) in errors.into_iter().enumerate() {
        let Some(BackendError::UnknownTarget { known, .. }) = &error else { panic!("{index}: {error:?}") };
        // There are two views.
        assert_eq!(known.contains("\"radiance\"") && known.contains("\"picture\""), index != 2, "{index}: {known}");
    }
}
