//! What the schemes of buffering cost and give: throughput, latency, stalls and memory.
//!
//!     cargo bench -p drawloom-benches --bench latency
//!     cargo bench -p drawloom-benches --bench latency -- --quick --backend noop
//!
//! On wgpu's `noop` device a simulated device takes a given time for each frame; on an adapter the device draws. The
//! engine's update is a loop that takes a given time. The contenders are the three schemes of `FrameLoop`, and two
//! loops on one thread without it: one that waits for each frame, and one that waits for the frame before the last, as
//! engines do by hand. They take turns, a few dozen frames each.
//!
//! - *frame* is the time from the end of one frame to that of the next, *latency* that from the input to the end of the
//!   device's work.
//! - *CPU waits* and *device idles* are their shares of a frame.
//! - *buffers* are those that the backend keeps for frames.
//!
//! The second table compares update, record and submit of the next frame and this one at once with one after the other.
//! The third one has the cost of a fence that nobody waits for. `target/drawloom/latency.json` has the same, and
//! `latency.svg` draws the first table. The last line names the targets that were missed.

mod charts;
mod contender;
mod fences;
mod overlap;
mod schemes;

use std::error::Error;

use clap::Parser;
use drawloom_benches::arguments::BackendArguments;
use drawloom_benches::backends::adapter_name;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use serde::Serialize;
use std::process::ExitCode;

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
}

#[derive(Serialize)]
struct Results {
    adapter: Option<String>,
    schemes: Vec<schemes::Row>,
    overlap: overlap::Row,
    fences: Vec<fences::Row>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments = drawloom_output::parse_arguments::<Arguments>().backend;
    let quick = arguments.is_quick();
    let progress = progress_bar("rounds");
    let mut schemes = Vec::new();
    for backend in arguments.backends()? {
        schemes.extend(schemes::measure(backend, quick, &progress)?);
    }
    let overlap = overlap::measure(quick, &progress)?;
    let fences = fences::measure(quick, &progress)?;
    progress.finish_and_clear();

    let headings = [
        "device",
        "loop",
        "frame, ms",
        "latency, ms",
        "latency, frames",
        "99th percentile, ms",
        "CPU waits, %",
        "device idles, %",
        "buffers, KiB",
    ];
    let mut table = Table::new(&headings);
    for row in &schemes {
        table.row([
            row.device.clone(),
            row.name.to_owned(),
            format!("{:.2}", row.frame_ms),
            format!("{:.2}", row.latency_ms),
            format!("{:.2}", row.latency_ms / row.frame_ms),
            format!("{:.2}", row.latency_99_ms),
            format!("{:.0}", 100.0 * row.waited_ms / row.frame_ms),
            format!("{:.0}", 100.0 * row.idle_ms / row.frame_ms),
            format!("{}", row.buffer_bytes / 1024),
        ]);
    }
    table.print();
    let mut table =
        Table::new(&["update + record, ms", "submit, ms", "one after the other, ms", "at once, ms", "ratio"]);
    table.row([
        format!("{:.2}", overlap.record_ms),
        format!("{:.2}", overlap.submit_ms),
        format!("{:.2}", overlap.serial_ms),
        format!("{:.2}", overlap.overlapped_ms),
        format!("{:.2}", overlap.ratio),
    ]);
    table.print();
    let mut table = Table::new(&["fence", "frame, µs", "more than without, µs"]);
    for row in &fences {
        table.row([
            row.place.to_owned(),
            format!("{:.2}", row.frame_us),
            format!("{:.2}", row.frame_us - fences[0].frame_us),
        ]);
    }
    table.print();
    let mut targets = Targets::new();
    schemes::add_targets(&schemes, &mut targets);
    targets.at_least("update + record and submit, one after the other ÷ at once", 1.8, overlap.ratio);
    targets.print("Targets and results");
    if !quick {
        charts::draw(&results::file("latency.svg")?, &schemes)?;
        results::write_json("latency.json", &Results { adapter: adapter_name(), schemes, overlap, fences })?;
    }
    targets.print_missed();
    Ok(())
}
