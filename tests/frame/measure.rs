//! A frame that is measured is the frame that it would be otherwise, and says what it took.

use std::time::{Duration, Instant};

use drawloom::report::{Prices, Replay};
use drawloom::{FrameError, Granularity};

use crate::renderer;
use crate::scenes::field;

#[test]
fn a_measured_frame_draws_the_same() {
    let scene = field(500);
    for workers in [1, 2] {
        let (mut renderer, submitter) = renderer(workers, Granularity::Chunk(64));
        let plain = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        let (recorded, _) = renderer.record_measured(scene.as_scene_ref()).unwrap();
        let measured = submitter.submit(recorded).unwrap();
        assert_eq!(measured.submission.passes, plain.submission.passes);
        assert_eq!(measured.statistics.views, plain.statistics.views);
    }
}

#[test]
fn a_measure_accounts_for_the_whole_frame() {
    let scene = field(2_000);
    for workers in [1, 2] {
        let (mut renderer, _submitter) = renderer(workers, Granularity::Chunk(64));
        let start = Instant::now();
        let (recorded, measure) = renderer.record_measured(scene.as_scene_ref()).unwrap();
        let took = start.elapsed();
        assert_eq!(measure.jobs.workers(), workers);
        assert!(measure.before > Duration::ZERO && measure.after > Duration::ZERO);
        assert_eq!(measure.serial(), measure.before + measure.after);
        assert!(measure.serial() + measure.jobs.took() <= took);

        // Objects are counted by whoever looks at them, whatever the size of a job.
        let processes = measure.jobs.processes();
        let seen = processes.iter().filter(|process| process.name.starts_with("visibility"));
        let seen: Vec<_> = seen.map(|process| process.width).collect();
        assert_eq!(seen, vec![2_000; scene.cameras.len()]);
        assert_eq!(recorded.statistics().objects, 2_000);

        let replay = Replay::of_frame(&measure, Prices::FREE);
        assert_eq!(replay.frame_time(1), measure.jobs.work() + measure.serial());
        assert!(replay.frame_time(8) < replay.frame_time(1));
    }
}

#[test]
fn a_frame_that_cannot_be_is_not_measured() {
    let (mut renderer, _submitter) = renderer(1, Granularity::default());
    let mut scene = field(10);
    scene.cameras.clear();
    assert!(matches!(renderer.record_measured(scene.as_scene_ref()), Err(FrameError::NoView)));
}
