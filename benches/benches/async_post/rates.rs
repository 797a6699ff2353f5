//! Frame rate and latency with the step in different places.

use std::error::Error;
use std::time::Duration;

use drawloom::backend::{Backend, PipelineLibrary, WgpuBackend, WgpuSubmission};
use drawloom_async_post::UploadPicture;
use drawloom_benches::backends::BackendName;
use drawloom_benches::city;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::{median, percentile};
use drawloom_testing::adapter;
use drawloom_testing::simulated_device::SimulatedDevice;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::contender::{Contender, FrameSample, Kind, Variant};

/// The time of the engine's update.
const UPDATE: Duration = Duration::from_millis(2);
/// What the simulated device takes for the step, beside the rest of the frame, and for a frame that only draws a
/// finished picture.
const STEP_ON_DEVICE: Duration = Duration::from_micros(1_500);
const COMPOSITION: Duration = Duration::from_micros(200);
/// The first frames of a turn, which are not counted, as the device is idle before them, and there is no result.
const FIRST_FRAMES: usize = 10;

#[derive(Serialize)]
pub struct Row {
    pub device: String,
    pub name: &'static str,
    pub buffering: &'static str,
    /// Medians.
    pub frame_ms: f64,
    pub latency_ms: f64,
    pub latency_99_ms: f64,
    /// The mean.
    pub age: Option<f64>,
    pub step_ms: Option<f64>,
}

pub fn measure(backend: BackendName, quick: bool, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let (turns, frames) = if quick { (1, 20) } else { (9, 60) };
    let mut rows = Vec::new();
    match backend {
        BackendName::Noop => {
            let (boxes, picture) = if quick { (100, [320, 180]) } else { (1_000, [1920, 1080]) };
            for milliseconds in [2, 10] {
                let (device, queue) = adapter::noop_device()?;
                let frame_time = Duration::from_millis(milliseconds);
                let open = |kind, first: Option<&SimulatedDevice<WgpuBackend>>| {
                    let backend = WgpuBackend::new(device.clone(), queue.clone()).expect("it was opened for Drawloom");
                    match (first, kind) {
                        (Some(first), _) => first.beside(backend, COMPOSITION),
                        (None, Kind::BloomOnDevice | Kind::GradeOnDevice) => {
                            SimulatedDevice::new(backend, frame_time + STEP_ON_DEVICE)
                        }
                        (None, _) => SimulatedDevice::new(backend, frame_time),
                    }
                };
                let device = format!("{milliseconds} ms");
                rows.extend(of_device(&device, open, boxes, picture, [turns, frames], progress)?);
            }
        }
        BackendName::Adapter => {
            let (device, queue) = adapter::device()?;
            let library = PipelineLibrary::new(device, queue);
            let open = |_, _: Option<&WgpuBackend>| library.backend().expect("the device was opened for Drawloom");
            let (boxes, picture) = if quick { (50, [64, 36]) } else { (1_000, [480, 270]) };
            rows.extend(of_device("adapter", open, boxes, picture, [turns, frames], progress)?);
        }
    }
    Ok(rows)
}

fn of_device<B: Backend<Submission = WgpuSubmission> + UploadPicture>(
    device: &str,
    open: impl Fn(Kind, Option<&B>) -> B,
    boxes: usize,
    picture: [u32; 2],
    [turns, frames]: [usize; 2],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut contenders = Vec::new();
    for variant in Variant::ALL {
        let mut scene = city::new(boxes, picture)?;
        scene.cameras.truncate(1);
        contenders.push(Contender::new(variant, &open, Moving::new(scene, Motion::Cameras))?);
    }
    let rounds = Rounds { warm_up: 1, measured: turns };
    let measured =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| contender.draw(frames, UPDATE))?;
    Ok(Variant::ALL.into_iter().zip(measured).map(|(variant, turns)| row(device, variant, &turns)).collect())
}

fn row(device: &str, variant: Variant, turns: &[Vec<FrameSample>]) -> Row {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    // On a machine that is busy, a turn may have few late pictures.
    let first_of = |turn: &[FrameSample]| FIRST_FRAMES.min(turn.len() / 2);
    let samples = || turns.iter().flat_map(|turn| &turn[first_of(turn)..]);
    // Over a whole turn, because frames that finish together have no time between them.
    let frame = |turn: &Vec<FrameSample>| {
        let counted = &turn[first_of(turn)..];
        let [first, .., last] = counted else { return f64::NAN };
        milliseconds(last.finished - first.finished) / (counted.len() - 1) as f64
    };
    let latencies = || samples().map(|sample| milliseconds(sample.latency));
    let ages: Vec<_> = samples().filter_map(|sample| sample.age).map(|age| age as f64).collect();
    let steps: Vec<_> = samples().filter_map(|sample| sample.step).map(milliseconds).collect();
    Row {
        device: device.to_owned(),
        name: variant.kind.name(),
        buffering: variant.buffering_name(),
        frame_ms: median(turns.iter().map(frame).filter(|time| time.is_finite())),
        latency_ms: median(latencies()),
        latency_99_ms: percentile(99, latencies()),
        age: (!ages.is_empty()).then(|| ages.iter().sum::<f64>() / ages.len() as f64),
        step_ms: (!steps.is_empty()).then(|| median(steps)),
    }
}
