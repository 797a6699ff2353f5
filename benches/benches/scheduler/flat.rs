//! Row `flat`: many empty jobs, each spawned by itself, and a wait for all of them.

use std::thread;

use drawloom::task::Scheduler;
use drawloom_benches::work::Work;

use crate::turns::{Contender, Row};
use crate::{Extent, WORKERS, pools};

/// chili cannot spawn, so it halves all jobs at once, which is less to do. std's threads are one a job, and [`Extent::threads`] jobs: more would take long.
pub fn row(extent: &Extent) -> Row {
    let jobs = extent.flat;
    let drawloom = Contender::new("drawloom", move |work, watch| {
        let scheduler = Scheduler::new(WORKERS)?;
        watch.frames(|| {
            Ok(scheduler.scope(|scope| {
                for job in 0..jobs {
                    scope.spawn(move |_scope, _worker| work.job(job));
                }
            })?)
        })
    });
    let rayon = Contender::new("rayon", move |work, watch| {
        pools::rayon()?.install(|| {
            watch.frames(|| {
                rayon::scope(|scope| {
                    for job in 0..jobs {
                        scope.spawn(move |_scope| work.job(job));
                    }
                });
                Ok(())
            })
        })
    });
    let bevy_tasks = Contender::new("bevy_tasks", move |work, watch| {
        let pool = pools::bevy_tasks();
        watch.frames(|| {
            pool.scope(|scope| {
                for job in 0..jobs {
                    scope.spawn(async move { work.job(job) });
                }
            });
            Ok(())
        })
    });
    let chili = Contender::new("chili join", move |work, watch| {
        let pool = pools::chili();
        let mut scope = pool.scope();
        watch.frames(|| {
            pools::halve::<64>(&mut scope, 0..jobs, work);
            Ok(())
        })
    });
    let threads = extent.threads;
    let std_threads = Contender::new("std threads", move |work, watch| {
        watch.frames(|| {
            thread::scope(|scope| {
                for job in 0..threads {
                    scope.spawn(move || work.job(job));
                }
            });
            Ok(())
        })
    });
    Row {
        name: "flat",
        unit: "ns a job",
        scale: 1e9,
        pace: extent.hot(),
        work: Work::empty(),
        jobs,
        order: Box::new(|_record| Ok(())),
        contenders: vec![
            Contender::plain_loop(jobs).split(jobs),
            Contender::ideal(jobs).split(jobs),
            drawloom.split(jobs),
            rayon.split(jobs),
            bevy_tasks.split(jobs),
            chili.split(jobs).with_easier_task(),
            std_threads.split(threads).with_jobs(threads),
        ],
    }
}
