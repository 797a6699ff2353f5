//! Every recording and encoding strategy draws the same bytes while scenes change. Cached bundles are replayed if and
//! only if nothing that they depend on has changed.

use std::sync::Arc;

use drawloom::backend::{BackendError, EncodingStrategy, Picture, RecordingStrategy, WgpuBackend, WgpuPassStatistics};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::{Blend, Camera, Material, RenderObject, Scene, Texture};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Granularity, RecordedFrame, Renderer, SubmitError};
use drawloom_testing::adapter;
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{cube, field};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, device};
use crate::references::small_colonnade;

pub const CASES: &[Case] = &[
    ("every_strategy_draws_the_same_bytes", same_bytes),
    ("frames_in_flight_are_independent_with_every_strategy", frames_in_flight),
    ("trials_of_the_tuner_draw_the_same_bytes", tuned),
    ("cached_bundles_are_replayed_while_objects_move", moving),
    ("cached_bundles_are_replayed_when_another_view_comes_or_goes", other_view),
    ("passes_draw_the_same_after_their_ranges_have_moved", moved_ranges),
    ("cached_bundles_are_recorded_again_when_their_inputs_change", recorded_again),
    ("cached_bundles_are_recorded_again_when_a_subdivision_level_changes", subdivided_again),
    ("an_error_at_submission_names_the_pass", refused_at_submission),
];

const RECORDING_STRATEGIES: [RecordingStrategy; 3] =
    [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles];
const ENCODING_STRATEGIES: [EncodingStrategy; 3] =
    [EncodingStrategy::PerPass, EncodingStrategy::Split, EncodingStrategy::OnSubmit];

/// All strategies.
pub fn strategies() -> Vec<(RecordingStrategy, EncodingStrategy)> {
    let recordings = RECORDING_STRATEGIES.into_iter();
    recordings.flat_map(|recording| ENCODING_STRATEGIES.map(|encoding| (recording, encoding))).collect()
}

/// A few of the strategies: each way to record once, and with these each way to encode at least once. For scenes whose
/// passes have too few draws to be split.
pub fn few_strategies() -> Vec<(RecordingStrategy, EncodingStrategy)> {
    let mut next_encoding = ENCODING_STRATEGIES.into_iter().cycle();
    let mut few = strategies();
    few.dedup_by_key(|(recording, _)| *recording);
    few.iter_mut().for_each(|(_, encoding)| *encoding = next_encoding.next().unwrap_or(*encoding));
    few
}

/// A fixture with this backend, whose jobs record two bundles at once.
pub fn fixture_of(backend: WgpuBackend) -> Result<Fixture, Failed> {
    fixture_divided(backend, Granularity::Chunk(300))
}

fn fixture_divided(backend: WgpuBackend, granularity: Granularity) -> Result<Fixture, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(backend).pipeline(small_maps()).granularity(granularity);
    let (renderer, submitter) = builder.build(scheduler)?;
    Ok(Fixture { renderer, submitter })
}

/// The deferred pipeline with small shadow maps, which are fast to draw and take as many draws as large ones.
pub fn small_maps() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(ShadowMaps { side: 64, ..ShadowMaps::default() }))
}

/// A fixture with fixed strategies.
pub fn fixture_with(recording: RecordingStrategy, encoding: EncodingStrategy) -> Result<Fixture, Failed> {
    fixture_of(backend()?.recording_strategy(recording).encoding_strategy(encoding))
}

/// A fixture with cached bundles on a device that no other case uses. So the device is done with a frame when its
/// picture is read, and the next frame has the same buffers and their bundles.
fn fixture_alone(encoding: EncodingStrategy) -> Result<Fixture, Failed> {
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    fixture_of(backend.encoding_strategy(encoding))
}

/// The picture and the radiance of every main view.
pub fn pictures(
    fixture: &Fixture,
    recorded: RecordedFrame<WgpuBackend>,
    scene: &Scene,
) -> Result<Vec<Picture>, Failed> {
    let submission = fixture.submit(recorded)?;
    let targets = (0..scene.cameras.len()).flat_map(|view| [(view, "picture"), (view, "radiance")]);
    Ok(targets.map(|(view, target)| submission.read(view, target)).collect::<Result<_, _>>()?)
}

