//! The objects of the frame before.

use std::sync::Arc;

use drawloom::backend::{Backend, SoftwareBackend, WgpuSubmission};
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Deferred, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel,
    PassInputs, RenderProcess, TargetSize,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Changes, PREVIOUS_OBJECTS, RenderObject, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("each_object_is_found_where_it_was_in_the_frame_before", where_they_were),
    ("frames_in_flight_find_the_objects_of_the_frame_submitted_before", in_flight),
    ("what_was_before_frames_that_did_not_read_it_is_not_found", read_again),
    ("the_software_backend_refuses_to_keep_objects", on_software),
];

/// Stores all that shaders know of the frame's objects in the target "now", a column of pixels for each, and of those
/// of the frame before in the target "before".
#[derive(Clone, Copy)]
struct Store;

const OBJECTS: usize = 1024;
const WORDS: usize = 15;

impl RenderProcess for Store {
    fn name(&self) -> &str {
        "store"
    }

    fn declare(&self, declare: &mut Declare) {
        for target in ["now", "before"] {
            declare.clears_color(target, Format::R32Uint, ClearColor::Value([0.0; 4]));
            declare.size(target, TargetSize::Fixed([OBJECTS as u32, WORDS as u32]));
        }
        declare.reads_column(PREVIOUS_OBJECTS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(3) @binding(0) var<storage, read> previous_objects: array<Object>;

            struct Words {
                @location(0) now: vec4<u32>,
                @location(1) before: vec4<u32>,
            }

            fn word(object: Object, index: u32) -> u32 {
                switch index {
                    case 0u: { return object.material; }
                    case 1u: { return object.index; }
                    case 2u, 3u, 4u: { return object.position_low[index - 2u]; }
                    case 5u, 6u, 7u: { return bitcast<u32>(object.position_high[index - 5u]); }
                    case 8u, 9u, 10u, 11u: { return bitcast<u32>(object.orientation[index - 8u]); }
                    default: { return bitcast<u32>(object.scale[index - 12u]); }
                }
            }

            @fragment
            fn fragment(in: FullScreenPixel) -> Words {
                let pixel = vec2<u32>(in.position.xy);
                let count = min(arrayLength(&objects), arrayLength(&previous_objects));
                let object = min(pixel.x, count - 1u);
                let now = word(objects[object], pixel.y);
                let before = word(previous_objects[object], pixel.y);
                return Words(vec4<u32>(now), vec4<u32>(before));
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Store {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, _: &mut [Vector4<R>]) -> bool {
        false
    }
}

fn stores<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    builder.process(Store).output("now").output("before")
}

/// The words of each object.
type Stored = Vec<[u32; WORDS]>;

fn read(submission: &WgpuSubmission, target: &str, objects: usize) -> Result<Stored, Failed> {
    let picture = submission.read(0, target)?;
    let words: Vec<u32> =
        picture.bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    Ok((0..objects).map(|object| std::array::from_fn(|word| words[word * OBJECTS + object])).collect())
}

/// Checks a frame of this many objects against the one before it. Returns what it stored of its own objects.
fn check(submission: &WgpuSubmission, objects: usize, before: &Stored) -> Result<Stored, Failed> {
    let now = read(submission, "now", objects)?;
    let found = read(submission, "before", objects)?;
    for (object, words) in found.iter().enumerate() {
        let expected = before.get(object).unwrap_or(&now[object]);
        if words != expected {
            return Err(format!("object {object} was {expected:?}, not {words:?}, and is {:?}", now[object]).into());
        }
    }
    Ok(now)
}

fn where_they_were() -> Result<(), Failed> {
    for seed in 0..4 {
        let mut world = ChangingWorld::new(seed, 40);
        // Only what objects are matters.
        for camera in &mut world.scene.cameras {
            camera.size = [16, 16];
        }
        let mut fixture = Fixture::with(2, stores)?;
        let (mut before, mut moved, mut random) = (Stored::new(), 0, Random::stream(seed));
        for frame in 0..60 {
            let scene = world.as_scene_ref();
            let objects = scene.positions.len().min(OBJECTS);
            let recorded = fixture.renderer.record(scene)?;
            let now = check(&fixture.submit(recorded)?, objects, &before)
                .map_err(|error| format!("seed {seed}, frame {frame}: {error:?}"))?;
            moved += usize::from(now != before);
            before = now;
            match random.below(4) {
                // A frame at rest, or one that is dropped.
                0 => {
                    let rest = SceneRef { changes: Changes::NONE, ..world.as_scene_ref() };
                    let recorded = fixture.renderer.record(rest)?;
                    check(&fixture.submit(recorded)?, objects, &before)?;
                }
                1 => {
                    world.step()?;
                    drop(fixture.renderer.record(world.as_scene_ref())?);
                }
                _ => {}
            }
            world.step()?;
        }
        if moved < 10 {
            return Err(format!("seed {seed}: objects moved in {moved} frames").into());
        }
    }
    Ok(())
}

/// Scenes of more and fewer objects, which have moved since the scene before.
fn scenes(counts: &[usize]) -> Result<Vec<Scene>, Failed> {
    let moved = |(step, count): (usize, &usize)| {
        let mut scene = field(*count);
        scene.cameras.truncate(1);
        scene.cameras[0].size = [16, 16];
        let handles: Vec<_> = scene.objects().collect();
        for handle in handles {
            let object = scene.object(handle)?;
            let position = object.position + DVec3::X * step as f64;
            scene.replace_object(handle, RenderObject { position, ..object })?;
        }
        Ok(scene)
    };
    counts.iter().enumerate().map(moved).collect()
}

fn in_flight() -> Result<(), Failed> {
    let counts = [3, 3, 500, 2, 500, 900, 900];
    let scenes = scenes(&counts)?;
    let mut fixture = Fixture::with(2, stores)?;
    let mut before = Stored::new();
    for pair in [0..1, 1..3, 3..5, 5..7] {
        let recorded: Vec<_> =
            scenes[pair.clone()].iter().map(|scene| fixture.record(scene)).collect::<Result<_, _>>()?;
        for (index, recorded) in pair.zip(recorded) {
            before = check(&fixture.submit(recorded)?, counts[index], &before)
                .map_err(|error| format!("frame {index}: {error:?}"))?;
        }
    }
    Ok(())
}

fn read_again() -> Result<(), Failed> {
    let scenes = scenes(&[5, 5, 5])?;
    let mut fixture = Fixture::with(2, |builder| stores(builder.pipeline(Deferred::to_picture())))?;
    for (index, scene) in scenes.iter().enumerate() {
        if index == 1 {
            let renderer = &mut fixture.renderer;
            ["now", "before"].into_iter().try_for_each(|target| renderer.remove_output(target))?;
            renderer.remove_process("store")?;
            let recorded = fixture.record(scene)?;
            fixture.submit(recorded)?;
            let renderer = &mut fixture.renderer;
            renderer.add_process(Store)?;
            ["now", "before"].into_iter().try_for_each(|target| renderer.add_output(target))?;
        } else {
            let recorded = fixture.record(scene)?;
            // It is as if the objects were new.
            check(&fixture.submit(recorded)?, 5, &Stored::new())?;
        }
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(1)?);
    let builder = stores(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))));
    let (mut renderer, _) = builder.build(scheduler)?;
    match renderer.record(scenes(&[3])?[0].as_scene_ref()) {
        Ok(_) => Err("it has no such objects".into()),
        Err(error) if error.to_string().contains("does not keep the objects") => Ok(()),
        Err(error) => Err(error.to_string().into()),
    }
}
