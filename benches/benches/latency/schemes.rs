//! The schemes of buffering beside loops without them.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Backend, BackendLayer, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Buffering, FrameTimes, Renderer};
use drawloom_benches::backends::BackendName;
use drawloom_benches::city;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::{median, percentile};
use drawloom_benches::targets::Targets;
use drawloom_testing::simulated_device::SimulatedDevice;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::contender::{Contender, Kind};

/// The time of the engine's update.
const UPDATE: Duration = Duration::from_millis(2);
/// The frames of a turn. The first ones are not counted, as the device is idle before them.
const FRAMES: usize = 40;
const FIRST_FRAMES: usize = 5;

/// How long the simulated device takes for frames.
struct SimulatedTime {
    name: &'static str,
    device_time: Duration,
    /// The time of each eighth frame.
    each_8th: Duration,
}

impl SimulatedTime {
    const fn constant(name: &'static str, device_time: Duration) -> Self {
        Self { name, device_time, each_8th: device_time }
    }
}

const SIMULATED_TIMES: [SimulatedTime; 4] = [
    SimulatedTime::constant("1 ms", Duration::from_millis(1)),
    SimulatedTime::constant("2.5 ms", Duration::from_micros(2_500)),
    SimulatedTime::constant("6 ms", Duration::from_millis(6)),
    SimulatedTime {
        name: "2 ms, each 8th 8 ms",
        device_time: Duration::from_millis(2),
        each_8th: Duration::from_millis(8),
    },
];

#[derive(Serialize)]
pub struct Row {
    pub device: String,
    pub name: &'static str,
    /// Medians.
    pub frame_ms: f64,
    pub latency_ms: f64,
    pub latency_99_ms: f64,
    /// Means: most frames wait not at all, or all of them do.
    pub waited_ms: f64,
    pub idle_ms: f64,
    pub buffer_bytes: u64,
}

pub fn measure(backend: BackendName, quick: bool, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let turns = if quick { 1 } else { 15 };
    let mut rows = Vec::new();
    match backend {
        BackendName::Noop => {
            let boxes = if quick { 100 } else { 4_000 };
            for SimulatedTime { name, device_time, each_8th } in SIMULATED_TIMES {
                let time_of = |frame: usize| if frame.is_multiple_of(8) { each_8th } else { device_time };
                let open = || {
                    let device = SimulatedDevice::new(BackendName::Noop.open()?, device_time);
                    Ok(device.with_next_times((0..(turns + 1) * FRAMES).map(time_of)))
                };
                rows.extend(of_device(name, open, SimulatedDevice::inner, boxes, turns, progress)?);
            }
        }
        BackendName::Adapter => {
            let boxes = if quick { 50 } else { 1_000 };
            rows.extend(of_device(
                "adapter",
                || BackendName::Adapter.open(),
                |backend| backend,
                boxes,
                turns,
                progress,
            )?);
        }
    }
    Ok(rows)
}

/// The targets: two frames in flight come as often as with the faster of the loops by hand.
pub fn add_targets(rows: &[Row], targets: &mut Targets) {
    for row in rows.iter().filter(|row| row.name == Kind::Loop(Buffering::Double).name()) {
        let by_hand = [Kind::Plain(1), Kind::Plain(2)].map(Kind::name);
        let peers = rows.iter().filter(|peer| peer.device == row.device && by_hand.contains(&peer.name));
        if let Some(peer) = peers.min_by(|one, other| one.frame_ms.total_cmp(&other.frame_ms)) {
            let figure = format!("{}, double ÷ {}, ms a frame", row.device, peer.name);
            targets.at_most(figure, 1.05, row.frame_ms / peer.frame_ms);
        }
    }
}

fn of_device<B: Backend>(
    device: &str,
    open: impl Fn() -> Result<B, Box<dyn Error>>,
    wgpu_of: impl Fn(&B) -> &WgpuBackend,
    boxes: usize,
    turns: usize,
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>>
where
    B::Submission: Send,
{
    let mut contenders = Vec::new();
    for kind in Kind::ALL {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let built = Renderer::builder(open()?).pipeline(Deferred::to_picture()).build(scheduler)?;
        let world = Moving::new(city::new(boxes, [160, 90])?, Motion::Cameras);
        contenders.push(Contender::new(kind, built, world)?);
    }
    let rounds = Rounds { warm_up: 1, measured: turns };
    let measured =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| contender.draw(FRAMES, UPDATE))?;
    let rows = Kind::ALL.into_iter().zip(measured).zip(&mut contenders).map(|((kind, turns), contender)| {
        let buffer_bytes = wgpu_of(contender.backend()).resources().buffer_bytes;
        row(device, kind, &turns, buffer_bytes)
    });
    Ok(rows.collect())
}

fn row(device: &str, kind: Kind, turns: &[Vec<FrameTimes>], buffer_bytes: u64) -> Row {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let pairs = || turns.iter().flat_map(|turn| turn.windows(2).skip(FIRST_FRAMES));
    let latencies = || pairs().map(|pair| milliseconds(pair[1].latency()));
    // Over a whole turn, because frames that finish together have no time between them.
    let frame = |turn: &Vec<FrameTimes>| {
        let (first, last) = (&turn[FIRST_FRAMES], &turn[turn.len() - 1]);
        milliseconds(last.finished - first.finished) / (turn.len() - 1 - FIRST_FRAMES) as f64
    };
    let mean = |values: &mut dyn Iterator<Item = Duration>| {
        let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + milliseconds(value), count + 1));
        sum / f64::from(count)
    };
    Row {
        device: device.to_owned(),
        name: kind.name(),
        frame_ms: median(turns.iter().map(frame)),
        latency_ms: median(latencies()),
        latency_99_ms: percentile(99, latencies()),
        waited_ms: mean(&mut pairs().map(|pair| pair[1].waited)),
        idle_ms: mean(&mut pairs().map(|pair| pair[1].device_idle_since(&pair[0]))),
        buffer_bytes,
    }
}