fn draw(fixture: &mut Fixture, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let recorded = fixture.record(scene)?;
    pictures(fixture, recorded, scene)
}

/// The pictures of a new renderer.
pub fn drawn_by_a_new_renderer(scene: &Scene) -> Result<Vec<Picture>, Failed> {
    draw(&mut fixture_with(RecordingStrategy::Bundles, EncodingStrategy::PerPass)?, scene)
}

/// Many meshes and panes of glass that hardly merge: several bundles of opaque and of blended batches per view.
pub fn many_batches() -> Scene {
    let mut scene = field(3200);
    let meshes: Vec<_> = (0..1600).map(|_| scene.add(cube()).unwrap()).collect();
    let stone = Material { diffuse: Vec3::splat(0.4), ..Material::default() };
    let stones: Vec<_> = (0..60).map(|_| scene.add(stone.clone()).unwrap()).collect();
    for (index, handle) in scene.objects().collect::<Vec<_>>().into_iter().enumerate() {
        let mut object = scene.object(handle).unwrap();
        object.mesh = meshes[(index * 7 + index / 5) % meshes.len()];
        if scene.assets().get(object.material).unwrap().blend == Blend::None {
            object.material = stones[(index / 3) % stones.len()];
        }
        scene.replace_object(handle, object).unwrap();
    }
    scene.cameras[0].size = [96, 54];
    scene.cameras[1].size = [60, 60];
    scene
}

/// Moves every object a little. The batches of opaque objects stay the same.
fn move_all(scene: &mut Scene, by: f64) -> Result<(), Failed> {
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        let position = object.position + DVec3::new(0.01, 0.02, -0.01) * by;
        scene.replace_object(handle, RenderObject { position, ..object })?;
    }
    Ok(())
}

type Change = fn(&mut Scene) -> Result<(), Failed>;

/// The change of a scene before each frame: none at first, then everything moves, an object is removed and added,
/// assets are added, a picture is resized.
const CHANGES: [Change; 8] = [
    |_| Ok(()),
    |_| Ok(()),
    |scene| move_all(scene, 1.0),
    |scene| {
        let hidden = scene.objects().nth(1).ok_or("there are objects")?;
        scene.remove_object(hidden)?;
        Ok(())
    },
    |scene| {
        let shown = scene.objects().next().ok_or("there are objects")?;
        let object = scene.object(shown)?;
        scene.add_object(RenderObject { position: object.position + DVec3::Y, ..object })?;
        Ok(())
    },
    |scene| {
        let texture = scene.add(Texture::new("green", 1, 1, vec![0, 200, 40, 255])?)?;
        let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
        let mesh = scene.add(cube())?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(0.0, 2.0, 1.0)))?;
        Ok(())
    },
    |scene| {
        scene.cameras[0].size = [71, 53];
        Ok(())
    },
    |scene| move_all(scene, -2.0),
];

fn same_bytes() -> Result<(), Failed> {
    let mut fixtures = Vec::new();
    for (recording, encoding) in strategies() {
        fixtures.push((recording, encoding, fixture_with(recording, encoding)?));
    }
    let scenes = [(small_colonnade()?, few_strategies()), (many_batches(), strategies()), (everything(), strategies())];
    for (mut scene, chosen) in scenes {
        for (frame, change) in CHANGES.into_iter().enumerate() {
            change(&mut scene)?;
            let mut expected = None;
            let is_chosen = |(recording, encoding, _): &&mut (_, _, _)| chosen.contains(&(*recording, *encoding));
            for (recording, encoding, fixture) in fixtures.iter_mut().filter(is_chosen) {
                let drawn = draw(fixture, &scene)?;
                if *expected.get_or_insert_with(|| drawn.clone()) != drawn {
                    return Err(format!("frame {frame} differs with {recording:?}, {encoding:?}").into());
                }
                let passes = fixture.renderer.backend().pass_statistics();
                if passes.is_empty()
                    || passes.iter().any(|pass| (pass.recording, pass.encoding) != (*recording, *encoding))
                {
                    return Err(format!("these should be {recording:?}, {encoding:?}: {passes:?}").into());
                }
            }
            if frame == CHANGES.len() - 1 && expected != Some(drawn_by_a_new_renderer(&scene)?) {
                return Err("a new renderer draws other bytes".into());
            }
        }
    }
    Ok(())
}

