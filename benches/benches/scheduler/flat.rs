//! Row `flat`: spawns many empty jobs one by one, and waits for all of them.

use std::thread;

use drawloom::task::Scheduler;
use drawloom_benches::work::Work;

use crate::row::{Contender, Row};
use crate::{Extent, pools};

/// chili cannot spawn: it splits the range of jobs by joins, which is less work. `std threads` starts one thread per
/// job, and only [`Extent::threads`] of them, as more would take long.
pub fn row(extent: &Extent, workers: &[usize]) -> Row {
    let jobs = extent.flat;
    let mut contenders = vec![Contender::plain_loop(jobs).per(jobs)];
    for &workers in workers {
        contenders.push(Contender::ideal(jobs, workers).per(jobs));
        contenders.extend(pool_contenders(jobs, workers));
    }
    contenders.push(thread_per_job(extent.threads));
    Row {
        name: "flat",
        unit: "ns per job",
        scale: 1e9,
        pace: extent.back_to_back(),
        work: Work::empty(),
        jobs,
        order: Box::new(|_record| Ok(())),
        contenders,
    }
}

fn pool_contenders(jobs: usize, workers: usize) -> [Contender; 4] {
    let drawloom = Contender::new("drawloom", workers, move |work, timer| {
        let scheduler = Scheduler::new(workers)?;
        timer.frames(|| {
            Ok(scheduler.scope(|scope| {
                for job in 0..jobs {
                    scope.spawn(move |_scope, _worker| work.job(job));
                }
            })?)
        })
    });
    let rayon = Contender::new("rayon", workers, move |work, timer| {
        pools::rayon(workers)?.install(|| {
            timer.frames(|| {
                rayon::scope(|scope| {
                    for job in 0..jobs {
                        scope.spawn(move |_scope| work.job(job));
                    }
                });
                Ok(())
            })
        })
    });
    let bevy_tasks = Contender::new("bevy_tasks", workers, move |work, timer| {
        let pool = pools::bevy_tasks(workers);
        timer.frames(|| {
            pool.scope(|scope| {
                for job in 0..jobs {
                    scope.spawn(async move { work.job(job) });
                }
            });
            Ok(())
        })
    });
    let chili = Contender::new("chili join", workers, move |work, timer| {
        let pool = pools::chili(workers);
        let mut scope = pool.scope();
        timer.frames(|| {
            pools::join_halves::<64>(&mut scope, 0..jobs, work);
            Ok(())
        })
    });
    [drawloom.per(jobs), rayon.per(jobs), bevy_tasks.per(jobs), chili.per(jobs).with_easier_task()]
}

fn thread_per_job(threads: usize) -> Contender {
    let std_threads = Contender::new("std threads", threads, move |work, timer| {
        timer.frames(|| {
            thread::scope(|scope| {
                for job in 0..threads {
                    scope.spawn(move || work.job(job));
                }
            });
            Ok(())
        })
    });
    std_threads.per(threads).with_jobs(threads)
}
