//! Pictures of scenes with pieces, against those of the same scenes without them.

use std::ops::Range;
use std::sync::Arc;

use drawloom::backend::{
    Backend, BackendError, EncodingStrategy, Picture, RecordingStrategy, SoftwareBackend, WgpuBackend,
};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Changes, Piece, RenderObject, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, RendererBuilder, Submitted, Submitter};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::everything::everything_with_mirror;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::device;
use crate::sampled_views::{MIRROR, SURFACE};
use crate::strategies::{expect, many_batches};

pub const CASES: &[Case] = &[
    ("pieces_of_a_changing_world_do_not_change_its_pictures", || changing_world(|| on_the_device(Ok))),
    ("pieces_of_a_changing_world_do_not_change_its_pictures_in_software", || {
        changing_world(|| in_software_with(|builder| builder))
    }),
    ("pieces_change_no_shadow_mirror_or_light", || {
        everything(|| on_the_device_with(Ok, |builder| builder.process(MIRROR)))
    }),
    ("pieces_change_no_shadow_mirror_or_light_in_software", || {
        everything(|| in_software_with(|builder| builder.process(MIRROR)))
    }),
    ("no_strategy_changes_the_picture_of_pieces", strategies),
];

/// A renderer, and how the picture of a view is read.
struct Painter<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    read: fn(&Submitted<B>, usize) -> Result<Picture, Failed>,
}

impl<B: Backend> Painter<B> {
    /// The pictures of all cameras, and how many pieces all views executed.
    fn draw(&mut self, scene: SceneRef<'_>) -> Result<(Vec<Picture>, usize), Failed> {
        let submitted = self.submitter.submit(self.renderer.record(scene)?)?;
        let main = scene.cameras.iter().enumerate().filter(|(_, camera)| camera.kind == ViewKind::Main);
        let pictures = main.map(|(view, _)| (self.read)(&submitted, view));
        let executed = submitted.statistics.views.iter().map(|view| view.pieces).sum();
        Ok((pictures.collect::<Result<_, _>>()?, executed))
    }

    /// Draws a scene with pieces, and compares its pictures with those of another renderer, which is told of no pieces and of no changes.
    fn compare(&mut self, plain: &mut Self, scene: SceneRef<'_>, name: &str) -> Result<usize, Failed> {
        let (found, executed) = self.draw(scene)?;
        let (expected, none) = plain.draw(SceneRef { pieces: &[], changes: Changes::Unknown, ..scene })?;
        expect(none == 0, || format!("{name}: pieces of a scene without"))?;
        for (view, (found, expected)) in found.iter().zip(&expected).enumerate() {
            expect(found == expected, || format!("{name}: another picture of view {view}"))?;
        }
        Ok(executed)
    }
}

/// The shipped processes with small shadow maps.
fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(ShadowMaps { side: 48, ..ShadowMaps::default() }))
}

fn on_the_device(
    with: impl FnOnce(WgpuBackend) -> Result<WgpuBackend, BackendError>,
) -> Result<Painter<WgpuBackend>, Failed> {
    on_the_device_with(with, |builder| builder)
}

fn on_the_device_with(
    with: impl FnOnce(WgpuBackend) -> Result<WgpuBackend, BackendError>,
    build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
) -> Result<Painter<WgpuBackend>, Failed> {
    let (device, queue) = device().ok_or("there is no graphics adapter")?;
    let builder = Renderer::builder(with(WgpuBackend::new(device, queue)?)?).deferred(deferred());
    let (renderer, submitter) = build(builder).build(Arc::new(Scheduler::new(2)?))?;
    Ok(Painter { renderer, submitter, read: |submitted, view| Ok(submitted.submission.read(view, "picture")?) })
}

fn in_software_with(
    build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>,
) -> Result<Painter<SoftwareBackend>, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).deferred(deferred());
    let (renderer, submitter) = build(builder).build(scheduler)?;
    Ok(Painter { renderer, submitter, read: |submitted, view| Ok(submitted.submission.read(view, "picture")?) })
}

/// Pieces of up to `most` consecutive objects, with some left out.
fn pieces_of(objects: Range<usize>, most: usize, random: &mut Random) -> Vec<Piece> {
    let (mut pieces, mut first) = (Vec::new(), objects.start);
    while first < objects.end {
        let end = first + 1 + random.below(most);
        if random.below(5) > 0 {
            pieces.push(Piece::new(format!("from {first}"), (first as u32..end as u32).collect()));
        }
        first = end;
    }
    pieces
}

