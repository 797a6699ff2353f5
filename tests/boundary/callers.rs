//! Code of the engine's that a call runs for the engine, on its own thread: a panic unwinds to the caller, and changes
//! nothing.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;

use drawloom::process::{Deferred, Parameters};
use drawloom::quality::Quality;
use drawloom::scene::{Material, MaterialPredicate};

use crate::builds::deferred;
use crate::fuse::{self, Kind, call};
use crate::within_time;

/// Makes each call of a kind in `work` panic, in turn. Returns their names.
fn each_call_unwinds(kind: Kind, work: impl Fn()) -> Vec<&'static str> {
    let mut panicked = Vec::new();
    for index in 0.. {
        fuse::arm(kind, index, index % 2 == 0);
        let outcome = catch_unwind(AssertUnwindSafe(&work));
        let blown = fuse::disarm();
        assert_eq!(outcome.is_err(), blown.is_some(), "{blown:?}");
        // It may panic when it is dropped.
        outcome.unwrap_or_else(std::mem::forget);
        let Some(blown) = blown else { break };
        panicked.push(blown);
    }
    panicked.sort_unstable();
    panicked.dedup();
    panicked
}

#[test]
fn a_panic_in_an_update_of_parameters_leaves_them_as_they_were() {
    within_time(|| {
        let parameters = Parameters::new(1.0_f32);
        let update = |value| {
            parameters.update(|parameter| {
                *parameter = value;
                call(Kind::Hook, "update");
            });
        };
        for (index, has_text) in [(0, true), (1, false)] {
            let before = parameters.get();
            fuse::arm(Kind::Hook, 0, has_text);
            let outcome = catch_unwind(AssertUnwindSafe(|| update(7.0)));
            assert_eq!(fuse::disarm(), Some("update"));
            std::mem::forget(outcome.expect_err("it does not unwind"));
            assert_eq!(parameters.get(), before);
            // Neither this thread nor another one waits for the update that panicked.
            update(2.0 + index as f32);
            let of_other_thread = parameters.clone();
            thread::spawn(move || of_other_thread.set(of_other_thread.get() * 2.0)).join().unwrap();
            assert_eq!(parameters.get(), 4.0 + 2.0 * index as f32);
        }
    });
}

#[test]
fn a_panic_of_a_step_that_an_engine_asks_of_its_pipeline_leaves_the_pipeline_as_it_was() {
    within_time(|| {
        let asked: Deferred = deferred().leave_out("tone mapping");
        let expected = (asked.names(), asked.output());
        let alive_before = fuse::alive();
        type Ask = fn(&Deferred);
        let asks: [(Ask, &[&str]); 3] = [
            (|asked| drop(asked.names()), &["deformation's name", "layers", "process"]),
            (|asked| drop(asked.output().to_owned()), &["process"]),
            (|asked| drop(asked.clone().quality(&Quality::fast())), &["with_quality"]),
        ];
        for (ask, calls) in asks {
            let panicked = each_call_unwinds(Kind::Step, || ask(&asked));
            assert_eq!(panicked, calls);
            assert_eq!((asked.names(), asked.output()), expected);
            assert_eq!(fuse::alive(), alive_before, "after {calls:?}");
        }
    });
}

#[test]
fn a_panic_of_a_predicate_that_an_engine_asks_unwinds() {
    within_time(|| {
        let predicate = MaterialPredicate::new(|_| {
            call(Kind::Predicate, "contains");
            true
        });
        let ask = || assert!(predicate.contains(&Material::default()));
        assert_eq!(each_call_unwinds(Kind::Predicate, ask), ["contains"]);
    });
}

#[test]
fn a_panic_of_what_fetches_files_unwinds_to_who_reads_them() {
    within_time(|| {
        let read = || {
            let fetch = |_: &str| {
                call(Kind::Hook, "fetch");
                Ok(b"newmtl stone\n".to_vec())
            };
            drawloom_obj::read("a.obj", b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl stone\nf 1 2 3\n", fetch)
                .unwrap();
        };
        assert_eq!(each_call_unwinds(Kind::Hook, read), ["fetch"]);
    });
}
