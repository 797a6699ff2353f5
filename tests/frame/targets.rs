//! Sizes and histories of targets that no plan can have.

use std::borrow::Cow;
use std::sync::Arc;

use bytemuck::Pod;
use drawloom::backend::NullBackend;
use drawloom::command::Selection;
use drawloom::process::{
    BlendEquation, ClearColor, CommandDraws, Declare, Draws, Format, FullScreen, LightDraws, PlanError,
    ProceduralDraws, RenderProcess, StorageBuffer, TargetSize,
};
use drawloom::scene::{Blend, LightKind, Material, MaterialType, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::LightClass;
use drawloom::{BuildError, FrameError, Renderer};
use drawloom_testing::scenes::field;

use crate::declaring::Declaring;
use crate::reported;

fn clears(declare: &mut Declare, target: &str) {
    declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Background);
    declare.keep();
}

pub fn plan_error<const N: usize>(processes: [Declaring; N]) -> PlanError {
    let builder = Renderer::builder(NullBackend);
    let builder = processes.into_iter().fold(builder, |builder, process| builder.process(process));
    match builder.build(Arc::new(Scheduler::new(1).unwrap())).err() {
        Some(BuildError::Plan(error)) => error,
        other => panic!("no error of a plan, but {other:?}"),
    }
}