/// Objects, assets and pieces come, change and go; cameras move.
fn changing_world<B: Backend>(new: fn() -> Result<Painter<B>, Failed>) -> Result<(), Failed> {
    let (mut with, mut plain) = (new()?, new()?);
    let mut executed = 0;
    for seed in 0..3 {
        let (mut world, mut random) = (ChangingWorld::new(seed, 500), Random::stream(seed));
        let mut pieces = pieces_of(0..500, 100, &mut random);
        world.scene.cameras.iter_mut().for_each(|camera| camera.size = [80, 60]);
        let mut changed = String::new();
        for step in 0..24 {
            let name = format!("step {step} of {seed}, after {changed}");
            executed += with.compare(&mut plain, SceneRef { pieces: &pieces, ..world.as_scene_ref() }, &name)?;
            if step % 10 == 9 {
                pieces = pieces_of(0..500, 100, &mut random);
            }
            world.scene.cameras[step % 2].position += random.direction() * 0.7;
            // Nothing changes in every third frame.
            changed = if step % 3 > 0 { world.step()? } else { "nothing".to_owned() };
            if step % 3 == 0 {
                let still = SceneRef { pieces: &pieces, changes: Changes::NONE, ..world.as_scene_ref() };
                executed += with.compare(&mut plain, still, &name)?;
            }
        }
    }
    expect(executed > 100, || format!("only {executed} pieces were executed"))
}

/// Lights of all kinds with shadow maps, a mirror, and blended objects.
fn everything<B: Backend>(new: fn() -> Result<Painter<B>, Failed>) -> Result<(), Failed> {
    let (mut with, mut plain) = (new()?, new()?);
    let mut scene = everything_with_mirror(SURFACE);
    scene.cameras.iter_mut().for_each(|camera| camera.size = [48, 32]);
    let objects = scene.as_scene_ref().object_count();
    scene.pieces = (0..objects as u32)
        .step_by(3)
        .map(|first| {
            Piece::new(
                format!("from {first}"),
                (first..first + 3).take_while(|object| (*object as usize) < objects).collect(),
            )
        })
        .collect();
    let (mut executed, mut views) = (0, 0);
    for frame in 0..10 {
        let moved = [frame as u32];
        let changes = match frame {
            0 => Changes::Unknown,
            4 | 7 => Changes::Objects(&moved),
            _ => Changes::NONE,
        };
        if matches!(frame, 4 | 7) {
            let object = scene.objects().nth(frame).ok_or("an object")?;
            let before = scene.object(object)?;
            scene.replace_object(object, RenderObject { position: before.position + DVec3::X * 0.3, ..before })?;
        }
        scene.cameras[0].position.x += 0.05;
        executed +=
            with.compare(&mut plain, SceneRef { changes, ..scene.as_scene_ref() }, &format!("frame {frame}"))?;
        views = with.renderer.plan().processes().len();
    }
    expect(executed > 50, || format!("only {executed} pieces were executed, by {views} processes"))
}

fn many_pieces() -> Scene {
    let mut scene = many_batches();
    let mut random = Random::stream(5);
    scene.pieces = pieces_of(0..scene.as_scene_ref().object_count(), 900, &mut random);
    scene
}

fn strategies() -> Result<(), Failed> {
    use EncodingStrategy::{OnSubmit, PerPass, Split};
    use RecordingStrategy::{Bundles, CachedBundles, Direct, Indirect};
    let mut scene = many_pieces();
    let camera = scene.cameras[0].clone();
    for recording in [Direct, Bundles, CachedBundles, Indirect] {
        for encoding in [PerPass, Split, OnSubmit] {
            let mut with = on_the_device(|wgpu| Ok(wgpu.recording_strategy(recording)?.encoding_strategy(encoding)))?;
            let mut plain = on_the_device(Ok)?;
            let mut executed = 0;
            for frame in 0..5 {
                scene.cameras[0].position = camera.position + DVec3::X * (4.0 * f64::from(frame));
                let scene = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
                executed += with.compare(&mut plain, scene, &format!("{recording:?}, {encoding:?}, frame {frame}"))?;
            }
            expect(executed > 5, || format!("only {executed} pieces were executed"))?;
        }
    }
    Ok(())
}