fn frames_in_flight() -> Result<(), Failed> {
    let change = |scene: &mut Scene, round| -> Result<(), Failed> {
        move_all(scene, 20.0)?;
        if round == 1 {
            scene.lights.pop();
            let removed = scene.objects().next().ok_or("there are objects")?;
            scene.remove_object(removed)?;
        }
        Ok(())
    };
    let mut scene = many_batches();
    let mut expected = vec![drawn_by_a_new_renderer(&scene)?];
    for round in 0..3 {
        change(&mut scene, round)?;
        expected.push(drawn_by_a_new_renderer(&scene)?);
    }
    expect(expected.windows(2).all(|pair| pair[0] != pair[1]), || "nothing changes".to_owned())?;
    for (recording, encoding) in strategies() {
        let (mut scene, mut fixture) = (many_batches(), fixture_with(recording, encoding)?);
        for round in 0..3 {
            let differs =
                |which| Failed::from(format!("the {which} differs: {recording:?}, {encoding:?}, round {round}"));
            let first = fixture.record(&scene)?;
            change(&mut scene, round)?;
            // A frame in between is never submitted.
            drop(fixture.record(&scene)?);
            let second = fixture.record(&scene)?;
            if round == 1 {
                // Both are submitted before either is read. They share their targets, so only the second can be read.
                drop(fixture.submit(first)?);
            } else if pictures(&fixture, first, &scene)? != expected[round] {
                return Err(differs("first"));
            }
            if pictures(&fixture, second, &scene)? != expected[round + 1] {
                return Err(differs("second"));
            }
        }
    }
    Ok(())
}

fn tuned() -> Result<(), Failed> {
    let (mut scene, (device, queue)) = (many_batches(), device()?);
    scene.cameras[0].size = [24, 18];
    scene.cameras[1].size = [20, 20];
    let expected = drawn_by_a_new_renderer(&scene)?;
    // A fixed number of draws in a job would leave out strategies without bundles.
    let mut fixture = fixture_divided(WgpuBackend::new(device, queue)?, Granularity::Adaptive)?;
    let mut used: Vec<(RecordingStrategy, bool)> = Vec::new();
    for frame in 0..40 {
        if draw(&mut fixture, &scene)? != expected {
            return Err(format!("frame {frame} differs: {:?}", fixture.renderer.backend().pass_statistics()).into());
        }
        used.extend(
            fixture.renderer.backend().pass_statistics().iter().map(|pass| (pass.recording, pass.encoders > 1)),
        );
    }
    for (recording, _) in strategies() {
        if !used.contains(&(recording, false)) {
            return Err(format!("{recording:?} was not tried").into());
        }
    }
    if used.iter().any(|(_, is_split)| *is_split) { Ok(()) } else { Err("no pass was split".into()) }
}

/// The numbers of recorded and of replayed bundles in the passes that `is_counted` selects.
pub fn counts(fixture: &Fixture, is_counted: impl Fn(&WgpuPassStatistics) -> bool) -> (usize, usize) {
    let passes = fixture.renderer.backend().pass_statistics();
    let counted = passes.iter().filter(|pass| is_counted(pass));
    counted
        .fold((0, 0), |(recorded, replayed), pass| (recorded + pass.recorded_bundles, replayed + pass.replayed_bundles))
}

pub fn expect(condition: bool, message: impl Fn() -> String) -> Result<(), Failed> {
    if condition { Ok(()) } else { Err(message().into()) }
}