#[test]
fn sizes_that_no_target_can_have_are_named() {
    type Case = (fn(&mut Declare), &'static str);
    let cases: [Case; 6] = [
        (
            |declare| {
                clears(declare, "own");
                declare.size("own", TargetSize::Divided(2));
                declare.size("own", TargetSize::Divided(4));
            },
            "again",
        ),
        (|declare| declare.size("other", TargetSize::Divided(2)), "does not create"),
        (
            |declare| {
                declare.draws_over("other");
                declare.size("other", TargetSize::Divided(2));
            },
            "does not create",
        ),
        (
            |declare| {
                clears(declare, "own");
                declare.size("own", TargetSize::Divided(0));
            },
            "without pixels",
        ),
        (
            |declare| {
                clears(declare, "own");
                declare.size("own", TargetSize::Fixed([3, 0]));
            },
            "without pixels",
        ),
        (
            |declare| {
                declare.clears_depth_layer("layers", Format::Depth32Float);
                declare.size("layers", TargetSize::Divided(2));
            },
            "in layers",
        ),
    ];
    for (declare, expected) in cases {
        let sized = Declaring::new("sized", move |declaration| {
            declare(declaration);
            declaration.keep();
        });
        let other = Declaring::new("other", |declare| clears(declare, "other"));
        let error = plan_error([other, sized]);
        assert!(matches!(&error, PlanError::InvalidSize { process, .. } if process == "sized"), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn processes_that_disagree_about_a_size_are_refused() {
    let whole = Declaring::new("whole", |declare| clears(declare, "picture"));
    let half = Declaring::new("half", |declare| {
        clears(declare, "picture");
        declare.size("picture", TargetSize::Divided(2));
        declare.after("whole");
    });
    let error = plan_error([whole, half]);
    assert!(matches!(&error, PlanError::ConflictingSizes { target, .. } if target == "picture"), "{error}");
}

#[test]
fn targets_of_one_pass_have_one_size() {
    let error = plan_error([Declaring::new("mixed", |declare| {
        clears(declare, "picture");
        declare.clears_depth("depth", Format::Depth32Float);
        declare.size("depth", TargetSize::Divided(2));
    })]);
    let PlanError::UnequalSizes { process, targets } = &error else { panic!("{error}") };
    assert_eq!((process.as_str(), targets.each_ref().map(String::as_str)), ("mixed", ["picture", "depth"]));
}

#[test]
fn a_history_needs_a_target_of_the_same_views() {
    for target in ["unknown", "shadowed", "layers"] {
        let shadowed = Declaring::new("shadowed", |declare| {
            declare.views(ViewKind::Shadow);
            clears(declare, "shadowed");
        });
        let layers = Declaring::new("layers", |declare| {
            declare.clears_depth_layer("layers", Format::Depth32Float);
            declare.keep();
        });
        let reader = Declaring::new("reader", move |declare| {
            clears(declare, "picture");
            declare.samples_previous(target);
        });
        let error = plan_error([shadowed, layers, reader]);
        assert!(matches!(&error, PlanError::NoHistory { process, .. } if process == "reader"), "{error}");
    }
}

#[test]
fn a_process_whose_target_is_read_in_the_next_frame_is_not_dropped() {
    let writer = Declaring::new("writer", |declare| {
        declare.clears_color("written", Format::Rgba8Unorm, ClearColor::Background);
    });
    let reader = Declaring::new("reader", |declare| {
        declare.samples_previous("written");
        clears(declare, "picture");
    });
    let builder = Renderer::builder(NullBackend).process(writer).process(reader);
    let (renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    assert!(renderer.plan().dropped().is_empty());
    let targets: Vec<_> = renderer.plan().targets().iter().map(|target| target.name.as_str()).collect();
    assert_eq!(targets, ["written", "picture", "written of the frame before"]);
}

#[test]
fn a_process_that_draws_once_a_frame_draws_in_the_first_of_its_views() {
    let once = Declaring::new("once", |declare| {
        clears(declare, "shared");
        declare.once_a_frame();
    });
    let each = Declaring::new("each", |declare| clears(declare, "picture"));
    let builder = Renderer::builder(NullBackend).process(once).process(each);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let mut scene = field(5);
    for views in [2, 1] {
        scene.cameras.truncate(views);
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let submission = submitter.submit(recorded).unwrap().submission;
        let mut passes: Vec<_> = submission.passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
        passes.sort_unstable();
        let expected = [("each", 0), ("each", 1), ("once", 0)].into_iter().filter(|(_, view)| *view < views);
        assert_eq!(passes, expected.collect::<Vec<_>>());
    }
}

#[test]
fn a_process_that_draws_once_a_frame_comes_after_those_of_each_view_that_it_depends_on() {
    const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 4);
    const OTHERS: StorageBuffer<u32> = StorageBuffer::new("others", 4);
    let each = Declaring::new("each", |declare| {
        clears(declare, "picture");
        declare.changes_buffer(COUNTS);
    });
    let other = Declaring::new("other", |declare| {
        clears(declare, "other picture");
        declare.changes_buffer(OTHERS);
    });
    let once = Declaring::new("once", |declare| {
        clears(declare, "sum");
        declare.reads_buffer(COUNTS);
        declare.reads_buffer(OTHERS);
        declare.once_a_frame();
    });
    let builder = Renderer::builder(NullBackend).process(once).process(each).process(other);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let recorded = renderer.record(field(5).as_scene_ref()).unwrap();
    let submission = submitter.submit(recorded).unwrap().submission;
    let passes: Vec<_> = submission.passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    assert_eq!(passes, [("each", 0), ("each", 1), ("other", 0), ("other", 1), ("once", 0)]);
}

#[test]
fn targets_of_a_process_that_draws_once_a_frame_are_its_own() {
    let once = || {
        Declaring::new("once", |declare| {
            clears(declare, "shared");
            declare.once_a_frame();
        })
    };
    let reads: [fn(&mut Declare); 2] =
        [|declare| declare.samples("shared"), |declare| declare.samples_previous("shared")];
    for reads in reads {
        let reader = Declaring::new("reader", move |declare| {
            reads(declare);
            clears(declare, "picture");
        });
        let error = plan_error([once(), reader]);
        let PlanError::OnceAFrame { process, other, target } = &error else { panic!("{error}") };
        assert_eq!([process, other, target], ["once", "reader", "shared"]);
    }
    let second = Declaring::new("second", |declare| {
        declare.samples("shared");
        clears(declare, "picture");
        declare.once_a_frame();
    });
    let builder = Renderer::builder(NullBackend).process(once()).process(second);
    assert!(builder.build(Arc::new(Scheduler::new(1).unwrap())).is_ok(), "both draw in the same view");
}

#[test]
fn a_process_that_nothing_needs_is_warned_of() {
    let useless = Declaring::new("useless", |declare| {
        declare.clears_color("unused", Format::Rgba8Unorm, ClearColor::Background);
    });
    let picture = Declaring::new("useful", |declare| clears(declare, "picture"));
    let text = reported(|| {
        let builder = Renderer::builder(NullBackend).process(useless).process(picture);
        drop(builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap());
    });
    assert!(text.contains("WARN") && text.contains("useless") && !text.contains("useful"), "{text}");
}

#[test]
fn what_cannot_be_blended_is_named() {
    struct Sum(fn() -> Draws<'static>);
    impl RenderProcess for Sum {
        fn name(&self) -> &str {
            "sum"
        }
        fn declare(&self, declare: &mut Declare) {
            declare.clears_color("sum", Format::R32Float, ClearColor::Value([0.0; 4]));
            declare.keep();
        }
        fn draws(&self) -> Draws<'_> {
            (self.0)()
        }
    }
    let record = |draws| {
        let builder = Renderer::builder(NullBackend).process(Sum(draws));
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(field(3).as_scene_ref()).map(drop)
    };
    record(|| Draws::FullScreen(FullScreen::default())).unwrap();
    record(|| Draws::Procedural(ProceduralDraws::default())).unwrap();
    let blended: [fn() -> Draws<'static>; 3] = [
        || {
            let class = LightClass { kind: LightKind::Point, shadowed: false };
            Draws::Lights(LightDraws { shader: "", class, parameters: Cow::default(), resources: Vec::new() })
        },
        || Draws::FullScreen(FullScreen { blend: Blend::Additive, ..FullScreen::default() }),
        || Draws::Procedural(ProceduralDraws { blend: Blend::Alpha, ..ProceduralDraws::default() }),
    ];
    for draws in blended {
        let error = record(draws).unwrap_err();
        let is_named = matches!(
            &error,
            FrameError::Plan(PlanError::CannotBlend { process, target, format: Format::R32Float })
                if process == "sum" && target == "sum"
        );
        assert!(is_named, "{error}");
    }
}

#[test]
fn blend_equations_fit_the_targets() {
    struct Mixed(Format, Vec<BlendEquation>);
    impl RenderProcess for Mixed {
        fn name(&self) -> &str {
            "mixed"
        }
        fn declare(&self, declare: &mut Declare) {
            declare.clears_color("plain", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
            declare.clears_color("other", self.0, ClearColor::Value([0.0; 4]));
            declare.keep();
        }
        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws { blend_equations: self.1.clone(), ..CommandDraws::default() })
        }
    }
    let record = |format, equations| {
        let builder = Renderer::builder(NullBackend).process(Mixed(format, equations));
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(field(3).as_scene_ref()).map(drop)
    };
    let (add, replace) = (BlendEquation::ADDITIVE, BlendEquation::REPLACE);
    record(Format::R32Float, vec![add, replace]).unwrap();
    record(Format::Rgba16Float, vec![add, add]).unwrap();
    let error = record(Format::R32Float, vec![replace, add]).unwrap_err();
    let is_named = matches!(
        &error,
        FrameError::Plan(PlanError::CannotBlend { process, target, format: Format::R32Float })
            if process == "mixed" && target == "other"
    );
    assert!(is_named, "{error}");
    let error = record(Format::Rgba16Float, vec![add]).unwrap_err();
    assert_eq!(error.to_string(), "process \"mixed\" has 1 blend equations for 2 colour targets");
}

#[test]
fn materials_of_another_size_are_named() {
    struct Reading<const N: usize>(bool);
    impl<const N: usize> Reading<N>
    where
        [u32; N]: Pod,
    {
        const METAL: MaterialType<[u32; N]> = MaterialType::new("metal");
    }
    impl RenderProcess for Reading<4> {
        fn name(&self) -> &str {
            "four"
        }
        fn declare(&self, declare: &mut Declare) {
            declare.clears_color("four", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
            declare.keep();
            if self.0 {
                declare.reads_materials(Self::METAL);
            }
        }
        fn draws(&self) -> Draws<'_> {
            let selection = Selection::OPAQUE.of_material_type(Self::METAL);
            Draws::Commands(CommandDraws { selection, ..CommandDraws::default() })
        }
    }
    impl RenderProcess for Reading<2> {
        fn name(&self) -> &str {
            "two"
        }
        fn declare(&self, declare: &mut Declare) {
            declare.clears_color("two", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
            declare.keep();
            declare.reads_materials(Self::METAL);
        }
        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws::default())
        }
    }
    let build = |declares| {
        let builder = Renderer::builder(NullBackend).process(Reading::<4>(declares));
        builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
    };
    let mut scene = field(3);
    for declares in [true, false] {
        let mut renderer = build(declares);
        let values = Some(Reading::<4>::METAL.values([1; 4]));
        let fitting = scene.add(Material { values, ..Material::default() }).unwrap();
        renderer.record(scene.as_scene_ref()).map(drop).unwrap();
        let values = Some(Reading::<2>::METAL.values([1; 2]));
        let other = scene.add(Material { values, ..Material::default() }).unwrap();
        let error = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err().to_string();
        let expected =
            "process \"four\" knows the material type \"metal\" with 16 bytes for each material, but the scene has 8";
        assert_eq!(error, expected);
        scene.remove(other).unwrap();
        scene.remove(fitting).unwrap();
        renderer.record(scene.as_scene_ref()).map(drop).unwrap();
    }
    let builder = Renderer::builder(NullBackend).process(Reading::<4>(true)).process(Reading::<2>(true));
    let error = builder.build(Arc::new(Scheduler::new(1).unwrap())).map(drop).unwrap_err();
    let is_named = matches!(
        &error,
        BuildError::Plan(PlanError::ConflictingMaterialTypes { process, material_type: "metal", first: 16, second: 8 })
            if process == "two"
    );
    assert!(is_named, "{error}");
}
