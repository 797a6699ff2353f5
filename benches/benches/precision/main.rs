//! The error of vertex positions in pictures of 1080 rows, by the distance of the camera from the world's origin.
//!
//!     cargo bench -p drawloom-benches --bench precision
//!     cargo bench -p drawloom-benches --bench precision -- --quick
//!
//! Compares two transforms with f64. *Relative* is this crate's: it subtracts the camera's position from the object's
//! in fixed point, and then computes in f32 what its shaders do, in the same order. *Shader* is the same computed by
//! the machine's adapter, with the WGSL of frames, for a tenth of the vertices. *Absolute* is that of most engines: f32
//! world positions and a matrix per step. Vertices are random, with a fixed seed: they belong to rotated and scaled
//! objects at least as far from the camera as they are large, anywhere in the picture. A vertex that is lost counts as
//! the picture's diagonal.
//!
//! Fails if a view exceeds its bound of 1e-3 pixels, or, of the views that magnify angles, the worst angle that f32 can
//! lose. `target/drawloom/precision.json` and `.svg` have the same.

mod report;

use std::error::Error;

use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::progress_bar;
use drawloom_output::print_diagnostic;
use drawloom_testing::adapter;
use drawloom_testing::precision::cases::Kind;
use drawloom_testing::precision::device::ShaderOnDevice;
use drawloom_testing::precision::measure::{BOUNDED, MAGNIFYING, Origin, measure};
use drawloom_testing::precision::vertex::ShaderInRust;
use drawloom_testing::random::Random;
use std::process::ExitCode;

use report::{Report, Row};

/// A typical camera.
const TYPICAL: Kind = Kind::Perspective { degrees: 60.0, size: Kind::FULL_HD };

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let [by_distance, by_view] = if quick { [500, 1_000] } else { [200_000, 100_000] };
    let distances: Vec<_> = (0..10).map(|power| 10_f64.powi(power)).collect();
    let steps = distances.len() + BOUNDED.len() + MAGNIFYING.len();
    let progress = progress_bar("views");
    progress.set_length(steps as u64);
    let mut shader = match adapter::device() {
        Ok((device, queue)) => Some(ShaderOnDevice::new(device, queue)),
        Err(error) => {
            print_diagnostic!("Without the shader on an adapter: {error}");
            None
        }
    };
    let (mut random, mut report) = (Random::new(), Report::default());
    let mut add = |kind: Kind, distance: Option<f64>, is_held, cases| -> Result<(), Box<dyn Error>> {
        progress.set_message(distance.map_or_else(|| kind.name(), |distance| format!("{distance:.0e} m")));
        let origin = distance.map_or(Origin::Anywhere, Origin::At);
        let found = measure(kind, origin, cases, &mut random, &mut ShaderInRust)?;
        let by_shader =
            shader.as_mut().map(|shader| measure(kind, origin, cases / 10, &mut random, shader)).transpose()?;
        report.rows.push(Row::new(kind, distance, is_held, found, by_shader));
        progress.inc(1);
        Ok(())
    };
    for distance in distances {
        add(TYPICAL, Some(distance), true, by_distance)?;
    }
    BOUNDED.into_iter().try_for_each(|kind| add(kind, None, true, by_view))?;
    MAGNIFYING.into_iter().try_for_each(|kind| add(kind, None, false, by_view))?;
    progress.finish_and_clear();
    report.print();
    if !quick {
        report.write()?;
    }
    report.check()
}
