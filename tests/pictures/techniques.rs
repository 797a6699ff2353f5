//! The same bytes for every way to record and every way to encode, while scenes change; and what is kept is used again, and
//! only then.

use std::sync::{Arc, OnceLock};

use drawloom::backend::{BackendError, EncodingStrategy, Picture, RecordingStrategy, WgpuBackend, WgpuPassStatistics};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::{Blend, Light, Material, RenderObject, Scene, Texture};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Granularity, Recorded, Renderer, SubmitError, wgpu};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{cube, field};
use libtest_mimic::Failed;

use crate::Case;
use crate::references::colonnade;
use crate::studio::Studio;

pub const CASES: &[Case] = &[
    ("every_technique_draws_alike", alike),
    ("every_technique_keeps_frames_on_their_way_apart", on_their_way),
    ("ways_that_are_measured_and_tried_draw_alike", measured),
    ("kept_bundles_are_replayed_while_objects_move", moving),
    ("kept_bundles_are_recorded_anew_where_something_changed", recorded_anew),
    ("kept_bundles_follow_meshes_that_are_subdivided_otherwise", subdivided_otherwise),
    ("a_pass_refused_at_submission_is_named", refused_at_submission),
];

const RECORDS: [RecordingStrategy; 4] = [
    RecordingStrategy::Direct,
    RecordingStrategy::Bundles,
    RecordingStrategy::CachedBundles,
    RecordingStrategy::Indirect,
];
const ENCODES: [EncodingStrategy; 3] = [EncodingStrategy::PerPass, EncodingStrategy::Split, EncodingStrategy::OnSubmit];

/// The machine's adapter with all features that Drawloom has a use for.
pub fn device() -> Result<(wgpu::Device, wgpu::Queue), Failed> {
    static DEVICE: OnceLock<Result<(wgpu::Device, wgpu::Queue), String>> = OnceLock::new();
    let open = || {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|error| error.to_string())?;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: adapter.features() & (WgpuBackend::OPTIONAL_FEATURES | WgpuBackend::TIMING_FEATURES),
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| error.to_string())
    };
    Ok(DEVICE.get_or_init(open).clone()?)
}

/// The techniques that the adapter has.
pub fn techniques() -> Result<Vec<(RecordingStrategy, EncodingStrategy)>, Failed> {
    let has_indirect = device()?.0.features().contains(WgpuBackend::OPTIONAL_FEATURES);
    let records = RECORDS.into_iter().filter(|record| has_indirect || *record != RecordingStrategy::Indirect);
    Ok(records.flat_map(|record| ENCODES.map(|encode| (record, encode))).collect())
}

pub fn studio_of(backend: WgpuBackend) -> Result<Studio, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(backend).deferred(small_maps()).granularity(Granularity::Chunk(300));
    let (renderer, submitter) = builder.build(scheduler)?;
    Ok(Studio { renderer, submitter })
}

/// Small shadow maps are soon drawn, and hold as many draws as large ones.
pub fn small_maps() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(ShadowMaps { side: 64, ..ShadowMaps::default() }))
}

/// One that draws by one technique alone.
pub fn technique(record: RecordingStrategy, encode: EncodingStrategy) -> Result<Studio, Failed> {
    let (device, queue) = device()?;
    studio_of(WgpuBackend::new(device, queue)?.recording_strategy(record)?.encoding_strategy(encode))
}

/// Every main view's picture, and the light in it.
pub fn pictures(studio: &Studio, recorded: Recorded<WgpuBackend>, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let submission = studio.submit(recorded)?;
    let targets = (0..scene.cameras.len()).flat_map(|view| [(view, "picture"), (view, "radiance")]);
    Ok(targets.map(|(view, target)| submission.read(view, target)).collect::<Result<_, _>>()?)
}

fn draw(studio: &mut Studio, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let recorded = studio.record(scene)?;
    pictures(studio, recorded, scene)
}

/// What a renderer draws that has drawn nothing before.
pub fn drawn_anew(scene: &Scene) -> Result<Vec<Picture>, Failed> {
    draw(&mut technique(RecordingStrategy::Bundles, EncodingStrategy::PerPass)?, scene)
}

/// The colonnade in a small picture. Its lamp casts no shadow: to halve the edges of all that is near it takes each technique
/// seconds, and `everything` has such a lamp as well.
fn small_colonnade() -> Result<Scene, Failed> {
    let mut scene = colonnade()?;
    scene.cameras[0].size = [120, 80];
    for light in &mut scene.lights {
        if let Light::Hemispherical { casts_shadow, .. } = light {
            *casts_shadow = false;
        }
    }
    Ok(scene)
}

/// So many meshes and panes of glass that nearly nothing merges: several bundles a view, of what is opaque and of what is not.
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

/// Moves every object a little: opaque ones stay the same batches.
fn move_all(scene: &mut Scene, by: f64) -> Result<(), Failed> {
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        let position = object.position + DVec3::new(0.01, 0.02, -0.01) * by;
        scene.replace_object(handle, RenderObject { position, ..object })?;
    }
    Ok(())
}

