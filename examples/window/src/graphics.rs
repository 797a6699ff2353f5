//! The device that all windows share, and the renderer on it.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{WgpuBackend, WindowDevice, WindowSurface};
use drawloom::process::{Deferred, Format, ToneMapping};
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

/// The device that all windows share, and the renderer on it.
pub struct Graphics {
    pub device: WindowDevice,
    /// For the engine's own jobs and for Drawloom's.
    pub scheduler: Arc<Scheduler>,
    pub renderer: Renderer<WgpuBackend>,
    /// Only the thread that created it, which is the one of the event loop, submits frames.
    pub submitter: Submitter<WgpuBackend>,
    /// The format of pictures: that of the first window, so that nothing is converted there.
    pub picture_format: Format,
}

impl Graphics {
    /// Opens the best device that can present in a window, and returns the window's surface too.
    ///
    /// # Errors
    /// If there is none.
    pub fn new(display: OwnedDisplayHandle, window: Arc<Window>) -> Result<(Self, WindowSurface), Box<dyn Error>> {
        let (device, surface) = WindowDevice::open(display, window)?;
        let WindowDevice { device: wgpu_device, queue, .. } = device.clone();
        // Without these, an error of the device ends the program with a panic.
        wgpu_device.on_uncaptured_error(Arc::new(|error| tracing::error!("{error}")));
        wgpu_device
            .set_device_lost_callback(|reason, message| tracing::error!("the device is lost ({reason:?}): {message}"));
        let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
        let picture_format = surface.picture_format();
        let tone_mapping = ToneMapping { format: picture_format, ..ToneMapping::new(1.2) };
        let (renderer, submitter) = Renderer::builder(WgpuBackend::new(wgpu_device, queue)?)
            .pipeline(Deferred::new().post(tone_mapping))
            // So that the inspector knows the pipeline's settings.
            .quality(Quality::balanced())
            .build(Arc::clone(&scheduler))?;
        Ok((Self { device, scheduler, renderer, submitter, picture_format }, surface))
    }
}
