//! Processes that no output depends on, one case each.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::{ClearColor, Declare, Deferred, Format, InjectionPoint};
use drawloom::scene::{Camera, Scene, ViewKind};
use drawloom::task::Scheduler;

use crate::declaring::Declaring;

fn clears(declare: &mut Declare, target: &str) {
    declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
}

/// The processes and targets of a frame with a main camera and a mirror.
fn planned(own: Vec<Declaring>) -> (Vec<String>, Vec<String>) {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let builder = own.into_iter().fold(builder, |builder, own| builder.process(own));
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let mut scene = Scene::new();
    let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    let mirror = Camera { kind: ViewKind::Reflection, name: main.child_name("mirror"), ..main.clone() };
    scene.cameras = vec![main, mirror];
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let plan = renderer.plan();
    let named = |views: ViewKind, name: &String| match views {
        ViewKind::Main => name.clone(),
        _ => format!("{name} in {} views", views.name()),
    };
    let processes = plan.processes().iter().map(|planned| named(planned.declaration.views, &planned.name)).collect();
    (processes, plan.targets().iter().map(|target| named(target.views, &target.name)).collect())
}

fn mirror() -> Declaring {
    Declaring::new("mirror", |declare| {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, "mirror", "radiance");
        declare.draws_over("radiance");
    })
}

const WITH_MIRROR: [&str; 4] = ["geometry buffer in reflection views", "geometry buffer", "mirror", "tone mapping"];

#[test]
fn what_a_dropped_process_reads_of_the_frame_before_is_dropped_too() {
    let sum = |declare: &mut Declare| clears(declare, "sum");
    let filter = |declare: &mut Declare| {
        clears(declare, "filtered");
        declare.samples_previous("sum");
        declare.samples_previous("filtered");
    };
    let (processes, targets) = planned(vec![mirror(), Declaring::new("sum", sum), Declaring::new("filter", filter)]);
    assert_eq!(processes, WITH_MIRROR);
    assert!(!targets.iter().any(|target| target.contains("sum") || target.contains("filtered")), "{targets:?}");
    // It is there with the process.
    let kept = |declare: &mut Declare| {
        clears(declare, "filtered");
        declare.samples_previous("sum");
        declare.keep();
    };
    let (processes, targets) = planned(vec![mirror(), Declaring::new("sum", sum), Declaring::new("filter", kept)]);
    assert!(processes.contains(&"sum".to_owned()), "{processes:?}");
    assert!(targets.contains(&"sum of the frame before".to_owned()), "{targets:?}");
}

#[test]
fn a_dropped_process_needs_no_empty_shadow_map() {
    let fog = |declare: &mut Declare| {
        clears(declare, "fog");
        declare.samples_layers(ViewKind::Shadow, "shadow map");
    };
    let (processes, targets) = planned(vec![mirror(), Declaring::new("fog", fog)]);
    assert_eq!(processes, WITH_MIRROR);
    assert!(!targets.contains(&"shadow map in shadow views".to_owned()), "{targets:?}");
}

/// An order between the kinds of views would be a circle with the mirror's.
#[test]
fn a_place_orders_processes_in_views_of_one_kind_alone() {
    let main = |declare: &mut Declare| {
        declare.at(InjectionPoint::AfterGeometry);
        declare.draws_over("radiance");
    };
    let in_mirrors = |declare: &mut Declare| {
        declare.views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over("radiance");
    };
    let (processes, _) =
        planned(vec![mirror(), Declaring::new("main fog", main), Declaring::new("mirrored fog", in_mirrors)]);
    let expected = [
        "geometry buffer in reflection views",
        "mirrored fog in reflection views",
        "geometry buffer",
        "main fog",
        "mirror",
        "tone mapping",
    ];
    assert_eq!(processes, expected);
}