type Change = fn(&mut Scene) -> Result<(), Failed>;

/// What happens to a scene before each frame: nothing at first, then everything moves, an object goes and comes back, assets
/// are added, a picture is resized.
const STORY: [Change; 8] = [
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

fn alike() -> Result<(), Failed> {
    let mut studios = Vec::new();
    for (record, encode) in techniques()? {
        studios.push((record, encode, technique(record, encode)?));
    }
    for mut scene in [small_colonnade()?, many_batches(), everything()] {
        for (frame, change) in STORY.into_iter().enumerate() {
            change(&mut scene)?;
            let mut expected = None;
            for (record, encode, studio) in &mut studios {
                let drawn = draw(studio, &scene)?;
                if *expected.get_or_insert_with(|| drawn.clone()) != drawn {
                    return Err(format!("frame {frame} differs with {record:?}, {encode:?}").into());
                }
                let passes = studio.renderer.backend().pass_statistics();
                if passes.is_empty() || passes.iter().any(|pass| (pass.recording, pass.encoding) != (*record, *encode))
                {
                    return Err(format!("these should be {record:?}, {encode:?}: {passes:?}").into());
                }
            }
            if frame == STORY.len() - 1 && expected != Some(drawn_anew(&scene)?) {
                return Err("a renderer that has drawn nothing before draws something else".into());
            }
        }
    }
    Ok(())
}

fn on_their_way() -> Result<(), Failed> {
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
    let mut expected = vec![drawn_anew(&scene)?];
    for round in 0..3 {
        change(&mut scene, round)?;
        expected.push(drawn_anew(&scene)?);
    }
    expect(expected.windows(2).all(|pair| pair[0] != pair[1]), || "nothing changes".to_owned())?;
    for (record, encode) in techniques()? {
        let (mut scene, mut studio) = (many_batches(), technique(record, encode)?);
        for round in 0..3 {
            let told = |which| Failed::from(format!("the {which} differs: {record:?}, {encode:?}, round {round}"));
            let first = studio.record(&scene)?;
            change(&mut scene, round)?;
            // One that is never submitted lies between them.
            drop(studio.record(&scene)?);
            let second = studio.record(&scene)?;
            if round == 1 {
                // Both are submitted before either is read. They share their targets, so only the second can be seen.
                drop(studio.submit(first)?);
            } else if pictures(&studio, first, &scene)? != expected[round] {
                return Err(told("first"));
            }
            if pictures(&studio, second, &scene)? != expected[round + 1] {
                return Err(told("second"));
            }
        }
    }
    Ok(())
}

fn measured() -> Result<(), Failed> {
    let (mut scene, (device, queue)) = (many_batches(), device()?);
    scene.cameras[0].size = [24, 18];
    scene.cameras[1].size = [20, 20];
    let expected = drawn_anew(&scene)?;
    let mut studio = studio_of(WgpuBackend::new(device, queue)?)?;
    let mut seen: Vec<(RecordingStrategy, bool)> = Vec::new();
    for frame in 0..40 {
        if draw(&mut studio, &scene)? != expected {
            return Err(format!("frame {frame} differs: {:?}", studio.renderer.backend().pass_statistics()).into());
        }
        seen.extend(studio.renderer.backend().pass_statistics().iter().map(|pass| (pass.recording, pass.encoders > 1)));
    }
    for (record, _) in techniques()? {
        if !seen.contains(&(record, false)) {
            return Err(format!("{record:?} was not tried").into());
        }
    }
    if seen.iter().any(|(_, is_split)| *is_split) { Ok(()) } else { Err("no pass was split".into()) }
}

/// Bundles that were recorded and that were replayed, over the passes that `is_meant` picks.
pub fn counts(studio: &Studio, is_meant: impl Fn(&WgpuPassStatistics) -> bool) -> (usize, usize) {
    let passes = studio.renderer.backend().pass_statistics();
    let meant = passes.iter().filter(|pass| is_meant(pass));
    meant
        .fold((0, 0), |(recorded, replayed), pass| (recorded + pass.recorded_bundles, replayed + pass.replayed_bundles))
}

pub fn expect(condition: bool, what: impl Fn() -> String) -> Result<(), Failed> {
    if condition { Ok(()) } else { Err(what().into()) }
}

fn moving() -> Result<(), Failed> {
    for encode in ENCODES {
        let (mut scene, mut studio) = (many_batches(), technique(RecordingStrategy::CachedBundles, encode)?);
        draw(&mut studio, &scene)?;
        let (recorded, replayed) = counts(&studio, |_| true);
        expect(recorded > 10 && replayed == 0, || format!("at first {recorded} and {replayed}"))?;
        for pass in studio.renderer.backend().pass_statistics() {
            expect(pass.view != 0 || pass.recorded_bundles > 3, || format!("not many bundles: {pass:?}"))?;
        }
        for frame in 0..4 {
            if frame > 1 {
                // A millimetre changes no order and nobody's visibility, but every pixel at an edge.
                move_all(&mut scene, 0.01)?;
            }
            draw(&mut studio, &scene)?;
            let (again, replayed) = counts(&studio, |_| true);
            expect((again, replayed) == (0, recorded), || format!("{encode:?}, {frame}: {again} and {replayed}"))?;
        }
        if draw(&mut studio, &scene)? != drawn_anew(&scene)? {
            return Err("what is replayed shows where objects were".into());
        }
    }
    Ok(())
}

fn recorded_anew() -> Result<(), Failed> {
    let (mut scene, mut studio) =
        (many_batches(), technique(RecordingStrategy::CachedBundles, EncodingStrategy::PerPass)?);
    let steady = |studio: &mut Studio, scene: &Scene, after: &str| {
        draw(studio, scene)?;
        let (recorded, replayed) = counts(studio, |_| true);
        expect(recorded == 0 && replayed > 10, || format!("after {after}: {recorded} and {replayed}"))
    };
    draw(&mut studio, &scene)?;
    steady(&mut studio, &scene, "the first frame")?;

    // One of the bundles: those before it stay.
    let in_sight = scene.objects().nth(700).ok_or("there are objects")?;
    let object = scene.remove_object(in_sight)?;
    draw(&mut studio, &scene)?;
    let (recorded, replayed) = counts(&studio, |_| true);
    expect(recorded > 0 && replayed > 0, || format!("without an object {recorded} and {replayed}"))?;
    steady(&mut studio, &scene, "an object went")?;
    scene.add_object(object)?;
    draw(&mut studio, &scene)?;
    expect(counts(&studio, |_| true).0 > 0, || "an object came back, and nothing was recorded".to_owned())?;
    steady(&mut studio, &scene, "an object came back")?;

    // What every bundle is recorded with.
    scene.add(Material::default())?;
    draw(&mut studio, &scene)?;
    expect(counts(&studio, |_| true).1 == 0, || "bundles of other materials were replayed".to_owned())?;
    steady(&mut studio, &scene, "a material came")?;

    // A picture of the same shape shows the same objects, and bundles know no size.
    scene.cameras[0].size = [48, 27];
    let resized = draw(&mut studio, &scene)?;
    expect(counts(&studio, |_| true).0 == 0, || "bundles were recorded for another size".to_owned())?;
    expect(resized == drawn_anew(&scene)?, || "at another size it differs".to_owned())?;

    // Other buffers, as there are more objects; none of them is in sight.
    for _ in 0..8000 {
        scene.add_object(RenderObject { position: DVec3::splat(1e6), ..object })?;
    }
    draw(&mut studio, &scene)?;
    expect(counts(&studio, |_| true).1 == 0, || "bundles of other buffers were replayed".to_owned())?;
    steady(&mut studio, &scene, "other buffers")?;

    // More objects than there was room for.
    scene.duplicate_objects(3);
    draw(&mut studio, &scene)?;
    steady(&mut studio, &scene, "three times the objects")?;
    if draw(&mut studio, &scene)? == drawn_anew(&scene)? { Ok(()) } else { Err("at last it differs".into()) }
}

/// As the lamp of `everything` comes near, edges are halved more often; and as meshes change, what is subdivided does.
fn subdivided_otherwise() -> Result<(), Failed> {
    let (mut scene, mut studio) =
        (everything(), technique(RecordingStrategy::CachedBundles, EncodingStrategy::PerPass)?);
    draw(&mut studio, &scene)?;
    draw(&mut studio, &scene)?;
    let shadows = |studio: &Studio| counts(studio, |pass| pass.process == "shadow casters");
    let (recorded, replayed) = shadows(&studio);
    expect(recorded == 0 && replayed > 0, || format!("{recorded} and {replayed}"))?;
    // So near to the floor and its neighbours that they are cut finer.
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        scene.replace_object(handle, RenderObject { position: object.position + DVec3::Y * 1.5, ..object })?;
    }
    if draw(&mut studio, &scene)? != drawn_anew(&scene)? {
        return Err("nearer to the lamp it differs".into());
    }
    let (recorded, _) = shadows(&studio);
    expect(recorded > 0, || "nothing was recorded nearer to the lamp".to_owned())?;
    let mesh = scene.as_scene_ref().meshes[3];
    scene.replace(mesh, drawloom_testing::scenes::cube_with_flipped_normals())?;
    if draw(&mut studio, &scene)? == drawn_anew(&scene)? { Ok(()) } else { Err("with another mesh it differs".into()) }
}

/// A process that reads what it draws into.
struct Ouroboros;

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

/// Draws what the other reads.
struct Head;

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
    let (device, queue) = device()?;
    let backend = WgpuBackend::new(device, queue)?
        .recording_strategy(RecordingStrategy::CachedBundles)?
        .encoding_strategy(EncodingStrategy::OnSubmit);
    let builder = Renderer::builder(backend).deferred(Deferred::to_picture()).process(Head).process(Ouroboros);
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
