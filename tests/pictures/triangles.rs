//! Triangle culling changes no byte, with any recording strategy.

use std::cell::Cell;

use drawloom::RecordedFrame;
use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::quality::{Quality, TransformPrecision};
use drawloom::scene::{RenderObject, Scene};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{as_list, field, with_meshes};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::backend;
use crate::references::small_colonnade;
use crate::strategies::{
    drawn_by_a_new_renderer, expect, few_strategies, fixture_of, fixture_with, many_batches, pictures, small_maps,
    strategies,
};

pub const CASES: &[Case] = &[
    ("triangle_culling_changes_no_byte_with_any_strategy", all_strategies),
    ("triangle_culling_changes_no_byte_while_strategies_are_measured", measured),
    ("triangle_culling_changes_no_byte_while_other_things_change", other_changes),
];

type Make = fn() -> Result<Scene, Failed>;

/// Scenes, each with an n: every n-th mesh is cullable. And whether passes have enough draws to be split.
const SCENES: [(Make, usize, bool); 4] = [
    (|| Ok(everything()), 1, false),
    (|| Ok(field(300)), 1, false),
    (small_colonnade, 1, true),
    (|| Ok(many_batches()), 2, true),
];

/// The scene with triangle culling enabled for every n-th mesh. Strips become lists, because a strip's triangles are
/// rounded differently.
fn cullable(scene: Scene, every: usize) -> Scene {
    let number = Cell::new(0_usize);
    with_meshes(scene, |mesh| {
        number.set(number.get() + 1);
        as_list(mesh).with_triangle_culling(number.get().is_multiple_of(every))
    })
}

/// Moves the camera and an object: the draws stay the same, but their remaining triangles change.
fn change(scene: &mut Scene) -> Result<(), Failed> {
    for camera in &mut scene.cameras {
        camera.position += DVec3::new(0.7, 0.3, -0.4);
    }
    let first = scene.objects().next().ok_or("there are objects")?;
    let object = scene.object(first)?;
    scene.replace_object(first, RenderObject { position: object.position + DVec3::Y * 0.2, ..object })?;
    Ok(())
}

fn all_strategies() -> Result<(), Failed> {
    for (scene, every, can_be_split) in SCENES {
        let mut whole = with_meshes(scene()?, as_list);
        let mut expected = Vec::new();
        for _ in 0..FRAMES {
            expected.push(drawn_by_a_new_renderer(&whole)?);
            change(&mut whole)?;
        }
        let strategies = if can_be_split { strategies() } else { few_strategies() };
        for (record, encode) in strategies {
            let (mut fixture, mut cullable) = (fixture_with(record, encode)?, cullable(scene()?, every));
            for (frame, expected) in expected.iter().enumerate() {
                let recorded = fixture.record(&cullable)?;
                let culled = culled_in(&recorded);
                if culled == 0 || pictures(&fixture, recorded, &cullable)? != *expected {
                    return Err(format!("frame {frame} differs with {record:?}, {encode:?}; {culled} culled").into());
                }
                change(&mut cullable)?;
            }
            let is_split = fixture.renderer.backend().pass_statistics().iter().any(|pass| pass.encoders > 1);
            let has_to_be = encode == EncodingStrategy::Split && can_be_split;
            expect(is_split == has_to_be, || format!("split passes with {record:?}, {encode:?}: {is_split}"))?;
        }
    }
    Ok(())
}

fn culled_in(recorded: &RecordedFrame<WgpuBackend>) -> usize {
    recorded.statistics().views.iter().map(|view| view.culled_triangles.culled()).sum()
}

/// With other causes of change: a depth pre-pass, several frames in flight, another quality and back, and meshes that
/// stop being cullable.
fn other_changes() -> Result<(), Failed> {
    let expected = |scene: &Scene| drawn_by_a_new_renderer(scene);
    let mut whole = with_meshes(everything(), as_list);
    let first = expected(&whole)?;
    change(&mut whole)?;
    let second = expected(&whole)?;

    let mut fixture = fixture_with(RecordingStrategy::CachedBundles, EncodingStrategy::PerPass)?;
    fixture.renderer.set_pipeline(small_maps().depth_pre_pass(true))?;
    let mut scene = cullable(everything(), 1);
    for _ in 0..2 {
        let in_flight = fixture.record(&scene)?;
        let is_culled = culled_in(&in_flight) > 0;
        change(&mut scene)?;
        drop(fixture.record(&scene)?);
        let later = fixture.record(&scene)?;
        let drawn = [pictures(&fixture, in_flight, &scene)?, pictures(&fixture, later, &scene)?];
        expect(is_culled && drawn == [first.clone(), second.clone()], || "a frame in flight differs".to_owned())?;

        // Absolute transforms disable culling.
        fixture.renderer.set_quality(Quality { transforms: TransformPrecision::Absolute, ..Quality::balanced() })?;
        let recorded = fixture.record(&scene)?;
        expect(culled_in(&recorded) == 0, || "triangles with absolute transforms were culled".to_owned())?;
        drop(fixture.submit(recorded)?);
        fixture.renderer.set_quality(Quality::balanced())?;
        fixture.renderer.set_pipeline(small_maps().depth_pre_pass(true))?;

        scene = with_meshes(scene, as_list);
        let recorded = fixture.record(&scene)?;
        let is_culled = culled_in(&recorded) > 0;
        let same = pictures(&fixture, recorded, &scene)? == second;
        expect(same && !is_culled, || "a scene without cullable meshes differs".to_owned())?;
        scene = cullable(everything(), 1);
    }
    Ok(())
}

const FRAMES: usize = 3;

fn measured() -> Result<(), Failed> {
    let mut fixture = fixture_of(backend()?)?;
    let scene = cullable(everything(), 3);
    let expected = drawn_by_a_new_renderer(&with_meshes(everything(), as_list))?;
    for frame in 0..40 {
        let recorded = fixture.record(&scene)?;
        let culled = culled_in(&recorded);
        if culled == 0 || pictures(&fixture, recorded, &scene)? != expected {
            return Err(format!("frame {frame} differs: {:?}", fixture.renderer.backend().pass_statistics()).into());
        }
    }
    Ok(())
}
