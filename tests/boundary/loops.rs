//! Frames of a loop, which submits and awaits them on threads of its own.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use drawloom::backend::NullBackend;
use drawloom::fence::Fence;
use drawloom::process::Deferred;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{Buffering, FencePoint, FinishedFrame, FrameLoop, Renderer};

use crate::engine::{OwnBackend, OwnDevice, OwnProcess};
use crate::frames::worlds;
use crate::fuse::{self, Kind, Owned};
use crate::{LONG, wait_until, within_time};

type Backend = OwnBackend<NullBackend>;

fn new_loop(buffering: Buffering) -> FrameLoop<Backend> {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(OwnBackend::new(NullBackend, false)).pipeline(Deferred::to_picture());
    let (renderer, submitter) = builder.process(OwnProcess::new()).build(scheduler).unwrap();
    FrameLoop::new(renderer, submitter, buffering).unwrap()
}

/// A scene without cached views, so that no frame relies on another one.
fn scene() -> Scene {
    let [mut scene, _] = worlds();
    scene.cameras.truncate(1);
    scene
}

/// What became of frames.
#[derive(Default)]
struct Told {
    drawn: usize,
    errors: Vec<String>,
}

impl Told {
    fn add(&mut self, finished: Vec<FinishedFrame<Backend>>) {
        for frame in finished {
            match frame.outcome {
                Ok(submitted) => {
                    self.drawn += 1;
                    // Its destructor is the engine's to catch.
                    let dropped = catch_unwind(AssertUnwindSafe(|| drop(submitted)));
                    dropped.unwrap_or_else(std::mem::forget);
                }
                Err(error) => self.errors.push(error.to_string()),
            }
        }
    }

    /// Draws a frame that has all that an engine adds to one.
    fn draw(&mut self, frames: &mut FrameLoop<Backend>, scene: &Scene) {
        let (slot, finished) = frames.begin();
        self.add(finished);
        match frames.renderer().record(scene.as_scene_ref()) {
            Ok(mut recorded) => {
                let captured = Owned::new("captured by a callback", ());
                recorded.fence_at(FencePoint::End).unwrap().on_set(move |_| {
                    let _ = &captured;
                    fuse::call(Kind::Hook, "on_set");
                });
                let captured = Owned::new("captured by what follows the submission", ());
                slot.submit_then(recorded, move |_| {
                    let _ = &captured;
                    fuse::call(Kind::Hook, "after");
                });
            }
            Err(error) => self.errors.push(error.to_string()),
        }
    }
}

const FRAMES: usize = 4;

/// Each call of a kind panics once. Returns how many did.
fn each_call_panics_once(kind: Kind, buffering: Buffering) -> usize {
    let (scene, alive_before) = (scene(), fuse::alive());
    for index in 0.. {
        let mut frames = new_loop(buffering);
        let mut told = Told::default();
        fuse::arm(kind, index, index % 2 == 0);
        let ended = catch_unwind(AssertUnwindSafe(|| {
            (0..FRAMES).for_each(|_| told.draw(&mut frames, &scene));
            if index % 3 == 0 {
                // Nobody is told of the frames in flight.
                drop(frames);
                return;
            }
            let (renderer, finished) = frames.finish();
            told.add(finished);
            drop(renderer);
            assert_eq!(told.drawn + told.errors.len(), FRAMES, "{:?}", told.errors);
        }));
        let blown = fuse::disarm();
        assert!(ended.is_ok(), "{kind:?} {index} ({blown:?}) unwinds");
        assert!(told.errors.len() <= usize::from(blown.is_some()), "{blown:?}: {:?}", told.errors);
        let is_told = match blown {
            Some("after") => index % 3 == 0 || told.errors[0].contains("panicked after the submission"),
            Some("submit") => index % 3 == 0 || told.errors[0].contains("the submission of the frame panicked"),
            _ => true,
        };
        assert!(is_told, "{blown:?}: {:?}", told.errors);
        assert_eq!(fuse::alive(), alive_before, "after {kind:?} {index} ({blown:?})");
        if blown.is_none() {
            return index;
        }
    }
    0
}

fn each_call_of_a_loop_panics_once(kind: Kind, least: usize) {
    within_time(move || {
        for buffering in Buffering::ALL {
            let count = each_call_panics_once(kind, buffering);
            assert!(count >= least, "only {count} calls of {kind:?} panicked");
        }
    });
}

#[test]
fn a_loop_goes_on_after_a_panic_in_any_call_of_the_backend() {
    each_call_of_a_loop_panics_once(Kind::Backend, 20 * FRAMES);
}

#[test]
fn a_loop_goes_on_after_a_panic_in_a_callback_or_after_a_submission() {
    each_call_of_a_loop_panics_once(Kind::Hook, 2 * FRAMES);
}

#[test]
fn a_loop_goes_on_after_a_panic_in_any_destructor() {
    each_call_of_a_loop_panics_once(Kind::Destructor, 3 * FRAMES);
}