fn moving() -> Result<(), Failed> {
    for encoding in ENCODING_STRATEGIES {
        let (mut scene, mut fixture) = (many_batches(), fixture_alone(encoding)?);
        draw(&mut fixture, &scene)?;
        let (recorded, replayed) = counts(&fixture, |_| true);
        expect(recorded > 10 && replayed == 0, || format!("at first {recorded} and {replayed}"))?;
        for pass in fixture.renderer.backend().pass_statistics() {
            expect(pass.view != 0 || pass.recorded_bundles > 3, || format!("not many bundles: {pass:?}"))?;
        }
        for frame in 0..4 {
            if frame > 1 {
                // A millimetre changes no order and no visibility, but every pixel at an edge.
                move_all(&mut scene, 0.01)?;
            }
            draw(&mut fixture, &scene)?;
            let (again, replayed) = counts(&fixture, |_| true);
            expect((again, replayed) == (0, recorded), || format!("{encoding:?}, {frame}: {again} and {replayed}"))?;
        }
        if draw(&mut fixture, &scene)? != drawn_by_a_new_renderer(&scene)? {
            return Err("replayed bundles draw objects at their old positions".into());
        }
    }
    Ok(())
}

fn other_view() -> Result<(), Failed> {
    let (mut scene, mut fixture) = (many_batches(), fixture_alone(EncodingStrategy::PerPass)?);
    let other = Camera { name: "other".into(), size: [16, 16], ..scene.cameras[0].clone() };
    // It stands before the others, so these get other indices. At first the buffers grow to what all need.
    for (round, comes) in [true, false, true, false, true].into_iter().enumerate() {
        if comes {
            scene.cameras.insert(0, other.clone());
        } else {
            scene.cameras.remove(0);
        }
        let first_of_others = scene.cameras.len() - 2;
        expect(draw(&mut fixture, &scene)? == drawn_by_a_new_renderer(&scene)?, || format!("round {round} differs"))?;
        let (recorded, replayed) = counts(&fixture, |pass| pass.view >= first_of_others);
        expect(round == 0 || (recorded == 0 && replayed > 10), || format!("{round}: {recorded} and {replayed}"))?;
    }
    Ok(())
}

fn moved_ranges() -> Result<(), Failed> {
    let (mut scene, mut fixture) = (many_batches(), fixture_alone(EncodingStrategy::PerPass)?);
    let cameras: Vec<_> = (0..5_u32)
        .map(|index| {
            let mut camera = scene.cameras[0].clone();
            (camera.name, camera.size) = (format!("view {index}"), [16 + index, 16]);
            camera.position.x += f64::from(index);
            camera
        })
        .collect();
    // Where only the last is left, it moves to the start of the buffers.
    for range in [0..5, 4..5, 0..5, 3..5, 1..2, 0..4] {
        scene.cameras = cameras[range.clone()].to_vec();
        expect(draw(&mut fixture, &scene)? == drawn_by_a_new_renderer(&scene)?, || format!("{range:?} differ"))?;
    }
    Ok(())
}

fn recorded_again() -> Result<(), Failed> {
    let (mut scene, mut fixture) = (many_batches(), fixture_alone(EncodingStrategy::PerPass)?);
    let steady = |fixture: &mut Fixture, scene: &Scene, after: &str| {
        draw(fixture, scene)?;
        let (recorded, replayed) = counts(fixture, |_| true);
        expect(recorded == 0 && replayed > 10, || format!("after {after}: {recorded} and {replayed}"))
    };
    draw(&mut fixture, &scene)?;
    steady(&mut fixture, &scene, "the first frame")?;

    // This changes one bundle and those after it; earlier ones are replayed.
    let visible = scene.objects().nth(700).ok_or("there are objects")?;
    let object = scene.remove_object(visible)?;
    draw(&mut fixture, &scene)?;
    let (recorded, replayed) = counts(&fixture, |_| true);
    expect(recorded > 0 && replayed > 0, || format!("without an object {recorded} and {replayed}"))?;
    steady(&mut fixture, &scene, "an object was removed")?;
    scene.add_object(object)?;
    draw(&mut fixture, &scene)?;
    expect(counts(&fixture, |_| true).0 > 0, || "an object was added again, and nothing was recorded".to_owned())?;
    steady(&mut fixture, &scene, "an object was added again")?;

    // An input of every bundle.
    scene.add(Material::default())?;
    draw(&mut fixture, &scene)?;
    expect(counts(&fixture, |_| true).1 == 0, || "bundles of other materials were replayed".to_owned())?;
    steady(&mut fixture, &scene, "a material was added")?;

    // A picture of the same aspect ratio shows the same objects, and bundles do not depend on the size.
    scene.cameras[0].size = [48, 27];
    let resized = draw(&mut fixture, &scene)?;
    expect(counts(&fixture, |_| true).0 == 0, || "bundles were recorded for another size".to_owned())?;
    expect(resized == drawn_by_a_new_renderer(&scene)?, || "at another size it differs".to_owned())?;

    // More objects, all out of sight, take new buffers.
    for _ in 0..8000 {
        scene.add_object(RenderObject { position: DVec3::splat(1e6), ..object })?;
    }
    draw(&mut fixture, &scene)?;
    expect(counts(&fixture, |_| true).1 == 0, || "bundles of other buffers were replayed".to_owned())?;
    steady(&mut fixture, &scene, "other buffers")?;

    // Objects beyond the capacity of the buffers.
    scene.duplicate_objects(3);
    draw(&mut fixture, &scene)?;
    steady(&mut fixture, &scene, "three times the objects")?;
    if draw(&mut fixture, &scene)? == drawn_by_a_new_renderer(&scene)? {
        Ok(())
    } else {
        Err("the last frame differs".into())
    }
}

