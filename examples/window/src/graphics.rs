//! The device that all windows share, and the renderer on it.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::process::{Deferred, Format, ToneMapping};
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, wgpu};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

/// The device that all windows share, and the renderer on it.
pub struct Graphics {
    pub instance: wgpu::Instance,
    pub adapter: wgpu::Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// For the engine's own jobs and for Drawloom's.
    pub scheduler: Arc<Scheduler>,
    pub renderer: Renderer<WgpuBackend>,
    /// Only the thread that created it, which is the one of the event loop, submits frames.
    pub submitter: Submitter<WgpuBackend>,
    /// The format of the pictures: sRGB.
    pub format: wgpu::TextureFormat,
}

impl Graphics {
    /// Opens the best device that can present in a window, and returns the window's surface too.
    ///
    /// # Errors
    /// If there is none.
    pub fn new(
        display: OwnedDisplayHandle,
        window: &Arc<Window>,
    ) -> Result<(Self, wgpu::Surface<'static>), Box<dyn Error>> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display)));
        let surface = instance.create_surface(Arc::clone(window))?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..wgpu::RequestAdapterOptions::default()
        }))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        }))?;
        // Without these, an error of the device ends the program with a panic.
        device.on_uncaptured_error(Arc::new(|error| tracing::error!("{error}")));
        device
            .set_device_lost_callback(|reason, message| tracing::error!("the device is lost ({reason:?}): {message}"));
        // The first format of the surface that the renderer can draw, so that nothing is converted.
        let formats = surface.get_capabilities(&adapter).formats.into_iter().map(|format| format.remove_srgb_suffix());
        let eight_bits = [wgpu::TextureFormat::Bgra8Unorm, wgpu::TextureFormat::Rgba8Unorm];
        let first = formats.into_iter().find(|format| eight_bits.contains(format));
        let (format, picture_format) = match first {
            Some(wgpu::TextureFormat::Bgra8Unorm) => (wgpu::TextureFormat::Bgra8UnormSrgb, Format::Bgra8Srgb),
            _ => (wgpu::TextureFormat::Rgba8UnormSrgb, Format::Rgba8Srgb),
        };
        let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
        let tone_mapping = ToneMapping { format: picture_format, ..ToneMapping::new(1.2) };
        let (renderer, submitter) = Renderer::builder(WgpuBackend::new(device.clone(), queue.clone())?)
            .deferred(Deferred::new().post(tone_mapping))
            // So that the inspector knows the pipeline's settings.
            .quality(Quality::balanced())
            .build(Arc::clone(&scheduler))?;
        Ok((Self { instance, adapter, device, queue, scheduler, renderer, submitter, format }, surface))
    }
}
