//! The engine's device.

use std::error::Error;

use drawloom::backend::WgpuBackend;
use drawloom::wgpu;

/// Opens a device on the best adapter, with all its limits: a column takes a storage buffer beyond those that Drawloom
/// requires.
pub fn open() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).map_err(
        |_| "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software",
    )?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
