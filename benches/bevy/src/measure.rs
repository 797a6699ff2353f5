//! Measures all contenders in a scene, interleaved.

use std::path::Path;

use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;

use crate::bevy_side::{Bevy, Mode};
use crate::contender::{Contender, Failure, FrameTime};
use crate::drawloom_side::Drawloom;
use crate::layout::Layout;
use crate::pictures;
use crate::report::Row;

/// The size of the measurement.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    pub backend: BackendName,
    pub threads: usize,
    pub is_quick: bool,
    /// Measured bursts of each contender.
    pub bursts: usize,
    /// Measured frames in a burst. One more comes before them: it follows a frame of another contender.
    pub frames: u32,
}

/// Frames before the first burst: Drawloom measures costs and orders its objects in them.
const WARM_UP_FRAMES: usize = 60;

impl Extent {
    /// `frames` is the number of measured frames of each contender.
    pub fn new(backend: BackendName, threads: usize, is_quick: bool, frames: Option<usize>) -> Self {
        let burst = backend.of([8, 2]);
        let default = if is_quick { 2 * burst } else { 31 * burst };
        let bursts = frames.unwrap_or(default).div_ceil(burst).max(1);
        Self { backend, threads, is_quick, bursts, frames: burst as u32 }
    }
}

/// # Errors
/// Returns an error if a contender cannot draw a frame, or does not draw every object.
pub fn measure(
    layout: &Layout,
    extent: &Extent,
    folder: Option<&Path>,
    progress: &ProgressBar,
) -> Result<Vec<Row>, Failure> {
    let mut contenders = contenders(layout, extent)?;
    for contender in &mut contenders {
        let warm_up = if extent.is_quick { 2 } else { extent.backend.of([WARM_UP_FRAMES, WARM_UP_FRAMES / 4]) };
        for _ in 0..warm_up {
            contender.frame()?;
            contender.wait()?;
        }
    }
    let drawn =
        contenders.iter_mut().map(|contender| check(contender.as_mut(), layout)).collect::<Result<Vec<_>, _>>()?;
    if extent.backend == BackendName::Adapter {
        pictures::compare(&mut contenders, layout, folder)?;
    }
    let rounds = Rounds { warm_up: WARM_UP, measured: extent.bursts };
    let samples = Harness::new(rounds, progress).measure(&mut contenders, |contender, _| {
        contender.frame()?;
        contender.wait()?;
        contender.burst(extent.frames)
    })?;
    let drawloom = samples.first().map_or(&[][..], |samples| &samples[..]);
    let row = |((contender, samples), drawn_objects): ((&Box<dyn Contender>, &Vec<FrameTime>), usize)| {
        let time = |time: fn(&FrameTime) -> f64| median(samples.iter().map(time)) * 1e6;
        // The ratio of two bursts of the same round, so that a disturbance meets both.
        let ratio = |time: fn(&FrameTime) -> f64| {
            median(samples.iter().zip(drawloom).map(|(sample, drawloom)| time(sample) / time(drawloom)))
        };
        Row {
            scene: layout.name,
            objects: layout.objects,
            cameras: layout.cameras,
            contender: contender.name(),
            drawn_objects,
            submitted_us: time(|time| time.submitted),
            submitted_ratio: ratio(|time| time.submitted),
            drawn_us: time(|time| time.drawn),
            drawn_ratio: ratio(|time| time.drawn),
        }
    };
    Ok(contenders.iter().zip(&samples).zip(drawn).map(row).collect())
}

/// Drawloom comes first.
fn contenders(layout: &Layout, extent: &Extent) -> Result<Vec<Box<dyn Contender>>, Failure> {
    let &Extent { backend, threads, .. } = extent;
    let mut all: Vec<Box<dyn Contender>> = vec![Box::new(Drawloom::new(backend, layout, threads)?)];
    for mode in [Mode::Default, Mode::DeviceCulling, Mode::Pipelined] {
        all.push(Box::new(Bevy::new(backend, layout, mode, threads)?));
    }
    Ok(all)
}

/// The number of objects that a contender draws.
fn check(contender: &mut dyn Contender, layout: &Layout) -> Result<usize, Failure> {
    let (drawn, all) = (contender.drawn_objects()?, layout.object_views());
    if drawn != all {
        return Err(format!("{} draws {drawn} objects of {all}", contender.name()).into());
    }
    Ok(drawn)
}
