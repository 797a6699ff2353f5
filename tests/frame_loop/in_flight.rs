//! How many frames are in flight, and in which order they finish.

use std::thread;
use std::time::Duration;

use drawloom::backend::NullBackend;
use drawloom::{Buffering, FinishedFrame, FrameLoop};
use drawloom_testing::scenes::field;
use drawloom_testing::simulated_device::SimulatedDevice;

use crate::simulated;

const FRAME_TIME: Duration = Duration::from_millis(4);

/// Draws frames, and returns them in the order in which they finished.
fn draw(
    frames: &mut FrameLoop<SimulatedDevice<NullBackend>>,
    count: usize,
) -> Vec<FinishedFrame<SimulatedDevice<NullBackend>>> {
    let scene = field(20);
    let mut all = Vec::new();
    for _ in 0..count {
        let (slot, finished) = frames.begin();
        all.extend(finished);
        let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        slot.submit(recorded);
    }
    all
}

#[test]
fn no_more_frames_are_in_flight_than_the_buffering_allows() {
    for buffering in Buffering::ALL {
        let mut frames = simulated(FRAME_TIME, buffering);
        let mut all = draw(&mut frames, 12);
        all.extend(frames.finish().1);
        let numbers: Vec<_> = all.iter().map(|frame| frame.number).collect();
        assert_eq!(numbers, (1..=12).collect::<Vec<_>>(), "every frame is told once, in order");
        assert!(all.iter().all(|frame| frame.outcome.is_ok()));
        for (index, frame) in all.iter().enumerate() {
            let times = frame.times;
            assert!(times.begun <= times.recorded && times.recorded <= times.submission_began);
            assert!(times.submission_began <= times.submitted && times.submitted <= times.finished);
            assert!(times.latency() >= FRAME_TIME, "{buffering:?}: {:?}", times.latency());
            // A frame begins after the one has finished whose slot it takes.
            if let Some(earlier) = index.checked_sub(buffering.frames_in_flight()) {
                assert!(times.begun >= all[earlier].times.finished, "{buffering:?}: frame {index}");
            }
        }
        // And not later: with several frames in flight one begins before the frame ahead of it has finished.
        let overlaps = all.windows(2).any(|pair| pair[1].times.begun < pair[0].times.finished);
        assert_eq!(overlaps, buffering != Buffering::SameFrame);
    }
}

#[test]
fn the_buffering_may_change_while_frames_are_in_flight() {
    let mut frames = simulated(FRAME_TIME, Buffering::Triple);
    let mut all = Vec::new();
    for buffering in [Buffering::Triple, Buffering::SameFrame, Buffering::Double, Buffering::Triple] {
        frames.set_buffering(buffering);
        assert_eq!(frames.buffering(), buffering);
        all.extend(draw(&mut frames, 6));
    }
    all.extend(frames.finish().1);
    assert_eq!(all.len(), 24);
    for index in 7..12 {
        assert!(
            all[index].times.begun >= all[index - 1].times.finished,
            "one at a time, from the second of its frames on"
        );
    }
}

#[test]
fn a_slot_that_is_dropped_is_free_again() {
    let mut frames = simulated(Duration::ZERO, Buffering::SameFrame);
    for number in 1..=5 {
        let (slot, finished) = frames.begin();
        assert_eq!((slot.number(), finished.len()), (number, 0));
    }
    assert_eq!(frames.finish().1.len(), 0);
}

#[test]
fn the_engine_is_called_on_the_device_thread_when_a_frame_is_submitted() {
    let scene = field(5);
    let mut frames = simulated(Duration::ZERO, Buffering::Double);
    let (calls, called) = std::sync::mpsc::channel();
    for number in 0..4 {
        let (slot, _) = frames.begin();
        let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        let calls = calls.clone();
        slot.submit_then(recorded, move |submitted| {
            let thread = thread::current().name().map(str::to_owned);
            calls.send((number, thread, submitted.submission.passes.len())).unwrap();
        });
    }
    drop(frames.finish());
    drop(calls);
    let called: Vec<_> = called.iter().collect();
    assert_eq!(called.iter().map(|(number, ..)| *number).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert!(called.iter().all(|(_, thread, passes)| thread.as_deref() == Some("drawloom device") && *passes > 0));
}

#[test]
fn dropping_a_loop_waits_for_its_frames() {
    let scene = field(5);
    let mut frames = simulated(FRAME_TIME, Buffering::Double);
    let (slot, _) = frames.begin();
    let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
    let drawn = recorded.fence_at(drawloom::FencePoint::End).unwrap();
    slot.submit(recorded);
    drop(frames);
    assert!(drawn.is_set());
}

#[test]
fn a_slot_that_outlives_its_loop_submits_nothing() {
    let scene = field(5);
    let mut frames = simulated(Duration::ZERO, Buffering::Double);
    let (slot, _) = frames.begin();
    let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
    let drawn = recorded.fence_at(drawloom::FencePoint::End).unwrap();
    let (_renderer, finished) = frames.finish();
    assert!(finished.is_empty());
    slot.submit(recorded);
    assert!(matches!(drawn.wait(crate::LONG), Err(drawloom::fence::FenceError::Abandoned { .. })));
}
