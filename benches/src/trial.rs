//! What every bench with backends is asked on its command line.

use clap::Args;

use crate::backends::BackendName;
use crate::quick::Quick;

/// How much is measured, and on which backends.
#[derive(Args)]
pub struct Trial {
    #[command(flatten)]
    quick: Quick,
    /// Measures on this backend only.
    #[arg(long, value_parser = ["noop", "adapter"])]
    backend: Option<String>,
}

impl Trial {
    /// Whether it is only a trial, which must not take the place of what was measured.
    pub fn is_quick(&self) -> bool {
        self.quick.is_quick()
    }

    /// Those that are asked for and that this machine has.
    pub fn backends(&self) -> impl Iterator<Item = BackendName> {
        let is_asked = |name: &str| self.backend.as_deref().is_none_or(|asked| asked == name);
        BackendName::available().iter().copied().filter(move |backend| is_asked(backend.name()))
    }
}
