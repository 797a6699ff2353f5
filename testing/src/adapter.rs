//! A device for this program. An engine has one already.

use std::error::Error;

use drawloom::backend::WgpuBackend;
use drawloom::wgpu;

/// The machine's best adapter, as a device.
pub fn device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(
        |_| "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software",
    )?;
    // Whatever the adapter has beyond what Drawloom needs allows larger pictures and more objects.
    open(&adapter, adapter.limits())
}

/// wgpu's backend that does nothing.
pub fn noop_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    // On this backend alone wgpu's check of indirect draws panics.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    // It claims limits that wgpu itself does not keep.
    open(&adapter, wgpu::Limits::default())
}

fn open(adapter: &wgpu::Adapter, required_limits: wgpu::Limits) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    // Not needed, but with them there is one more way to record, and passes can be timed.
    let welcome = adapter.features() & (WgpuBackend::OPTIONAL_FEATURES | WgpuBackend::TIMING_FEATURES);
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | welcome,
        required_limits,
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
