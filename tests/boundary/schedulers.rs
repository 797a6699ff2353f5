//! Schedulers: hooks of their threads, clocks, jobs and loads. After each panic a frame is drawn on the same workers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use drawloom::backend::SoftwareBackend;
use drawloom::scene::{AssetLoader, Changes, Material, Mesh, Scene, SceneError};
use drawloom::task::{AffinityMask, Scheduler, SchedulerBuilder, SchedulerError};

use crate::engine::ERRORS;
use crate::frames::Fixture;
use crate::fuse::{self, Kind, Owned, PLANNED, call};
use crate::within_time;

/// A scheduler with all hooks that an engine can set, each of which may panic.
fn with_hooks() -> SchedulerBuilder {
    let [name, affinity, start, stop] = [(); 4].map(|()| Owned::new("captured by a hook", ()));
    let builder = Scheduler::builder().workers(3).wake_up_cost(Duration::ZERO);
    let builder = builder.name(move |worker| {
        call(Kind::Hook, "name");
        format!("worker {worker} {:?}", name.get())
    });
    let affinity = move |_| {
        let () = affinity.get();
        call(Kind::Hook, "affinity");
        AffinityMask::new(0..std::thread::available_parallelism().map_or(1, usize::from))
    };
    let builder = if cfg!(feature = "affinity") { builder.affinity(affinity) } else { builder };
    let builder = builder.on_start(move |_| {
        let () = start.get();
        call(Kind::Hook, "on_start");
    });
    builder.on_stop(move |_| {
        let () = stop.get();
        call(Kind::Hook, "on_stop");
    })
}

/// Draws a frame, and compares it with that of a scheduler that knew no panic.
fn draw_on(scheduler: Scheduler, expected: &[u8], name: &str) {
    let mut fixture = Fixture::<SoftwareBackend>::on(Arc::new(scheduler), false);
    let shown = fixture.draw(0, Changes::Unknown).unwrap_or_else(|error| panic!("after {name}: {error}"));
    assert!(shown == expected, "after {name}: the frame is another one");
}

fn expected() -> Vec<u8> {
    Fixture::<SoftwareBackend>::new(1, false).draw(0, Changes::Unknown).unwrap()
}

#[test]
fn a_panic_in_any_hook_is_an_error_that_names_it() {
    within_time(|| {
        let (expected, alive_before) = (expected(), fuse::alive());
        let (mut panicked, mut errors) = (Vec::new(), 0);
        for index in 0.. {
            let has_text = index % 2 == 0;
            fuse::arm(Kind::Hook, index, has_text);
            let errors_before = ERRORS.load(Ordering::Relaxed);
            let built = catch_unwind(|| with_hooks().build());
            let built = built.unwrap_or_else(|_| panic!("hook {index} unwinds"));
            let ended_by = match built {
                Ok(scheduler) => {
                    // The last hooks run when it is dropped.
                    assert!(catch_unwind(AssertUnwindSafe(|| drop(scheduler))).is_ok(), "hook {index} unwinds");
                    None
                }
                Err(SchedulerError::NameHook { panic, .. }) => Some(("name", panic)),
                Err(SchedulerError::AffinityHook { panic, .. }) => Some(("affinity", panic)),
                Err(SchedulerError::StartHook { panic, .. }) => Some(("on_start", panic)),
                Err(error) => panic!("hook {index}: {error}"),
            };
            errors += ERRORS.load(Ordering::Relaxed) - errors_before;
            let Some(blown) = fuse::disarm() else { break };
            assert_eq!(ended_by.as_ref().map_or("on_stop", |(hook, _)| hook), blown);
            if let Some((_, panic)) = ended_by {
                assert_eq!(panic.message == PLANNED, has_text, "{blown}: {panic}");
            }
            assert_eq!(fuse::alive(), alive_before, "after {blown}");
            panicked.push(blown);
            draw_on(with_hooks().build().unwrap(), &expected, blown);
            // Another worker may still run the last job, which keeps the scheduler.
            crate::wait_until(|| fuse::alive() == alive_before, "the scheduler is kept");
        }
        // The subscriber may have panicked at the first of these errors.
        let stops = panicked.iter().filter(|hook| **hook == "on_stop").count();
        assert!(stops >= 2 && (stops - 1..=stops).contains(&errors), "{errors} errors of {stops} ends of threads");
        panicked.sort_unstable();
        panicked.dedup();
        let hooks = ["affinity", "name", "on_start", "on_stop"];
        assert_eq!(panicked, if cfg!(feature = "affinity") { &hooks[..] } else { &hooks[1..] });
    });
}

