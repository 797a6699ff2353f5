//! What a frame was, in numbers.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::raster::CulledTriangles;
use crate::scene::ViewKind;
use crate::view::Rejection;

/// What a frame was, in numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStatistics {
    /// Objects in the scene.
    pub objects: usize,
    /// Lights in the scene that can be; the others are among the rejections.
    pub lights: usize,
    /// One for each view.
    pub views: Vec<ViewStatistics>,
    /// Bytes that were uploaded to the device.
    pub uploaded: u64,
    /// Where the time went.
    pub stages: StageTimes,
    /// What was left out, and why.
    pub rejections: Vec<Rejection>,
}

/// What a view drew.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewStatistics {
    /// The camera's name.
    pub name: String,
    /// What its picture is for.
    pub kind: ViewKind,
    /// Objects it sees.
    pub visible: usize,
    /// Objects it would see, did others not hide them: see [`Quality::occlusion`](crate::quality::Quality::occlusion).
    pub occluded: usize,
    /// Lights that reach it.
    pub lights: usize,
    /// Commands, over all its processes.
    pub commands: usize,
    /// Instanced draws, over all its processes.
    pub batches: usize,
    /// Bundles that those fill, whether they are recorded as bundles or not.
    pub bundles: usize,
    /// Triangles that were looked at before they were drawn, and how many of them were left out, over all its processes: see
    /// [`Mesh::with_triangle_culling`](crate::scene::Mesh::with_triangle_culling).
    pub culled_triangles: CulledTriangles,
}

/// Thread time of each stage, summed over workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Checking objects, and finding those that each view sees, and the lights that reach it.
    pub visibility: Duration,
    /// Making commands.
    pub fill: Duration,
    /// Sorting them.
    pub sort: Duration,
    /// Merging them into batches, and looking at the triangles of meshes that ask for it.
    pub instance: Duration,
    /// Uploading, recording bundles, finishing passes.
    pub record: Duration,
    /// Submitting. 0 until the frame was.
    pub submit: Duration,
}

/// A stage of [`StageTimes`] that jobs take part in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Visibility,
    Fill,
    Sort,
    Instance,
    Record,
}

/// Adds up thread time a stage while jobs run.
#[derive(Debug, Default)]
pub(super) struct StageClock {
    nanoseconds: [AtomicU64; 5],
}

impl StageClock {
    /// Runs `work`, adds the time it takes to `stage`, and says how long that was.
    pub(super) fn measure<R>(&self, stage: Stage, work: impl FnOnce() -> R) -> (R, Duration) {
        let start = Instant::now();
        let result = work();
        let took = start.elapsed();
        // Read when all jobs have ended, which orders everything.
        self.nanoseconds[stage as usize].fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        (result, took)
    }

    pub(super) fn times(&self) -> StageTimes {
        let of = |stage: Stage| Duration::from_nanos(self.nanoseconds[stage as usize].load(Ordering::Relaxed));
        StageTimes {
            visibility: of(Stage::Visibility),
            fill: of(Stage::Fill),
            sort: of(Stage::Sort),
            instance: of(Stage::Instance),
            record: of(Stage::Record),
            submit: Duration::ZERO,
        }
    }
}
