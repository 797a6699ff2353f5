//! Measures all contenders in a scene, interleaved.

use std::path::Path;

use drawloom_benches::backends::BackendName;
use drawloom_benches::chart::grouped;
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
    /// Of Drawloom; Bevy has as many threads.
    pub workers: usize,
    pub is_quick: bool,
    /// Measured frames of each contender in each scene, if somebody asked for a number.
    requested: Option<u32>,
}

/// The modes of Bevy that are interleaved. A pipelined app has a thread that works for the task pool of all apps while
/// it is idle, so it is measured when the others are gone.
const GROUPS: [&[Mode]; 2] = [&[Mode::Default, Mode::SerialSchedules, Mode::DeviceCulling], &[Mode::Pipelined]];

/// From this many objects on, over all cameras, a scene is measured in fewer bursts: its frames take long, and vary
/// less.
const MANY_OBJECTS: usize = 500_000;

/// Frames before the first burst: Drawloom measures costs and orders its objects in them.
const WARM_UP_FRAMES: usize = 60;

impl Extent {
    /// `frames` is the number of measured frames of each contender in each scene, and is rounded up to whole bursts.
    pub fn new(backend: BackendName, workers: usize, is_quick: bool, frames: Option<u32>) -> Self {
        Self { backend, workers, is_quick, requested: frames }
    }

    /// Measured frames in a burst. One more comes before them: it follows a frame of another contender.
    fn burst(&self) -> u32 {
        self.backend.of([8, 2])
    }

    /// Measured bursts of each contender in a scene.
    fn bursts(&self, layout: &Layout) -> usize {
        match self.requested {
            Some(frames) => frames.div_ceil(self.burst()) as usize,
            None if self.is_quick => 2,
            None if layout.objects * layout.cameras >= MANY_OBJECTS => 9,
            None => 31,
        }
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
    let show = |what: &str, contender: &str| {
        let objects = grouped(layout.objects as f64);
        progress.set_message(format!("{}, {objects} objects: {what} {contender}", layout.name));
    };
    let mut contenders = contenders(modes, layout, extent, |contender| show("setting up", contender))?;
    let warm_up = if extent.is_quick { 2 } else { extent.backend.of([WARM_UP_FRAMES, WARM_UP_FRAMES / 4]) };
    for contender in &mut contenders {
        show("warming up", contender.name());
        for _ in 0..warm_up {
            contender.frame()?;
            contender.wait()?;
        }
        check(contender.as_mut(), layout)?;
    }
    if extent.backend == BackendName::Adapter {
        show("comparing pictures of", "all");
        pictures::compare(&mut contenders, layout, folder)?;
    }
    let rounds = Rounds { warm_up: WARM_UP, measured: extent.bursts(layout) };
    let samples = Harness::new(rounds, progress).measure(&mut contenders, |contender, _| {
        show("measuring", contender.name());
        contender.frame()?;
        contender.wait()?;
        contender.burst(extent.burst())
    })?;
    let samples: Vec<Vec<_>> = samples.into_iter().map(|bursts| bursts.concat()).collect();
    let each = contenders.iter().zip(&samples);
    let mut rows: Vec<_> = each.map(|(contender, samples)| Row::new(layout, contender.as_ref(), samples)).collect();
    if let Some(drawloom) = rows.first().cloned() {
        rows.iter_mut().for_each(|row| row.compare(&drawloom));
    }
    Ok(rows)
}

/// Drawloom comes first. `begin` is told the name of each contender before it is created.
fn contenders(
    modes: &[Mode],
    layout: &Layout,
    extent: &Extent,
    begin: impl Fn(&str),
) -> Result<Vec<Box<dyn Contender>>, Failure> {
    let &Extent { backend, workers, .. } = extent;
    begin(Drawloom::NAME);
    let drawloom = Drawloom::new(backend, layout, workers)?;
    let adapter = drawloom.adapter();
    let mut all: Vec<Box<dyn Contender>> = vec![Box::new(drawloom)];
    for &mode in modes {
        begin(mode.name());
        let bevy = Bevy::new(backend, layout, mode, workers)?;
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