/// All that a builder was given panics when it is dropped, whether it is built or not.
#[test]
fn a_builder_is_dropped_though_all_that_it_holds_panics() {
    within_time(|| {
        let alive_before = fuse::alive();
        let with_clock = || {
            let captured = Owned::new("captured by a clock", ());
            with_hooks().timeline_clock(move || {
                let () = captured.get();
                Duration::ZERO
            })
        };
        let drop_it = || drop(with_clock());
        let refuse = || assert!(matches!(with_clock().workers(0).build(), Err(SchedulerError::NoWorkers)));
        let build = || drop(with_clock().build().unwrap());
        let all: [&dyn Fn(); 3] = [&drop_it, &refuse, &build];
        for (index, work) in all.iter().enumerate() {
            fuse::arm_each(Kind::Destructor);
            let outcome = catch_unwind(AssertUnwindSafe(work));
            assert!(fuse::disarm().is_some() && outcome.is_ok(), "{index} unwinds");
            assert_eq!(fuse::alive(), alive_before, "{index}");
        }
    });
}

#[test]
fn a_panic_of_the_clock_changes_nothing_but_the_time() {
    within_time(|| {
        let expected = expected();
        for workers in [1, 2] {
            let (mut index, mut panicked) = (0, 0);
            loop {
                let start = std::time::Instant::now();
                let clock = move || {
                    call(Kind::Clock, "clock");
                    start.elapsed()
                };
                let builder = Scheduler::builder().workers(workers).wake_up_cost(Duration::ZERO);
                let scheduler = Arc::new(builder.timeline_clock(clock).build().unwrap());
                let mut fixture = Fixture::<SoftwareBackend>::on(Arc::clone(&scheduler), false);
                fuse::arm(Kind::Clock, index, index % 2 == 0);
                scheduler.timeline().start();
                let drawn = catch_unwind(AssertUnwindSafe(|| {
                    (0..2).map(|_| fixture.draw(0, Changes::Unknown)).collect::<Result<Vec<_>, String>>()
                }));
                let blown = fuse::disarm();
                let drawn = drawn.unwrap_or_else(|_| panic!("clock {index} unwinds"));
                assert!(drawn.unwrap().iter().all(|shown| *shown == expected), "clock {index}: another frame");
                assert_eq!(scheduler.timeline().take().clock_panic.is_some(), blown.is_some(), "clock {index}");
                if blown.is_none() {
                    break;
                }
                panicked += 1;
                // Each of the first calls, then fewer and fewer: a frame has some hundred.
                index += 1 + index / 8;
            }
            assert!(panicked > 10, "only {panicked} calls of the clock panicked");
        }
    });
}

/// What an engine runs on a scheduler, in each of the ways that there are. Returns the error, if there is one.
type Run = fn(&Scheduler) -> Result<(), String>;

fn job(name: &'static str) {
    call(Kind::Hook, name);
}

/// An iterator of the engine's.
struct OwnItems {
    left: usize,
    _dropped: Owned<()>,
}

