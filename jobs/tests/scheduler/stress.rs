//! Random trees of spawned jobs, pinned jobs, scopes and loops, compared with a plain recursion.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom_jobs::task::{Scheduler, Scope, Worker};
use fastrand::Rng;

/// A branch of a random tree of jobs. A subtree has a seed and a height.
#[derive(Clone, Copy)]
enum Branch {
    Spawn(u64),
    Pinned(u64),
    Scope(u64),
    Loop(usize, usize),
}

/// The branches of a seed.
fn branches(seed: u64) -> impl Iterator<Item = Branch> {
    let mut random = Rng::with_seed(seed);
    (0..random.usize(..5)).map(move |_branch| match random.usize(..5) {
        0 | 1 => Branch::Spawn(random.u64(..)),
        2 => Branch::Pinned(random.u64(..)),
        3 => Branch::Scope(random.u64(..)),
        _ => Branch::Loop(random.usize(..300), random.usize(..20)),
    })
}

/// Runs the tree as jobs, scopes and loops, and counts the items of loops and the ends of branches.
fn run_tree<'scope>(
    scheduler: &'scope Scheduler,
    scope: &Scope<'scope>,
    leaves: &'scope AtomicUsize,
    seed: u64,
    height: usize,
) {
    if height == 0 {
        leaves.fetch_add(1, Ordering::Relaxed);
        return;
    }
    for branch in branches(seed) {
        match branch {
            Branch::Spawn(seed) => {
                scope.spawn(move |scope, _worker| run_tree(scheduler, scope, leaves, seed, height - 1))
            }
            Branch::Pinned(seed) => {
                scope.spawn_pinned(move |scope, _worker| run_tree(scheduler, scope, leaves, seed, height - 1));
            }
            Branch::Scope(seed) => {
                scheduler.scope(|scope| run_tree(scheduler, scope, leaves, seed, height - 1)).unwrap();
            }
            Branch::Loop(length, chunk) => {
                let visit = |range: Range<usize>, _worker: &Worker| {
                    leaves.fetch_add(range.len(), Ordering::Relaxed);
                };
                scheduler.parallel_for(length, chunk, visit).unwrap();
            }
        }
    }
}

/// The count of [`run_tree`], computed without jobs.
fn leaves(seed: u64, height: usize) -> usize {
    if height == 0 {
        return 1;
    }
    let count = |branch| match branch {
        Branch::Spawn(seed) | Branch::Pinned(seed) | Branch::Scope(seed) => leaves(seed, height - 1),
        Branch::Loop(length, _chunk) => length,
    };
    branches(seed).map(count).sum()
}

/// Random trees on few and many workers. `DRAWLOOM_STRESS` is the number of trees, 300 by default.
#[test]
fn random_trees_of_jobs_count_the_same_as_a_plain_recursion() {
    let trees =
        std::env::var("DRAWLOOM_STRESS").map_or(300, |trees| trees.parse().expect("DRAWLOOM_STRESS is a number"));
    let schedulers = [1, 2, 4, 7].map(|workers| Scheduler::new(workers).unwrap());
    for seed in 0..trees {
        for scheduler in &schedulers {
            let counted = AtomicUsize::new(0);
            scheduler.scope(|scope| run_tree(scheduler, scope, &counted, seed, 6)).unwrap();
            assert_eq!(counted.into_inner(), leaves(seed, 6), "seed {seed}, {} workers", scheduler.workers());
        }
    }
}
