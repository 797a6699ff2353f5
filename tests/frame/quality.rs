//! The effect of a quality on a frame's commands.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::command::DrawList;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{DepthCurve, DepthPrecision, Quality, ShadowQuality};
use drawloom::scene::{Blend, Light, Scene};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::field;

/// The draw list of a process in a view of a frame of this quality.
fn drawn(scene: &Scene, quality: Quality, process: &str, view: usize) -> DrawList {
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, _) = builder.build(scheduler).unwrap();
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    renderer.draw_list(process, view).unwrap().clone()
}

/// The depth of each object along the first camera's axis, in draw order.
fn depths(scene: &Scene, list: &DrawList) -> Vec<f32> {
    let camera = &scene.cameras[0];
    let forward = camera.orientation.as_dquat().normalize() * DVec3::NEG_Z;
    let position = |object: &u32| scene.as_scene_ref().positions[*object as usize];
    // Rounded to f32, like keys.
    list.objects.iter().map(|object| forward.dot(position(object) - camera.position) as f32).collect()
}

#[test]
fn keys_have_the_configured_number_of_depth_bits() {
    let scene = field(2_000);
    for bits in [6, 12] {
        for curve in [DepthCurve::Logarithmic, DepthCurve::Linear { far: 80.0 }] {
            let order = DepthPrecision { bits, curve };
            let quality = Quality { opaque_order: order, blended_order: order, ..Quality::balanced() };
            for (process, lowest) in [("geometry buffer", 20 - bits), ("transparency", 62 - bits)] {
                let list = drawn(&scene, quality, process, 0);
                let keys: Vec<_> = list.commands().map(|command| command.key.bits()).collect();
                let differing = keys.iter().fold(0, |differing, key| differing | (key ^ keys[0]));
                let width = if process == "transparency" { 62 } else { 20 };
                let depth_bits = differing & ((1 << width) - 1);
                assert!(
                    depth_bits != 0 && depth_bits.trailing_zeros() >= lowest,
                    "{process}: {order:?} {depth_bits:x}"
                );
            }
        }
    }
}

#[test]
fn blended_objects_are_out_of_order_by_at_most_one_step() {
    let scene = field(3_000);
    let (near, far) = (scene.cameras[0].near, scene.cameras[0].far);
    let mut orders = vec![DepthPrecision::EXACT];
    for bits in [4, 9, 18] {
        orders.extend(
            [DepthCurve::Logarithmic, DepthCurve::Linear { far: 80.0 }].map(|curve| DepthPrecision { bits, curve }),
        );
    }
    for blended_order in orders {
        let quality = Quality { blended_order, ..Quality::balanced() };
        let list = drawn(&scene, quality, "transparency", 0);
        assert!(list.commands().all(|command| command.state.blend() != Blend::None));
        let mut depths = depths(&scene, &list);
        if blended_order == DepthPrecision::EXACT {
            assert!(depths.is_sorted_by(|one, next| one >= next));
        }
        depths.retain(|&depth| (near..=far).contains(&depth));
        assert!(depths.len() > 300);
        let mut nearest = f32::INFINITY;
        for &depth in &depths {
            let behind = f64::from(depth) - f64::from(nearest);
            assert!(behind <= blended_order.step(depth, near, far), "{nearest} {depth} {blended_order:?}");
            nearest = nearest.min(depth);
        }
    }
}

#[test]
fn half_the_angle_raises_the_subdivision_level_by_one() {
    let mut scene = field(300);
    scene.lights = vec![Light::Hemispherical {
        position: DVec3::new(0.0, 30.0, 0.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(100.0),
        range: 100.0,
        casts_shadow: true,
    }];
    let level = |widest_edge: f32| {
        let shadows = ShadowQuality { widest_edge, ..ShadowQuality::default() };
        let list = drawn(&scene, Quality { shadows, ..Quality::balanced() }, "shadow casters", 2);
        let mut levels: Vec<_> =
            list.commands().map(|command| (command.object, command.state.subdivision_level())).collect();
        levels.sort();
        levels
    };
    // No edge subtends this angle.
    assert!(level(90.0).iter().all(|(_, level)| *level == 0));
    let fine = level(0.5);
    assert!(fine.len() > 100 && fine.iter().any(|(_, level)| *level > 1));
    for ((object, fine), (other, coarse)) in fine.into_iter().zip(level(1.0)) {
        assert_eq!((object, fine.saturating_sub(1)), (other, coarse));
    }
}

#[test]
fn a_renderer_has_the_quality_that_was_set_and_says_whether_its_pipeline_has_it_too() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(scheduler).unwrap();
    assert!(!renderer.pipeline_has_quality());
    let quality = Quality { depth_pre_pass: true, ..Quality::fast() };
    renderer.set_quality(quality).unwrap();
    assert_eq!((renderer.quality(), renderer.pipeline_has_quality()), (&quality, true));
    renderer.set_pipeline(Deferred::to_picture()).unwrap();
    assert_eq!((renderer.quality(), renderer.pipeline_has_quality()), (&quality, false));
}
