//! Measures all contenders in a scene, interleaved.

use std::path::Path;

use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP};
use indicatif::ProgressBar;

use crate::bevy_side::{Bevy, Mode};
use crate::contender::{Contender, Failure};
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

/// The modes of Bevy that are interleaved. A pipelined app has a thread that works for the task pool of all apps while it is idle, so it is
/// measured when the others are gone.
const GROUPS: [&[Mode]; 2] = [&[Mode::Default, Mode::SerialSchedules, Mode::DeviceCulling], &[Mode::Pipelined]];

/// Frames before the first burst: Drawloom measures costs and orders its objects in them.
const WARM_UP_FRAMES: usize = 60;

impl Extent {
    /// `frames` is the number of measured frames of each contender, and is rounded up to whole bursts.
    pub fn new(backend: BackendName, threads: usize, is_quick: bool, frames: Option<usize>) -> Self {
        let burst = backend.of([8, 2]);
        let default = if is_quick { 2 * burst } else { 31 * burst };
        let bursts = frames.unwrap_or(default).div_ceil(burst).max(1);
        Self { backend, threads, is_quick, bursts, frames: burst as u32 }
    }
}

/// # Errors
/// Returns an error if a contender cannot draw a frame, does not draw every object, or draws another picture.
pub fn measure(
    layout: &Layout,
    extent: &Extent,
    folder: Option<&Path>,
    progress: &ProgressBar,
) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for modes in GROUPS {
        let group = measure_group(modes, layout, extent, folder, progress)?;
        // Drawloom is measured beside each group, and reported beside the first.
        rows.extend(group.into_iter().skip(usize::from(!rows.is_empty())));
    }
    Ok(rows)
}

/// Measures Drawloom and Bevy in these modes.
fn measure_group(
    modes: &[Mode],
    layout: &Layout,
    extent: &Extent,
    folder: Option<&Path>,
    progress: &ProgressBar,
) -> Result<Vec<Row>, Failure> {
    let mut contenders = contenders(modes, layout, extent)?;
    let warm_up = if extent.is_quick { 2 } else { extent.backend.of([WARM_UP_FRAMES, WARM_UP_FRAMES / 4]) };
    for contender in &mut contenders {
        for _ in 0..warm_up {
            contender.frame()?;
            contender.wait()?;
        }
        check(contender.as_mut(), layout)?;
    }
    if extent.backend == BackendName::Adapter {
        pictures::compare(&mut contenders, layout, folder)?;
    }
    let rounds = Rounds { warm_up: WARM_UP, measured: extent.bursts };
    let samples = Harness::new(rounds, progress).measure(&mut contenders, |contender, _| {
        contender.frame()?;
        contender.wait()?;
        contender.burst(extent.frames)
    })?;
    let samples: Vec<Vec<_>> = samples.into_iter().map(|bursts| bursts.concat()).collect();
    let each = contenders.iter().zip(&samples);
    let mut rows: Vec<_> = each.map(|(contender, samples)| Row::new(layout, contender.as_ref(), samples)).collect();
    if let Some(drawloom) = rows.first().cloned() {
        rows.iter_mut().for_each(|row| row.compare(&drawloom));
    }
    Ok(rows)
}

/// Drawloom comes first.
fn contenders(modes: &[Mode], layout: &Layout, extent: &Extent) -> Result<Vec<Box<dyn Contender>>, Failure> {
    let &Extent { backend, threads, .. } = extent;
    let drawloom = Drawloom::new(backend, layout, threads)?;
    let adapter = drawloom.adapter();
    let mut all: Vec<Box<dyn Contender>> = vec![Box::new(drawloom)];
    for &mode in modes {
        let bevy = Bevy::new(backend, layout, mode, threads)?;
        if bevy.adapter() != adapter {
            return Err(format!("Bevy draws on {:?}, and Drawloom on {adapter:?}", bevy.adapter()).into());
        }
        all.push(Box::new(bevy));
    }
    Ok(all)
}

/// Checks that a contender draws every object for every camera.
fn check(contender: &mut dyn Contender, layout: &Layout) -> Result<(), Failure> {
    let (drawn, all) = (contender.counted_frame()?, vec![layout.objects; layout.cameras]);
    if drawn != all {
        return Err(format!("{} draws {drawn:?} objects instead of {all:?}", contender.name()).into());
    }
    Ok(())
}
