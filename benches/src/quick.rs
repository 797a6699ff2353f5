//! Whether a bench is run in full, or only tried.

use clap::Parser;

/// How much is measured.
#[derive(Parser)]
pub struct Quick {
    /// Few rounds and small scenes, to see that it works.
    #[arg(long)]
    quick: bool,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Quick {
    /// Whether it is only a trial, which must not take the place of what was measured.
    pub fn is_quick(&self) -> bool {
        self.quick || !self.bench
    }
}
