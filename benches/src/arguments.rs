//! Command line arguments that benchmarks share.

use clap::Parser;

#[cfg(feature = "wgpu")]
use crate::backends::BackendName;

/// The extent of the measurement.
#[derive(Parser)]
pub struct ExtentArguments {
    /// Runs few rounds on small scenes, to see that the benchmark works.
    #[arg(long)]
    quick: bool,
    /// Cargo passes it under `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

impl ExtentArguments {
    /// Whether the run is a quick one. Its results must not overwrite those of a full run.
    pub fn is_quick(&self) -> bool {
        self.quick || !self.bench
    }
}

/// The extent of the measurement, and its wgpu backends.
#[cfg(feature = "wgpu")]
#[derive(clap::Args)]
pub struct BackendArguments {
    #[command(flatten)]
    extent: ExtentArguments,
    /// Measures on this backend only.
    #[arg(long, value_parser = ["noop", "adapter"])]
    backend: Option<String>,
}

#[cfg(feature = "wgpu")]
impl BackendArguments {
    /// Whether the run is a quick one. Its results must not overwrite those of a full run.
    pub fn is_quick(&self) -> bool {
        self.extent.is_quick()
    }

    /// The requested backends that this machine has.
    pub fn backends(&self) -> impl Iterator<Item = BackendName> {
        let is_requested = |name: &str| self.backend.as_deref().is_none_or(|requested| requested == name);
        BackendName::available().iter().copied().filter(move |backend| is_requested(backend.name()))
    }
}
