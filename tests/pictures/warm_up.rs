//! Frames that are drawn before the first one.

use std::sync::Arc;

use drawloom::backend::{Backend, BackendError, Picture, SoftwareBackend, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Blend, Material};
use drawloom::task::Scheduler;
use drawloom::view::LightClass;
use drawloom::{Renderer, RendererBuilder, Submitter, WarmUp};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::everything::{class_of, everything, everything_with_mirror, glasses};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::history::accumulates;
use crate::sampled_views::{MIRROR, SURFACE};

pub const CASES: &[Case] = &[
    ("after_a_warm_up_lights_glass_and_mirrors_come_and_go_without_new_pipelines", no_new_pipelines),
    ("frames_after_a_warm_up_are_those_of_a_new_renderer", same_frames),
    ("frames_after_a_warm_up_in_software_are_those_of_a_new_renderer", same_frames_in_software),
];

/// The shipped processes and one with a history. Shadow maps are drawn every third frame.
fn with_memory<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    let quality = Quality::balanced();
    let quality = Quality { shadows: ShadowQuality { interval: 3, side: 64, ..quality.shadows }, ..quality };
    accumulates(builder.pipeline(Deferred::to_picture()).quality(quality))
}

/// The shipped processes and a mirror.
fn with_mirror(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.pipeline(Deferred::to_picture()).process(MIRROR)
}

fn no_new_pipelines() -> Result<(), Failed> {
    let mut scene = everything_with_mirror(SURFACE);
    let count = |fixture: &Fixture| fixture.renderer.backend().resources().pipelines;
    let (mut warm, mut cold) = (Fixture::with(2, with_mirror)?, Fixture::with(2, with_mirror)?);
    let mut warm_up = WarmUp::new(scene.as_scene_ref());
    while let Some(frame) = warm_up.record_next(&mut warm.renderer)? {
        warm.submit(frame)?;
    }
    cold.draw(&scene)?;
    let (made, made_in_first) = (count(&warm), count(&cold));
    let (lights, cameras, glasses) = (scene.lights.clone(), scene.cameras.clone(), glasses(&scene));
    let mut random = Random::new();
    for step in 0..16 {
        let absent = random.below(1 << LightClass::COUNT);
        let is_there = |class: LightClass| absent & 1 << class.index() == 0;
        scene.lights = lights.iter().copied().filter(|light| is_there(class_of(light))).collect();
        scene.cameras = cameras[..1 + random.below(2)].to_vec();
        let has_glass = random.below(2) == 1;
        for (handle, glass) in &glasses {
            let blend = if has_glass { glass.blend } else { Blend::None };
            scene.replace(*handle, Material { blend, ..glass.clone() })?;
        }
        if warm.draw(&scene)? != cold.draw(&scene)? {
            return Err(format!("step {step} draws another picture").into());
        }
        if count(&warm) != made {
            return Err(format!("{made} pipelines, {} after step {step}", count(&warm)).into());
        }
    }
    if count(&cold) > made_in_first { Ok(()) } else { Err("no step requires another pipeline".into()) }
}

/// The pictures, and what is accumulated, of some frames in which the boxes move, after the first frames of a warm-up
/// in which these are elsewhere.
fn frames<B: Backend>(
    (mut renderer, submitter): (Renderer<B>, Submitter<B>),
    warm_up_frames: usize,
    read: impl Fn(&B::Submission, &str) -> Result<Picture, BackendError>,
) -> Result<Vec<Picture>, Failed> {
    let (mut scene, mut pictures) = (everything(), Vec::new());
    scene.cameras[0].size = [24, 16];
    let mut warm_up = WarmUp::new(scene.as_scene_ref());
    for _ in 0..warm_up_frames {
        let frame = warm_up.record_next(&mut renderer)?.ok_or("the warm-up has fewer frames")?;
        submitter.submit(frame)?;
    }
    let boxes: Vec<_> = scene.objects().skip(2).take(4).collect();
    for _ in 0..5 {
        for handle in &boxes {
            let mut object = scene.object(*handle)?;
            object.position.z += 0.4;
            scene.replace_object(*handle, object)?;
        }
        let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
        pictures.extend([read(&submission, "picture")?, read(&submission, "sum")?]);
    }
    Ok(pictures)
}

/// Compares the frames after no frame of a warm-up, after all of them, and after some.
fn expect_same_frames(draw: impl Fn(usize) -> Result<Vec<Picture>, Failed>) -> Result<(), Failed> {
    let expected = draw(0)?;
    for warm_up_frames in [WarmUp::new(everything().as_scene_ref()).frames_left(), 3] {
        if draw(warm_up_frames)? != expected {
            return Err(format!("another picture after {warm_up_frames} frames of a warm-up").into());
        }
    }
    Ok(())
}

fn same_frames() -> Result<(), Failed> {
    expect_same_frames(|warm_up_frames| {
        let Fixture { renderer, submitter } = Fixture::with(2, with_memory)?;
        frames((renderer, submitter), warm_up_frames, |submission, target| submission.read(0, target))
    })
}

fn same_frames_in_software() -> Result<(), Failed> {
    expect_same_frames(|warm_up_frames| {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = with_memory(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))));
        let built = builder.build(scheduler)?;
        frames(built, warm_up_frames, |submission, target| submission.read(0, target))
    })
}
