//! A step of post-processing on idle workers, a frame late (S 9.7): frame rate, latency, and what a late layer does to
//! the picture.
//!
//!     cargo bench -p drawloom-benches --bench async_post
//!     cargo bench -p drawloom-benches --bench async_post -- --quick
//!     cargo bench -p drawloom-benches --bench async_post -- --backend noop
//!
//! The first table compares loops without the step, with it on the device, with it on the CPU in the same frame, which
//! waits for the device, and with it on idle workers, a frame late. A bloom is a layer, and a grade the whole picture.
//! On `noop`, a simulated device takes the given time for a frame, and for the step, and the CPU computes what it would
//! compute of any picture. On an adapter everything is drawn; lavapipe's threads are those of the CPU, so there nothing
//! is idle.
//!
//! - *latency* is from the input of the frame that a picture shows to the end of the device's work on that picture.
//! - *age* is how many frames late the layer is, or the picture.
//! - *step* is from the arrival of the pixels until the result is uploaded.
//!
//! The second table compares pictures with a layer that is a frame late with those of the layer of the same frame, for
//! cameras that move at 60 frames a second, on the adapter: in units of 255, over all pixels of all viewpoints.
//! `target/drawloom/async_post.json` has the same, `async_post.svg` draws it, and `async_post-*.png` are some of the
//! pictures.

mod charts;
mod contender;
mod errors;
mod rates;
mod steps;

use std::error::Error;

use clap::Parser;
use drawloom_benches::arguments::BackendArguments;
use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::table::Table;
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
    rates: Vec<rates::Row>,
    errors: Vec<errors::Row>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments = drawloom_output::parse_arguments::<Arguments>().backend;
    let quick = arguments.is_quick();
    let progress = progress_bar("rounds");
    let (mut rates, mut errors) = (Vec::new(), Vec::new());
    for backend in arguments.backends()? {
        rates.extend(rates::measure(backend, quick, &progress)?);
        if backend == BackendName::Adapter {
            errors = errors::measure(quick)?;
        }
    }
    progress.finish_and_clear();

    let headings = [
        "device",
        "buffering",
        "the step",
        "frame, ms",
        "latency, ms",
        "99th percentile, ms",
        "age, frames",
        "step, ms",
    ];
    let mut table = Table::new(&headings);
    for row in &rates {
        table.row([
            row.device.clone(),
            row.buffering.to_owned(),
            row.name.to_owned(),
            format!("{:.2}", row.frame_ms),
            format!("{:.2}", row.latency_ms),
            format!("{:.2}", row.latency_99_ms),
            row.age.map_or_else(String::new, |age| format!("{age:.2}")),
            row.step_ms.map_or_else(String::new, |step| format!("{step:.2}")),
        ]);
    }
    table.print();
    let mut table = Table::new(&["layer", "camera", "lookup", "mean", "99th percentile", "largest", "PSNR, dB"]);
    for row in &errors {
        table.row([
            row.layer.to_owned(),
            row.motion.to_owned(),
            row.lookup.to_owned(),
            format!("{:.3}", row.mean),
            format!("{}", row.percentile_99),
            format!("{}", row.largest),
            if row.psnr.is_finite() { format!("{:.1}", row.psnr) } else { "equal".to_owned() },
        ]);
    }
    table.print();
    if !quick {
        charts::draw(&results::file("async_post.svg")?, &rates, &errors)?;
        results::write_json("async_post.json", &Results { adapter: adapter_name(), rates, errors })?;
    }
    Ok(())
}
