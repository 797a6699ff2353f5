//! wgpu devices. An engine has its own.

use std::error::Error;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::{PipelineLibrary, WgpuBackend};
use drawloom::wgpu;

/// Opens a device on the machine's best adapter.
pub fn device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    device_without(wgpu::Features::empty())
}

/// A device on the machine's best adapter. A program's cases share two: all calls on one thread get the same, and the
/// first one opens it.
///
/// # Errors
/// The error of the call that tried to open it.
pub fn shared_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    Ok(shared_by_this_thread().device.get_or_init(|| device().map_err(|error| error.to_string())).clone()?)
}

/// A backend on the [`shared_device`]. Each device compiles a pipeline once, for all its cases: that takes longer than
/// most of them draw.
pub fn shared_backend() -> Result<WgpuBackend, Box<dyn Error>> {
    let (device, queue) = shared_device()?;
    Ok(shared_by_this_thread().library.get_or_init(|| PipelineLibrary::new(device, queue)).backend()?)
}

/// What the cases on one thread share.
struct SharedDevice {
    device: OnceLock<Result<(wgpu::Device, wgpu::Queue), String>>,
    library: OnceLock<PipelineLibrary>,
}

/// A software driver has one thread for each device's queue, so cases that share a device wait for each other. A third
/// device would compile all pipelines once more.
static SHARED_DEVICES: [SharedDevice; 2] =
    [const { SharedDevice { device: OnceLock::new(), library: OnceLock::new() } }; 2];

fn shared_by_this_thread() -> &'static SharedDevice {
    static THREADS: AtomicUsize = AtomicUsize::new(0);
    thread_local! {
        static SHARED: &'static SharedDevice =
            &SHARED_DEVICES[THREADS.fetch_add(1, Ordering::Relaxed) % SHARED_DEVICES.len()];
    }
    SHARED.with(|shared| *shared)
}

/// Opens a device on the machine's best adapter, as if the adapter lacked some optional features.
pub fn device_without(missing: wgpu::Features) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let adapter = best_adapter()?;
    // Higher limits than Drawloom requires allow larger pictures and more objects.
    open(&adapter, missing, adapter.limits())
}

/// Opens a device on the machine's best adapter, without wgpu's check of indirect draws.
pub fn device_without_indirect_validation() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let adapter = best_adapter_without(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL)?;
    open(&adapter, wgpu::Features::empty(), adapter.limits())
}

/// Opens two devices of one instance on the machine's best adapter.
pub fn two_devices() -> Result<[(wgpu::Device, wgpu::Queue); 2], Box<dyn Error>> {
    let adapter = best_adapter()?;
    let device = || open(&adapter, wgpu::Features::empty(), adapter.limits());
    Ok([device()?, device()?])
}

/// Opens a device on the machine's best adapter, with these limits.
pub fn device_with_limits(limits: wgpu::Limits) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    open(&best_adapter()?, wgpu::Features::empty(), limits)
}

/// Opens a device on wgpu's no-op backend.
pub fn noop_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    noop_device_without(wgpu::Features::empty())
}

/// Opens a device on wgpu's no-op backend, as if it lacked some optional features.
pub fn noop_device_without(missing: wgpu::Features) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let (_, device, queue) = noop_instance_and_device(missing)?;
    Ok((device, queue))
}

/// Opens a device on wgpu's no-op backend in an instance of its own, which counts what the device has.
pub fn noop_instance_and_device(
    missing: wgpu::Features,
) -> Result<(wgpu::Instance, wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    // wgpu's check of indirect draws panics on this backend.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    // The adapter claims limits that wgpu itself does not support.
    let (device, queue) = open(&adapter, missing, wgpu::Limits::default())?;
    Ok((instance, device, queue))
}

fn best_adapter() -> Result<wgpu::Adapter, Box<dyn Error>> {
    best_adapter_without(wgpu::InstanceFlags::empty())
}

fn best_adapter_without(flags: wgpu::InstanceFlags) -> Result<wgpu::Adapter, Box<dyn Error>> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.flags.remove(flags);
    let instance = wgpu::Instance::new(descriptor);
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    Ok(pollster::block_on(instance.request_adapter(&options)).map_err(
        |_| "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software",
    )?)
}

fn open(
    adapter: &wgpu::Adapter,
    missing: wgpu::Features,
    required_limits: wgpu::Limits,
) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let optional = WgpuBackend::optional_features(adapter) - missing;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | optional,
        required_limits,
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
