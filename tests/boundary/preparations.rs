//! What the engine has done beside frames: pipelines, jobs, loads, pictures of post-processing.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use drawloom::backend::{NullBackend, Picture, SoftwareBackend};
use drawloom::process::Deferred;
use drawloom::scene::{AssetLoader, Material, Scene};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
use drawloom_async_post::{AsyncPost, AsyncStep, StepFrame, StepSource};

use crate::engine::{OwnBackend, OwnProcess};
use crate::frames::worlds;
use crate::fuse::{self, Kind, Owned};
use crate::{wait_until, within_time};

#[test]
fn a_panic_of_a_preparation_is_an_error_that_names_it() {
    within_time(|| {
        let [scene, _] = worlds();
        for workers in [1, 2] {
            let scheduler = Arc::new(Scheduler::new(workers).unwrap());
            let builder = Renderer::builder(OwnBackend::new(NullBackend, false)).pipeline(Deferred::to_picture());
            let (mut renderer, submitter) = builder.process(OwnProcess::new()).build(scheduler).unwrap();
            for has_text in [true, false] {
                let prepare = |renderer: &mut Renderer<_>, in_background: bool| -> Result<(), FrameError> {
                    if in_background {
                        return renderer.prepare_pipelines_in_background(scene.as_scene_ref())?.wait()?;
                    }
                    renderer.prepare_pipelines(scene.as_scene_ref())
                };
                for in_background in [false, true] {
                    fuse::arm(Kind::Backend, 0, has_text);
                    let outcome = catch_unwind(AssertUnwindSafe(|| prepare(&mut renderer, in_background)));
                    assert_eq!(fuse::disarm(), Some("prepare_pipelines"));
                    let error = outcome.expect("it unwinds").unwrap_err().to_string();
                    assert!(error.contains("the backend's prepare_pipelines panicked"), "{error}");
                    fuse::arm(Kind::Process, 0, has_text);
                    let outcome = catch_unwind(AssertUnwindSafe(|| prepare(&mut renderer, in_background)));
                    assert_eq!(fuse::disarm(), Some("draws"));
                    let error = outcome.expect("it unwinds").unwrap_err().to_string();
                    assert!(error.contains("\"the engine's process\""), "{error}");
                    prepare(&mut renderer, in_background).unwrap();
                }
                if workers > 1 {
                    // The work between frames may panic in the place of the call that is to.
                    continue;
                }
                // Histories that could not be forgotten are forgotten by the frame after the next.
                fuse::arm(Kind::Backend, 0, has_text);
                let forgotten = catch_unwind(AssertUnwindSafe(|| renderer.forget_previous_frames()));
                assert!(forgotten.is_ok());
                let error = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err().to_string();
                assert_eq!(fuse::disarm(), Some("forget_histories"));
                assert!(error.contains("the backend's forget_histories panicked"), "{error}");
                drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
            }
        }
    });
}

/// Preparations whose handles are dropped leave nothing behind, on any number of workers: neither jobs, nor a scheduler
/// that its own queue keeps by way of the backend.
#[test]
fn preparations_that_nobody_waits_for_are_not_kept() {
    within_time(|| {
        for workers in [1, 2, 3] {
            let [scene, _] = worlds();
            let scheduler = Arc::new(Scheduler::new(workers).unwrap());
            let backend = OwnBackend::new(SoftwareBackend::new(Arc::clone(&scheduler)), false);
            let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
            let (mut renderer, submitter) = builder.build(Arc::clone(&scheduler)).unwrap();
            for preparation in 0..300 {
                drop(renderer.prepare_pipelines_in_background(scene.as_scene_ref()).unwrap());
                if preparation % 100 == 0 {
                    drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
                }
            }
            if workers == 1 {
                let state = format!("{scheduler:?}");
                assert!(state.contains("background_jobs: 0"), "{state}");
            }
            let scheduler = {
                let weak = Arc::downgrade(&scheduler);
                drop(scheduler);
                weak
            };
            drop((renderer, submitter));
            // Other workers may still run the last job.
            wait_until(|| scheduler.strong_count() == 0, "the scheduler is kept");
        }
    });
}

#[test]
fn a_panic_when_a_failed_frame_is_discarded_is_told_with_why_it_failed() {
    within_time(|| {
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let builder = Renderer::builder(OwnBackend::new(NullBackend, false)).pipeline(Deferred::to_picture());
        let (mut renderer, _submitter) = builder.build(scheduler).unwrap();
        let empty = Scene::new();
        fuse::arm(Kind::Backend, 0, true);
        let outcome = catch_unwind(AssertUnwindSafe(|| renderer.record(empty.as_scene_ref()).map(drop)));
        assert_eq!(fuse::disarm(), Some("discard_frame"));
        let error = outcome.expect("it unwinds").unwrap_err();
        let FrameError::DiscardPanicked { error: before, message } = &error else { panic!("{error}") };
        assert!(matches!(**before, FrameError::NoView) && message == fuse::PLANNED);
        assert!(error.to_string().contains("discard_frame panicked"), "{error}");
    });
}