#[test]
fn a_loop_goes_on_after_a_panic_in_any_call_of_the_subscriber() {
    each_call_of_a_loop_panics_once(Kind::Subscriber, 100);
}

/// What would have followed a submission is dropped when the frame is refused, on the device thread.
#[test]
fn a_loop_goes_on_after_a_frame_is_refused_and_its_captures_panic() {
    within_time(|| {
        let scene = scene();
        for with_device in [false, true] {
            let mut frames = new_loop(Buffering::Double);
            let mut told = Told::default();
            let (slot, _) = frames.begin();
            let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
            let (setter, fence) = Fence::new("terrain");
            if with_device {
                setter.advance_by(OwnDevice::new());
                recorded.submit_after(&fence, LONG);
                fuse::arm(Kind::Hook, 0, true);
            } else {
                recorded.submit_after(&fence, Duration::ZERO);
                fuse::arm(Kind::Destructor, 0, false);
            }
            let captured = Owned::new("captured by what follows the submission", ());
            slot.submit_then(recorded, move |_| drop(captured));
            (0..FRAMES).for_each(|_| told.draw(&mut frames, &scene));
            told.add(frames.finish().1);
            assert_eq!(fuse::disarm().is_some_and(|name| name == "advance"), with_device);
            assert_eq!((told.drawn, told.errors.len()), (FRAMES, 1), "{:?}", told.errors);
            assert!(told.errors[0].contains("terrain"), "{:?}", told.errors);
            assert_eq!(told.errors[0].contains("panicked"), with_device, "{:?}", told.errors);
        }
    });
}

/// Nobody takes the last frames of a loop that has ended itself. They are dropped with it, or with a slot that is left.
#[test]
fn a_loop_that_has_ended_itself_is_dropped_though_its_last_frames_panic() {
    within_time(|| {
        let mut frames = new_loop(Buffering::Triple);
        let scene = scene();
        let left = frames.begin().0;
        let (give, take) = mpsc::channel::<FrameLoop<Backend>>();
        let (done, is_done) = mpsc::channel();
        let (slot, _) = frames.begin();
        let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
        slot.submit_then(recorded, move |_| {
            drop(take.recv().unwrap());
            done.send(()).unwrap();
        });
        give.send(frames).unwrap();
        is_done.recv_timeout(LONG).expect("it hangs");
        // Of the loop's values, the submission is left, and with it a destructor.
        wait_until(|| fuse::alive() == 1, "the loop does not end");
        thread::sleep(Duration::from_millis(50));
        fuse::arm(Kind::Destructor, 0, true);
        assert!(catch_unwind(AssertUnwindSafe(|| drop(left))).is_ok(), "it unwinds");
        wait_until(|| fuse::alive() == 0, "the submission is kept");
        assert_eq!(fuse::disarm(), Some("submission"));
    });
}

/// What a thread of the loop does with it.
type Use = fn(FrameLoop<Backend>);

/// Has a thread of a loop use the loop: the one that submits, or the one that waits for the device. Returns what tells
/// when it has done so.
fn use_on_own_thread(after_submission: bool, frames_before: usize, use_it: Use) -> Receiver<()> {
    let scene = scene();
    let mut frames = new_loop(Buffering::Triple);
    let (done, is_done) = mpsc::channel();
    for _ in 0..frames_before {
        Told::default().draw(&mut frames, &scene);
    }
    let (slot, _) = frames.begin();
    let mut recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
    let drawn = recorded.fence_at(FencePoint::End).unwrap();
    let place = Arc::new(Mutex::new(None));
    let held = place.lock().unwrap();
    let take = {
        let place = Arc::clone(&place);
        move || {
            // It waits until the loop is there.
            let frames: FrameLoop<Backend> = place.lock().unwrap().take().unwrap();
            use_it(frames);
            done.send(()).unwrap();
        }
    };
    if after_submission {
        slot.submit_then(recorded, move |_| take());
    } else {
        drawn.on_set(move |_| take());
        slot.submit(recorded);
    }
    let mut held = held;
    *held = Some(frames);
    drop(held);
    is_done
}

#[test]
fn a_thread_of_the_loop_can_end_the_loop() {
    within_time(|| {
        let drop_it: Use = drop;
        let finish: Use = |frames| drop(frames.finish());
        let begin_and_drop: Use = |mut frames| {
            let scene = scene();
            // More than the buffering allows.
            for _ in 0..5 {
                let (slot, _) = frames.begin();
                let recorded = frames.renderer().record(scene.as_scene_ref()).unwrap();
                slot.submit(recorded);
            }
        };
        for use_it in [drop_it, finish, begin_and_drop] {
            for after_submission in [true, false] {
                for frames_before in 0..3 {
                    let is_done = use_on_own_thread(after_submission, frames_before, use_it);
                    is_done.recv_timeout(LONG).expect("it hangs");
                }
            }
        }
    });
}
