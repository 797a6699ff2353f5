//! Targets with mip levels: which can have some, and frames of them without a device.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::process::{ClearColor, Declare, Format, PlanError};
use drawloom::scene::{Camera, ViewKind};
use drawloom::task::Scheduler;
use drawloom_testing::mip_levels::{atlas_scene, with_mip_levels};

use crate::declaring::Declaring;
use crate::targets::plan_error;

fn clears(declare: &mut Declare, target: &str, format: Format) {
    declare.clears_color(target, format, ClearColor::Background);
    declare.keep();
}

/// The process that is refused, its target, and why.
fn refused<const N: usize>(processes: [Declaring; N]) -> (String, String, String) {
    match plan_error(processes) {
        PlanError::MipLevels { process, target, problem } => (process, target, problem.into_owned()),
        other => panic!("another error: {other}"),
    }
}

#[test]
fn targets_that_cannot_have_mip_levels_are_named() {
    type Case = (fn(&mut Declare), &'static str);
    let cases: [Case; 7] = [
        (|declare| clears(declare, "other", Format::Rgba8Unorm), "does not create"),
        (
            |declare| {
                declare.views(ViewKind::Shadow);
                declare.clears_depth_layer("own", Format::Depth32Float);
            },
            "in layers",
        ),
        (
            |declare| {
                clears(declare, "own", Format::Rgba8Unorm);
                declare.multisampled("own");
            },
            "multisampled",
        ),
        (|declare| declare.clears_depth("own", Format::Depth32Float), "depth or a stencil"),
        (|declare| clears(declare, "own", Format::R32Uint), "whole numbers"),
        (|declare| clears(declare, "own", Format::R32Float), "filters"),
        (|declare| clears(declare, "own", Format::Rgba32Float), "filters"),
    ];
    for (index, (declare, expected)) in cases.into_iter().enumerate() {
        let process = Declaring::new("process", move |target| {
            declare(target);
            target.mipmapped("own");
            target.keep();
        });
        let (process, target, problem) = refused([process]);
        assert!(process == "process" && target == "own" && problem.contains(expected), "case {index}: {problem}");
    }
}

#[test]
fn only_the_process_that_creates_a_target_gives_it_mip_levels() {
    let uses: [fn(&mut Declare); 2] = [|declare| declare.samples("own"), |declare| declare.draws_over("own")];
    for uses in uses {
        let creator = Declaring::new("creator", |declare| clears(declare, "own", Format::Rgba8Unorm));
        let user = Declaring::new("user", move |declare| {
            uses(declare);
            declare.mipmapped("own");
            declare.keep();
        });
        assert_eq!(
            refused([creator, user]),
            ("user".to_owned(), "own".to_owned(), "it does not create it, only: none".to_owned())
        );
    }
}

#[test]
fn processes_that_disagree_about_mip_levels_are_named() {
    let creates = |name: &'static str, is_mipmapped: bool| {
        Declaring::new(name, move |declare| {
            clears(declare, "own", Format::Rgba8Unorm);
            if is_mipmapped {
                declare.mipmapped("own");
            }
            if name == "two" {
                declare.after("one");
            }
        })
    };
    let (process, target, problem) = refused([creates("one", true), creates("two", false)]);
    assert_eq!(
        (process.as_str(), target.as_str(), problem.as_str()),
        ("two", "own", "another process creates it with them")
    );
    let (process, target, problem) = refused([creates("one", false), creates("two", true)]);
    assert_eq!(
        (process.as_str(), target.as_str(), problem.as_str()),
        ("two", "own", "another process creates it without them")
    );
}

#[test]
fn the_null_backend_draws_frames_with_mip_levels() {
    let builder = with_mip_levels(Renderer::builder(NullBackend));
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let submitted = submitter.submit(renderer.record(atlas_scene().as_scene_ref()).unwrap()).unwrap();
    let mut processes: Vec<_> = submitted.submission.passes.into_iter().map(|pass| pass.process).collect();
    processes.truncate(4);
    assert_eq!(processes, ["pyramid", "levels", "overlay", "late levels"]);
    let mut scene = atlas_scene();
    let mirror = Camera { kind: ViewKind::Reflection, ..scene.cameras[0].clone() };
    scene.cameras.push(Camera { name: "mirror".into(), ..mirror });
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let mipmapped = renderer.plan().targets().iter().filter(|target| target.mipmapped);
    let names: Vec<_> = mipmapped.map(|target| (target.name.as_str(), target.views)).collect();
    assert!(names.contains(&("pyramid", ViewKind::Main)) && names.contains(&("pyramid", ViewKind::Reflection)));
    assert!(names.contains(&("pyramid of the frame before", ViewKind::Main)), "{names:?}");
}