/// Jobs whose captures, results and errors panic when they are dropped.
#[test]
fn a_panic_in_the_destructor_of_a_job_changes_nothing() {
    within_time(|| {
        let alive_before = fuse::alive();
        for index in 0..8 {
            fuse::arm(Kind::Destructor, index / 2 % 2, index < 4);
            let ended = catch_unwind(AssertUnwindSafe(|| {
                let scheduler = Scheduler::new(1).unwrap();
                let captured = Owned::new("captured by a job", ());
                let one = scheduler.background(move || captured);
                let captured = Owned::new("captured by a job", ());
                let other = scheduler.background(move || drop(captured));
                match index % 2 {
                    // The jobs have not begun when their handles are dropped, and the scheduler is gone.
                    0 => {
                        drop(scheduler);
                        drop((one, other));
                    }
                    _ => {
                        scheduler.run_background(std::time::Duration::from_secs(1));
                        drop((one, other, scheduler));
                    }
                }
            }));
            assert!(fuse::disarm().is_some() && ended.is_ok(), "{index} unwinds");
            assert_eq!(fuse::alive(), alive_before);
        }
    });
}

/// The hooks and the clock of a scheduler, whose captures panic when they are dropped.
#[test]
fn a_panic_in_the_destructor_of_a_hook_changes_nothing() {
    within_time(|| {
        let alive_before = fuse::alive();
        for (index, has_text) in (0..4).map(|index| (index, index % 2 == 0)) {
            fuse::arm(Kind::Destructor, index, has_text);
            let ended = catch_unwind(AssertUnwindSafe(|| {
                let [start, stop, name, clock] = [(); 4].map(|()| Owned::new("captured by a hook", ()));
                let builder = Scheduler::builder().workers(3).on_start(move |_| *start.get());
                let builder = builder.on_stop(move |_| *stop.get());
                let builder = builder.name(move |worker| format!("worker {worker} {:?}", name.get()));
                let builder = builder.timeline_clock(move || {
                    let () = clock.get();
                    std::time::Duration::ZERO
                });
                let scheduler = builder.build().unwrap();
                scheduler.parallel_for(10, 1, |_, _| {}).unwrap();
            }));
            assert!(fuse::disarm().is_some() && ended.is_ok(), "{index} unwinds");
            assert_eq!(fuse::alive(), alive_before);
        }
    });
}

/// An error of the engine's whose destructor may panic.
#[derive(Debug)]
struct OwnError;

impl std::fmt::Display for OwnError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("it is gone")
    }
}

impl std::error::Error for OwnError {}

impl Drop for OwnError {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            fuse::call(Kind::Destructor, "error");
        }
    }
}

#[test]
fn a_panic_in_the_destructor_of_a_load_loses_no_other_load() {
    within_time(|| {
        for unloads in [false, true] {
            let scheduler = Arc::new(Scheduler::new(1).unwrap());
            let mut scene = Scene::new();
            let loader: AssetLoader = scene.assets().loader(&scheduler);
            let captured = Owned::new("captured by a load", ());
            let bad = loader.load("bad", 1, move || -> Result<Material, OwnError> {
                let _ = &captured;
                Err(OwnError)
            });
            let good = loader.load("good", 0, || Ok::<_, OwnError>(Material::default()));
            if unloads {
                scene.unload(bad).unwrap();
                // Its load is dropped when it arrives, ahead of the other.
                fuse::arm(Kind::Destructor, 1, true);
            }
            let received = catch_unwind(AssertUnwindSafe(|| {
                let arrivals = [(); 2].map(|()| scene.receive(&loader));
                assert_eq!(arrivals.iter().map(|arrivals| arrivals.count).sum::<usize>(), 1);
                assert_eq!(arrivals.iter().map(|arrivals| arrivals.errors.len()).sum::<usize>(), usize::from(!unloads));
            }));
            assert_eq!(fuse::disarm(), unloads.then_some("error"));
            assert!(received.is_ok(), "it unwinds");
            assert!(!scene.assets().is_pending(good));
            // A load that has not begun is dropped with the loader.
            let captured = Owned::new("captured by a load", ());
            let _ = loader.load("late", 0, move || {
                let _ = &captured;
                Ok::<_, OwnError>(Material::default())
            });
            fuse::arm(Kind::Destructor, 0, false);
            assert!(catch_unwind(AssertUnwindSafe(|| drop((loader, scheduler)))).is_ok());
            assert_eq!(fuse::disarm(), Some("captured by a load"));
        }
    });
}

struct Step;

impl AsyncStep for Step {
    fn name(&self) -> &str {
        "step"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        frame.picture.clone()
    }
}

#[test]
fn a_panic_of_an_upload_is_an_error() {
    within_time(|| {
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let post = AsyncPost::new(Arc::clone(&scheduler), Step, StepSource::whole("picture"));
        let builder = Renderer::builder(OwnBackend::new(NullBackend, false)).pipeline(Deferred::to_picture());
        let (renderer, _submitter) = builder.build(scheduler).unwrap();
        let [scene, _] = worlds();
        fuse::arm(Kind::Backend, 0, true);
        let begun = catch_unwind(AssertUnwindSafe(|| post.begin_frame(&renderer, &scene.cameras)));
        assert_eq!(fuse::disarm(), Some("upload_picture"));
        assert!(begun.is_ok(), "it unwinds");
        let errors: Vec<_> = post.take_errors().iter().map(ToString::to_string).collect();
        assert!(errors.iter().any(|error| error.contains("upload_picture panicked")), "{errors:?}");
    });
}
