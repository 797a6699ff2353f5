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
    open(&adapter)
}

/// wgpu's backend that does nothing.
pub fn noop_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    open(&pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?)
}

fn open(adapter: &wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES,
        // Whatever the adapter has beyond what Drawloom needs allows larger pictures and more objects.
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
