//! Levels of detail move what is drawn by no more than the quality allows, and backends draw the triangles of the
//! level.

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::quality::{DepthCurve, DepthPrecision, Quality, ShadowQuality};
use drawloom::scene::{Camera, Material, RenderObject, Scene};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::leveled::{coarsest, distance_from_edges, globe, halved, plates, whole};
use drawloom_testing::scenes::{as_list, culled, field, sized, with_meshes};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};
use crate::strategies::{expect, few_strategies, fixture_with, pictures, strategies};

pub const CASES: &[Case] = &[
    ("at_an_error_of_0_levels_of_detail_change_no_byte", full_detail),
    ("levels_of_detail_draw_the_bytes_of_their_triangles_with_any_strategy", coarsest_levels),
    ("levels_of_detail_that_change_draw_the_same_bytes_with_any_strategy_and_order", changing_levels),
    ("levels_of_detail_move_silhouettes_by_no_more_than_the_error", silhouettes),
    ("a_scene_with_fewer_meshes_follows_one_with_levels_of_detail", fewer_meshes),
    ("a_slow_camera_sees_levels_of_detail_change_at_edges_only", slow_camera),
];

fn quality(level_of_detail: f32) -> Quality {
    let shadows = ShadowQuality { side: 64, ..ShadowQuality::default() };
    Quality { level_of_detail, shadows, ..Quality::balanced() }
}

/// The pictures of a scene by these strategies.
fn draw(
    scene: &Scene,
    (recording, encoding): (RecordingStrategy, EncodingStrategy),
    quality: Quality,
) -> Result<Vec<Picture>, Failed> {
    let mut fixture = fixture_with(recording, encoding)?;
    fixture.renderer.set_quality(quality)?;
    let recorded = fixture.record(scene)?;
    pictures(&fixture, recorded, scene)
}

const PLAIN: (RecordingStrategy, EncodingStrategy) = (RecordingStrategy::Bundles, EncodingStrategy::PerPass);

fn full_detail() -> Result<(), Failed> {
    for scene in [everything, || field(300)] {
        let leveled = draw(&with_meshes(scene(), halved), PLAIN, quality(0.0))?;
        expect(leveled == draw(&scene(), PLAIN, quality(0.0))?, || "levels change the picture".to_owned())?;
    }
    Ok(())
}

/// The renderer keeps nothing of the meshes of the scene before, which are in slots that this scene does not have.
fn fewer_meshes() -> Result<(), Failed> {
    let leveled = with_meshes(everything(), halved);
    let mut few = Scene::new();
    let mesh = few.add(as_list(&globe()))?;
    let material = few.add(Material::default())?;
    few.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    few.cameras = everything().cameras;
    let mut fixture = Fixture::new()?;
    fixture.renderer.set_quality(quality(1.0))?;
    fixture.draw(&leveled)?;
    let found = fixture.draw(&few)?;
    let mut fresh = Fixture::new()?;
    fresh.renderer.set_quality(quality(1.0))?;
    expect(found == fresh.draw(&few)?, || "the meshes of the scene before change the picture".to_owned())
}

/// With errors that are all allowed, a scene looks as one with the meshes of its coarsest levels. One has a light that
/// subdivides meshes, and in another triangles are culled.
fn coarsest_levels() -> Result<(), Failed> {
    let scenes: [fn() -> Scene; 4] = [
        || with_meshes(everything(), |mesh| if mesh.name() == "cube" { globe() } else { halved(mesh) }),
        || with_meshes(everything(), halved),
        || with_meshes(field(300), halved),
        || with_meshes(everything(), |mesh| culled(&halved(&as_list(mesh)))),
    ];
    for leveled in scenes {
        let expected = draw(&with_meshes(leveled(), coarsest), PLAIN, quality(0.0))?;
        let full = draw(&with_meshes(leveled(), whole), PLAIN, quality(0.0))?;
        expect(expected != full, || "the levels look like the meshes".to_owned())?;
        for strategies in few_strategies() {
            let found = draw(&leveled(), strategies, quality(1e9))?;
            expect(found == expected, || format!("the picture differs with {strategies:?}"))?;
        }
    }
    Ok(())
}

