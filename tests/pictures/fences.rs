//! Fences that the device sets, and frame loops.

use std::sync::mpsc::channel;
use std::time::Duration;

use drawloom::backend::BackendError;
use drawloom::fence::FenceError;
use drawloom::glam::DVec3;
use drawloom::scene::Scene;
use drawloom::{Buffering, FencePoint, FrameLoop};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("fences_at_every_place_are_set_and_change_no_picture", every_place),
    ("what_a_frame_reads_back_is_there_when_its_fence_is_set", read_back_after_fence),
    ("the_fences_of_a_lost_device_are_errors", lost_device),
    ("overlapped_frames_have_the_pictures_of_a_serial_loop", overlapped),
];

/// Longer than anything here takes, also on a machine that is busy.
const LONG: Duration = Duration::from_secs(60);

fn scene() -> Scene {
    let mut scene = field(40);
    scene.cameras.iter_mut().for_each(|camera| camera.size = [64, 48]);
    scene
}

fn every_place() -> Result<(), Failed> {
    let scene = scene();
    let mut fixture = Fixture::new()?;
    let expected = fixture.draw(&scene)?;
    let mut recorded = fixture.record(&scene)?;
    let passes: Vec<_> = recorded.queues().iter().flat_map(|queue| &queue.passes).map(|(pass, _)| *pass).collect();
    let mut fences = vec![recorded.fence_at(FencePoint::End)?];
    for pass in passes {
        let process = &fixture.renderer.plan().processes()[pass.process_index].name;
        fences.push(recorded.fence_at(FencePoint::Pass { process, view: pass.view_index })?);
        fences.push(recorded.fence_at(FencePoint::View(pass.view_index))?);
    }
    let (calls, called) = channel();
    for fence in &fences {
        let calls = calls.clone();
        fence.on_set(move |outcome| drop(calls.send(outcome)));
    }
    drop(calls);
    let submission = fixture.submit(recorded)?;
    fences[0].wait(LONG)?;
    // The device has reached all places before the end, and whoever waited for that has called back for them.
    if fences.iter().any(|fence| fence.set_at().is_none()) {
        return Err("a fence before the end is not set".into());
    }
    if called.iter().collect::<Result<Vec<_>, _>>()?.len() != fences.len() {
        return Err("each fence calls back once".into());
    }
    if submission.read(0, "picture")? != expected {
        return Err("the fences have changed the picture".into());
    }
    Ok(())
}

fn read_back_after_fence() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let scene = scene();
    for _ in 0..5 {
        let mut recorded = fixture.record(&scene)?;
        let picture = recorded.read_back(0, "picture", [0, 0], [64, 48])?;
        let drawn = recorded.fence_at(FencePoint::End)?;
        fixture.submit(recorded)?;
        drawn.wait(LONG)?;
        if picture.try_read()?.is_none() {
            return Err("the frame is drawn, but what it reads back is not there".into());
        }
    }
    Ok(())
}

fn lost_device() -> Result<(), Failed> {
    let (device, queue) = adapter::device().map_err(|error| error.to_string())?;
    let mut fixture =
        Fixture::on((device.clone(), queue), 2, |builder| builder.pipeline(drawloom::process::Deferred::to_picture()))?;
    let scene = scene();
    let mut submitted = fixture.record(&scene)?;
    let in_flight = submitted.fence_at(FencePoint::End)?;
    let mut recorded = fixture.record(&scene)?;
    let never_drawn = [recorded.fence_at(FencePoint::View(0))?, recorded.fence_at(FencePoint::End)?];
    fixture.submit(submitted)?;
    device.destroy();
    // The device may have drawn that frame before. If it has not, that is an error, and nobody waits for ever.
    match in_flight.wait(LONG) {
        Ok(()) | Err(FenceError::Device { .. } | FenceError::Abandoned { .. }) => {}
        Err(error) => return Err(format!("the frame in flight: {error}").into()),
    }
    match fixture.submitter.submit(recorded) {
        Err(error) if matches!(error.backend_error(), Some(BackendError::DeviceLost { .. })) => {}
        other => return Err(format!("the frame behind it: {:?}", other.err()).into()),
    }
    for fence in never_drawn {
        match fence.wait(LONG) {
            Err(FenceError::Device { .. } | FenceError::Abandoned { .. }) => {}
            other => return Err(format!("the frame behind it: {other:?}").into()),
        }
    }
    Ok(())
}

/// The pictures of a camera that moves around, drawn one after the other, and with the next frame recorded while one is
/// submitted.
fn overlapped() -> Result<(), Failed> {
    const FRAMES: usize = 10;
    let move_camera = |scene: &mut Scene, frame: usize| {
        scene.cameras[0].position += DVec3::new((frame as f64).sin(), 0.3, (frame as f64).cos());
    };
    let mut expected = Vec::new();
    let mut fixture = Fixture::new()?;
    let mut moving = scene();
    for frame in 0..FRAMES {
        move_camera(&mut moving, frame);
        expected.push(fixture.draw(&moving)?);
    }
    for workers in [2, 4] {
        for buffering in Buffering::ALL {
            let Fixture { renderer, submitter } =
                Fixture::with(workers, |builder| builder.pipeline(drawloom::process::Deferred::to_picture()))?;
            let mut frames = FrameLoop::new(renderer, submitter, buffering)?;
            let mut moving = scene();
            let mut pictures = Vec::new();
            for frame in 0..FRAMES {
                let (slot, _) = frames.begin();
                move_camera(&mut moving, frame);
                let mut recorded = frames.renderer().record(moving.as_scene_ref())?;
                pictures.push(recorded.read_back(0, "picture", [0, 0], [64, 48])?);
                slot.submit(recorded);
            }
            let (_, finished) = frames.finish();
            for frame in finished {
                frame.outcome?;
            }
            for (frame, (picture, expected)) in pictures.into_iter().zip(&expected).enumerate() {
                if picture.read()? != *expected {
                    return Err(format!("frame {frame} differs: {workers} workers, {buffering:?}").into());
                }
            }
        }
    }
    Ok(())
}