/// Subdivision levels rise when objects are closer to the lamp of `everything`. Subdivisions change when meshes change.
fn subdivided_again() -> Result<(), Failed> {
    let (mut scene, mut fixture) = (everything(), fixture_alone(EncodingStrategy::PerPass)?);
    draw(&mut fixture, &scene)?;
    draw(&mut fixture, &scene)?;
    let shadows = |fixture: &Fixture| counts(fixture, |pass| pass.process == "shadow casters");
    let (recorded, replayed) = shadows(&fixture);
    expect(recorded == 0 && replayed > 0, || format!("{recorded} and {replayed}"))?;
    // So close to the floor and its neighbours that their subdivision levels rise.
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        scene.replace_object(handle, RenderObject { position: object.position + DVec3::Y * 1.5, ..object })?;
    }
    if draw(&mut fixture, &scene)? != drawn_by_a_new_renderer(&scene)? {
        return Err("nearer to the lamp it differs".into());
    }
    let (recorded, _) = shadows(&fixture);
    expect(recorded > 0, || "nothing was recorded nearer to the lamp".to_owned())?;
    let mesh = scene.as_scene_ref().meshes[3];
    scene.replace(mesh, drawloom_testing::scenes::cube_with_flipped_normals())?;
    if draw(&mut fixture, &scene)? == drawn_by_a_new_renderer(&scene)? {
        Ok(())
    } else {
        Err("with another mesh it differs".into())
    }
}

/// A process that samples the target that it draws into.
pub struct Ouroboros;

impl RenderProcess for Ouroboros {
    fn name(&self) -> &str {
        "ouroboros"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("tail", Format::Rgba8Unorm, ClearColor::Background);
        declare.samples("tail");
        declare.after("head");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var tail: texture_2d<f32>;
            @fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(tail, vec2<i32>(0, 0), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// Draws the target that [`Ouroboros`] samples.
pub struct Head;

impl RenderProcess for Head {
    fn name(&self) -> &str {
        "head"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("tail", Format::Rgba8Unorm, ClearColor::Background);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4(1.0); }";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn refused_at_submission() -> Result<(), Failed> {
    let backend =
        backend()?.recording_strategy(RecordingStrategy::CachedBundles).encoding_strategy(EncodingStrategy::OnSubmit);
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Head).process(Ouroboros);
    let (mut renderer, submitter) = builder.output("tail").build(Arc::new(Scheduler::new(2)?))?;
    let scene = everything();
    for _ in 0..2 {
        match submitter.submit(renderer.record(scene.as_scene_ref())?).err() {
            Some(SubmitError::Backend(BackendError::Validation { label, .. })) if label.contains("ouroboros") => {}
            other => return Err(format!("{other:?}").into()),
        }
    }
    Ok(())
}
