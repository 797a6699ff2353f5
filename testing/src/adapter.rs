//! wgpu devices. An engine has its own.

use std::error::Error;

use drawloom::backend::WgpuBackend;
use drawloom::wgpu;

/// Opens a device on the machine's best adapter.
pub fn device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(
        |_| "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software",
    )?;
    // Higher limits than Drawloom requires allow larger pictures and more objects.
    open(&adapter, adapter.limits())
}

/// Opens a device on wgpu's no-op backend.
pub fn noop_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    // wgpu's check of indirect draws panics on this backend.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    // The adapter claims limits that wgpu itself does not support.
    open(&adapter, wgpu::Limits::default())
}

fn open(adapter: &wgpu::Adapter, required_limits: wgpu::Limits) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    // Optional features allow indirect draws and pass times.
    let optional = adapter.features() & (WgpuBackend::OPTIONAL_FEATURES | WgpuBackend::TIMING_FEATURES);
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | optional,
        required_limits,
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
