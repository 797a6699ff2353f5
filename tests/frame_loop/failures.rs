//! Frames that fail on the way. Those behind them do not.

use std::time::Duration;

use drawloom::backend::NullBackend;
use drawloom::fence::{Fence, FenceError};
use drawloom::{Buffering, FrameLoop, FrameLoopError, SubmitError};
use drawloom_testing::scenes::field;
use drawloom_testing::simulated_device::SimulatedDevice;

use crate::{LONG, renderer, simulated};

#[test]
fn every_failure_is_told_with_its_frame() {
    let scene = field(5);
    let mut frames = simulated(Duration::ZERO, Buffering::Triple);
    let mut all = Vec::new();
    let (mut other, _other_submitter) = renderer(SimulatedDevice::new(NullBackend, Duration::ZERO), 1);
    for number in 1..=6 {
        let (slot, finished) = frames.begin();
        all.extend(finished);
        let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        match number {
            2 => slot.submit_then(recorded, |_| std::panic::resume_unwind(Box::new("as planned"))),
            3 => slot.submit(other.record(scene.as_scene_ref()).unwrap()),
            4 => {
                let (setter, fence) = Fence::new("never");
                recorded.submit_after(&fence, Duration::from_millis(1));
                slot.submit(recorded);
                // Held until the wait is over.
                std::thread::sleep(Duration::from_millis(20));
                drop(setter);
            }
            _ => slot.submit(recorded),
        }
    }
    all.extend(frames.finish().1);
    assert_eq!(all.len(), 6);
    for frame in all {
        match (frame.number, frame.outcome) {
            (1 | 5 | 6, Ok(_)) => {}
            (2, Err(FrameLoopError::Panicked { message })) => assert_eq!(message, "as planned"),
            (3, Err(FrameLoopError::Submit(SubmitError::ForeignFrame))) => {}
            (4, Err(FrameLoopError::Submit(SubmitError::Fence(FenceError::TimedOut { .. })))) => {}
            (number, outcome) => panic!("frame {number}: {:?}", outcome.err()),
        }
    }
}

#[test]
fn a_device_that_hangs_costs_one_frame() {
    let scene = field(5);
    let backend = SimulatedDevice::new(NullBackend, Duration::ZERO).with_next_times([Duration::from_millis(400)]);
    let (renderer, submitter) = renderer(backend, 1);
    let mut frames = FrameLoop::new(renderer, submitter, Buffering::SameFrame).unwrap();
    frames.set_device_limit(Duration::from_millis(20));
    let mut all = Vec::new();
    for number in 1..=3 {
        let (slot, finished) = frames.begin();
        all.extend(finished);
        // The others wait until the device is back.
        if number == 2 {
            frames.set_device_limit(LONG);
        }
        let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        slot.submit(recorded);
    }
    all.extend(frames.finish().1);
    let [first, second, third] = &all[..] else { panic!("{} frames", all.len()) };
    let Err(FrameLoopError::Unfinished(FenceError::TimedOut { waits, .. })) = &first.outcome else {
        panic!("{:?}", first.outcome.as_ref().err());
    };
    assert!(waits.iter().any(|wait| wait.waiter == "thread \"drawloom completion\""), "{waits:?}");
    assert!(second.outcome.is_ok() && third.outcome.is_ok());
}

#[test]
fn a_frame_that_fails_while_it_is_recorded_frees_its_slot() {
    let empty = drawloom::scene::Scene::new();
    let scene = field(5);
    let mut frames = simulated(Duration::ZERO, Buffering::SameFrame);
    for _ in 0..3 {
        let (slot, _) = frames.begin();
        assert!(frames.renderer().record(empty.as_scene_ref()).is_err());
        drop(slot);
    }
    let (slot, _) = frames.begin();
    let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
    slot.submit(recorded);
    assert!(frames.finish().1[0].outcome.is_ok());
}

#[test]
fn another_backend_takes_over_while_frames_of_the_one_before_are_in_flight() {
    let scene = field(5);
    let backend = || SimulatedDevice::new(NullBackend, Duration::from_millis(5));
    let (renderer, submitter) = renderer(backend(), 2);
    let mut frames = FrameLoop::new(renderer, submitter, Buffering::Triple).unwrap();
    let mut all = Vec::new();
    let mut late = None;
    for number in 1..=5 {
        let (slot, finished) = frames.begin();
        all.extend(finished);
        let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        match number {
            2 => late = Some((slot, recorded)),
            3 => {
                // Recorded and handed over before, so it goes to the backend before.
                slot.submit(recorded);
                frames.replace_backend(backend());
                let (slot, recorded) = late.take().unwrap();
                slot.submit(recorded);
            }
            _ => slot.submit(recorded),
        }
    }
    all.extend(frames.finish().1);
    all.sort_by_key(|frame| frame.number);
    let outcomes: Vec<_> = all.iter().map(|frame| frame.outcome.as_ref().err()).collect();
    let [None, Some(FrameLoopError::Submit(SubmitError::ForeignFrame)), None, None, None] = outcomes[..] else {
        panic!("{outcomes:?}");
    };
}

#[test]
fn a_submitter_of_another_renderer_is_refused() {
    let (one, _submitter) = renderer(NullBackend, 1);
    let (_renderer, other) = renderer(NullBackend, 1);
    let error = FrameLoop::new(one, other, Buffering::Double).err();
    assert!(matches!(error, Some(FrameLoopError::ForeignSubmitter)));
}

#[test]
fn a_frame_whose_callback_panics_keeps_its_slot_until_it_is_drawn() {
    let scene = field(5);
    let mut frames = simulated(Duration::from_millis(40), Buffering::SameFrame);
    let (slot, _) = frames.begin();
    let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
    let drawn = recorded.fence_at(drawloom::FencePoint::End).unwrap();
    slot.submit_then(recorded, |_| std::panic::resume_unwind(Box::new("as planned")));
    let (_slot, finished) = frames.begin();
    assert!(drawn.is_set(), "the slot was free while the device drew");
    assert!(matches!(&finished[0].outcome, Err(FrameLoopError::Panicked { .. })));
}
