//! What every bench with backends is asked on its command line.

use clap::Args;

use crate::backends::BackendName;

/// How much is measured, and on which backends.
#[derive(Args)]
pub struct Trial {
    /// Few rounds and small scenes, to see that it works.
    #[arg(long)]
    quick: bool,
    /// Measures on this backend only.
    #[arg(long, value_parser = ["noop", "adapter"])]
    backend: Option<String>,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Trial {
    /// Whether it is only a trial, which must not take the place of what was measured.
    pub fn is_quick(&self) -> bool {
        self.quick || !self.bench
    }

    /// Those that are asked for and that this machine has.
    pub fn backends(&self) -> impl Iterator<Item = BackendName> {
        let is_asked = |name: &str| self.backend.as_deref().is_none_or(|asked| asked == name);
        BackendName::available().iter().copied().filter(move |backend| is_asked(backend.name()))
    }
}
