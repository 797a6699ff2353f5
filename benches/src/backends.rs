//! The backends that benches run on: never mixed, each beside its own only.

use std::error::Error;

use drawloom::backend::WgpuBackend;
use drawloom_testing::adapter;
use serde::Serialize;

/// What draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BackendName {
    /// wgpu's own, which does nothing: what is left is the processor's part.
    Noop,
    /// The machine's.
    Adapter,
}

impl BackendName {
    pub const ALL: &[Self] = &[Self::Noop, Self::Adapter];

    /// Those there are on this machine.
    pub fn available() -> &'static [Self] {
        if adapter_name().is_some() { Self::ALL } else { &Self::ALL[..1] }
    }

    /// What a bench's extent says of this one.
    pub fn of<T>(self, [noop, adapter]: [T; 2]) -> T {
        match self {
            Self::Noop => noop,
            Self::Adapter => adapter,
        }
    }

    pub fn name(self) -> &'static str {
        self.of(["noop", "adapter"])
    }

    /// A device of its own.
    ///
    /// # Errors
    /// If there is none.
    pub fn open(self) -> Result<WgpuBackend, Box<dyn Error>> {
        let (device, queue) = match self {
            Self::Noop => adapter::noop_device()?,
            Self::Adapter => adapter::device()?,
        };
        Ok(WgpuBackend::new(device, queue)?)
    }
}

/// The machine's adapter; `None` where there is none.
pub fn adapter_name() -> Option<String> {
    let (device, _) = adapter::device().ok()?;
    let information = device.adapter_info();
    Some(format!("{} ({})", information.name, information.backend))
}