/// The camera moves among globes, frame by frame: bundles are cached, and lists are ordered by bin or by depth.
fn changing_levels() -> Result<(), Failed> {
    let frames = |strategies: (RecordingStrategy, EncodingStrategy), quality| -> Result<_, Failed> {
        let (mut fixture, mut scene) = (fixture_with(strategies.0, strategies.1)?, globes());
        fixture.renderer.set_quality(quality)?;
        let (mut drawn, mut triangles) = (Vec::new(), Vec::new());
        for _ in 0..5 {
            scene.cameras.iter_mut().for_each(|camera| camera.position += DVec3::new(0.5, 0.0, -4.0));
            let recorded = fixture.record(&scene)?;
            let views = &recorded.statistics().views;
            triangles.push(views[0].levels_of_detail.map(|levels| levels.triangles));
            drawn.push(pictures(&fixture, recorded, &scene)?);
        }
        Ok((drawn, triangles))
    };
    let (expected, triangles) = frames(PLAIN, quality(0.7))?;
    expect(triangles.windows(2).all(|pair| pair[0] != pair[1]), || format!("no level changes: {triangles:?}"))?;
    for strategies in strategies() {
        let found = frames(strategies, quality(0.7))?;
        expect(found == (expected.clone(), triangles.clone()), || format!("a picture differs with {strategies:?}"))?;
    }
    let opaque_order = DepthPrecision { bits: 20, curve: DepthCurve::Logarithmic };
    let (by_depth, _) = frames(PLAIN, Quality { opaque_order, ..quality(0.7) })?;
    expect(by_depth == expected, || "a picture differs with another order".to_owned())
}

fn globes() -> Scene {
    with_meshes(field(200), |mesh| if mesh.name() == "cube" { globe() } else { halved(mesh) })
}

fn fixture(level_of_detail: f32) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality(level_of_detail)))
}

/// The radiance of a scene, and the number of its triangles.
fn shine(fixture: &mut Fixture, scene: &Scene) -> Result<(Vec<[f64; 3]>, Option<usize>), Failed> {
    let recorded = fixture.record(scene)?;
    let triangles = recorded.statistics().views[0].levels_of_detail.map(|levels| levels.triangles);
    Ok((radiance(&fixture.submit(recorded)?, 0)?, triangles))
}

fn silhouettes() -> Result<(), Failed> {
    let scene = plates();
    let width = scene.cameras[0].size[0] as usize;
    let (full, _) = shine(&mut fixture(0.0)?, &scene)?;
    for pixels in [1.0, 4.0, 8.0] {
        let (coarse, _) = shine(&mut fixture(pixels)?, &scene)?;
        let moved = distance_from_edges(&[&full], width, |pixel| coarse[pixel] != full[pixel]);
        // Pixels are lit by their centres, so both edges may be off by half a pixel.
        let (least, most) = (0.7 * f64::from(pixels) - 1.0, f64::from(pixels) + 0.5);
        expect(moved >= least && moved <= most, || format!("{moved} pixels at {pixels}"))?;
    }
    Ok(())
}

/// Where a pixel changes that does not at full detail, an edge at full detail is near.
fn slow_camera() -> Result<(), Failed> {
    let (mut scene, pixels) = (plates(), 2.0);
    scene.cameras[0] = sized(Camera::looking_at("main", DVec3::Z * 8.0, DVec3::ZERO), [640, 360]);
    let width = scene.cameras[0].size[0] as usize;
    let (mut whole, mut leveled) = (fixture(0.0)?, fixture(pixels)?);
    let (mut before, mut changes) = (None, 0);
    for _ in 0..40 {
        scene.cameras[0].position += DVec3::new(0.05, 0.01, -0.12);
        let (full, (coarse, triangles)) = (shine(&mut whole, &scene)?.0, shine(&mut leveled, &scene)?);
        if let Some((full_before, coarse_before, triangles_before)) =
            before.replace((full.clone(), coarse.clone(), triangles))
        {
            changes += usize::from(triangles != triangles_before);
            let pops = |pixel: usize| coarse[pixel] != coarse_before[pixel] && full[pixel] == full_before[pixel];
            let distance = distance_from_edges(&[&full, &full_before], width, pops);
            expect(distance <= f64::from(pixels) + 0.5, || format!("a pixel changes {distance} pixels from an edge"))?;
        }
    }
    expect(changes > 3, || format!("levels change in {changes} frames"))
}
