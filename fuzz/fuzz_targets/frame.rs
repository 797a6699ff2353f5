//! Frames of any scene: a picture without NaN that is the same on any number of workers, or an error that names what is
//! wrong and is the same on all backends.

#![no_main]

use std::sync::{Arc, LazyLock};

use arbitrary::Arbitrary;
use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer};
use drawloom_fuzz::scenes::{AnyScene, Drawer, World, check_error, quality};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Input {
    scene: AnyScene,
    quality: u8,
    chunk: u8,
    occlusion: u8,
}

static SCHEDULERS: LazyLock<[Arc<Scheduler>; 2]> =
    LazyLock::new(|| [1, 2].map(|workers| Arc::new(Scheduler::new(workers).unwrap())));

fuzz_target!(|input: Input| {
    let world = World::new(&input.scene);
    let scene = world.as_scene_ref();
    let quality = quality(input.quality);
    let [one, two] = &*SCHEDULERS;

    let mut serial = Drawer::new(one, |builder| builder.quality(quality).granularity(Granularity::PerCamera));
    let drawn = serial.draw(scene);
    let pictures = drawn.as_ref().map(|frame| {
        frame.check_radiance();
        frame.pictures()
    });

    let chunk = Granularity::Chunk(usize::from(input.chunk).max(1));
    let mut parallel = Drawer::new(two, |builder| builder.quality(quality).granularity(chunk).instancing(false));
    assert!(parallel.draw(scene).as_ref().map(|frame| frame.pictures()) == pictures, "two workers, {chunk:?}");

    let occlusion = Quality::OCCLUSION_TILE_SIZES[usize::from(input.occlusion) % Quality::OCCLUSION_TILE_SIZES.len()];
    let mut occluded = Drawer::with_quality(two, Quality { occlusion: Some(occlusion), ..quality });
    let drawn = occluded.draw(scene);
    assert!(
        !world.has_true_bounds() || drawn.as_ref().map(|frame| frame.pictures()) == pictures,
        "occlusion by tiles of {occlusion}"
    );

    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, submitter) = builder.build(Arc::clone(two)).unwrap();
    match renderer.record(scene) {
        Ok(recorded) => {
            submitter.submit(recorded).unwrap();
            assert!(pictures.is_ok(), "the null backend draws what the software backend refuses: {:?}", pictures.err());
        }
        Err(error) => assert_eq!(Some(&check_error(&error)), pictures.err()),
    }
});