impl Iterator for OwnItems {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        job("next");
        self.left = self.left.checked_sub(1)?;
        Some(self.left)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for OwnItems {
    fn len(&self) -> usize {
        job("len");
        self.left
    }
}

const RUNS: &[(&str, Run)] = &[
    ("scope", |scheduler| {
        let scope = scheduler.scope(|scope| {
            let captured = Owned::new("captured by a job", ());
            scope.spawn(move |scope, _| {
                let () = captured.get();
                job("spawn");
                scope.spawn(|_, _| job("nested"));
            });
            scope.spawn_pinned(|_, _| job("spawn_pinned"));
            job("body");
        });
        scope.map_err(|panic| panic.message)
    }),
    ("loop", |scheduler| {
        let captured = Owned::new("captured by a loop", ());
        let body = move |_, _: &_| {
            let () = captured.get();
            job("chunk");
        };
        scheduler.parallel_for(20, 1, body).map_err(|panic| panic.message)
    }),
    ("iterator", |scheduler| {
        let items = OwnItems { left: 5, _dropped: Owned::new("items", ()) };
        let captured = Owned::new("captured by a loop", ());
        let body = move |_, _: &_| {
            let () = captured.get();
            job("item");
        };
        scheduler.parallel_for_each(items, body).map_err(|panic| panic.message)
    }),
    ("background", |scheduler| {
        let captured = Owned::new("captured by a job", ());
        let background = scheduler.background(move || {
            let () = captured.get();
            job("background");
        });
        // Nobody hears of the panic of another.
        drop(scheduler.background(|| job("abandoned")));
        while scheduler.run_background(Duration::from_secs(1)) > 0 {}
        background.wait().map_err(|panic| panic.message)
    }),
];

#[test]
fn a_panic_in_any_job_is_the_error_of_what_ran_it() {
    within_time(|| {
        let (expected, alive_before) = (expected(), fuse::alive());
        for workers in [1, 3] {
            for (name, run) in RUNS {
                for index in 0.. {
                    let has_text = index % 2 == 0;
                    let scheduler = Scheduler::builder().workers(workers).wake_up_cost(Duration::ZERO).build().unwrap();
                    fuse::arm(Kind::Hook, index, has_text);
                    let outcome = catch_unwind(AssertUnwindSafe(|| run(&scheduler)));
                    // Another worker may still run the job that nobody waits for.
                    while scheduler.workers() > 1 && !format!("{scheduler:?}").contains("background_jobs: 0") {
                        std::thread::yield_now();
                    }
                    let outcome = outcome.unwrap_or_else(|_| panic!("{name} {index} unwinds"));
                    draw_on(scheduler, &expected, name);
                    let blown = fuse::disarm();
                    match outcome {
                        Ok(()) => assert!(matches!(blown, None | Some("abandoned" | "on_set")), "{name}: {blown:?}"),
                        Err(message) => assert_eq!(message == PLANNED, has_text, "{name} {index}: {message}"),
                    }
                    if matches!(blown, None | Some("on_set")) {
                        assert!(index > 0, "no call of {name} panicked");
                        break;
                    }
                }
                crate::wait_until(|| fuse::alive() == alive_before, "captures are kept");
            }
        }
    });
}

/// An error of the engine's, whose conversion may panic.
struct OwnError;

impl From<OwnError> for Box<dyn std::error::Error + Send + Sync> {
    fn from(_: OwnError) -> Self {
        job("from");
        "it is gone".into()
    }
}

#[test]
fn a_panic_in_any_load_is_an_error_that_names_it() {
    within_time(|| {
        for workers in [1, 2] {
            let mut panicked = Vec::new();
            for index in 0.. {
                let has_text = index % 2 == 0;
                let scheduler = Arc::new(Scheduler::new(workers).unwrap());
                let mut scene = Scene::new();
                let loader: AssetLoader = scene.assets().loader(&scheduler);
                fuse::arm(Kind::Hook, index, has_text);
                let material = loader.load("material", 2, || {
                    job("material");
                    Ok::<_, SceneError>(Material::default())
                });
                let failing = loader.load("failing", 1, || {
                    job("failing");
                    Err::<Mesh, OwnError>(OwnError)
                });
                let good = loader.load("good", 0, || Ok::<_, SceneError>(Material::default()));
                let mut errors = Vec::new();
                while scene.assets().is_pending(good) {
                    let arrivals = catch_unwind(AssertUnwindSafe(|| scene.receive(&loader)));
                    errors.extend(arrivals.expect("it unwinds").errors);
                    std::thread::yield_now();
                }
                let blown = fuse::disarm();
                // In the order of their priorities.
                let names: Vec<_> = errors.iter().map(|error| error.name.as_str()).collect();
                let of_panic = |wanted: &str| {
                    let error = errors.iter().find(|error| error.name == wanted).unwrap().to_string();
                    assert_eq!(error.contains(PLANNED), has_text, "{error}");
                };
                match blown {
                    Some("material") => of_panic("material"),
                    Some(_) => of_panic("failing"),
                    None => {}
                }
                let expected = if blown == Some("material") { &["material", "failing"][..] } else { &["failing"] };
                assert_eq!(names, expected, "{blown:?}");
                assert!(scene.assets().get(failing).is_err());
                assert_eq!(scene.assets().get(material).is_ok(), blown != Some("material"));
                assert!(scene.assets().get(good).is_ok(), "after {blown:?}");
                let Some(blown) = blown else { break };
                panicked.push(blown);
            }
            assert_eq!(panicked, ["material", "failing", "from"]);
        }
    });
}
