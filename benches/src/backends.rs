//! The wgpu backends that benchmarks run on. Results of different backends are never compared.

use std::error::Error;

use clap::ValueEnum;
use drawloom::backend::WgpuBackend;
use drawloom::wgpu;
use drawloom_testing::adapter;
use serde::Serialize;

/// A wgpu backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum BackendName {
    /// wgpu's no-op backend, which measures the CPU part of a frame.
    Noop,
    /// The machine's adapter.
    Adapter,
}

impl BackendName {
    pub const ALL: &[Self] = &[Self::Noop, Self::Adapter];

    /// This backend's value of a pair.
    pub fn of<T>(self, [noop, adapter]: [T; 2]) -> T {
        match self {
            Self::Noop => noop,
            Self::Adapter => adapter,
        }
    }

    pub fn name(self) -> &'static str {
        self.of(["noop", "adapter"])
    }

    /// Opens a new device.
    ///
    /// # Errors
    /// Returns an error if no device can be opened.
    pub fn device(self) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
        match self {
            Self::Noop => adapter::noop_device(),
            Self::Adapter => adapter::device(),
        }
    }

    /// A backend on a new device.
    ///
    /// # Errors
    /// Returns an error if no device can be opened.
    pub fn open(self) -> Result<WgpuBackend, Box<dyn Error>> {
        let (device, queue) = self.device()?;
        Ok(WgpuBackend::new(device, queue)?)
    }
}

/// The name of the machine's adapter, if it has one.
pub fn adapter_name() -> Option<String> {
    let (device, _) = adapter::device().ok()?;
    let information = device.adapter_info();
    Some(format!("{} ({})", information.name, information.backend))
}
