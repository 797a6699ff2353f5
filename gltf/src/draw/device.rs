//! A device for worlds.

use drawloom::backend::WgpuBackend;
use drawloom::wgpu;

use super::error::DrawError;

/// Opens a device on the best adapter, with all its limits: poses and morph targets take storage buffers beyond those
/// that Drawloom requires.
///
/// # Errors
/// If there is no adapter, Drawloom was built without a backend of wgpu, or the adapter has not what Drawloom requires.
pub fn open_device() -> Result<(wgpu::Device, wgpu::Queue), DrawError> {
    // Without a backend, wgpu panics.
    if wgpu::Instance::enabled_backend_features().is_empty() {
        return Err(DrawError::NoAdapter);
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
    let adapter = adapter.map_err(|_| DrawError::NoAdapter)?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
