//! A device that takes a given time for a frame.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, BackendError, BackendLayer, FrameFence, Picture, ViewQueue};
use drawloom::process::ShaderResource;
use drawloom_async_post::UploadPicture;

/// Wraps a backend whose frames need no device time, and adds a device that draws one frame after the other and takes a
/// given time for each. Its passes take equal shares of that time.
pub struct SimulatedDevice<B> {
    inner: B,
    /// The times of the next frames, before `frame_time`.
    next_times: Mutex<VecDeque<Duration>>,
    frame_time: Duration,
    device: Arc<Device>,
}

/// The device's thread. It ends with the last backend on it.
struct Device {
    /// `None` once it ends.
    frames: Option<Sender<DeviceFrame>>,
    thread: Option<JoinHandle<()>>,
}

/// A frame that the device draws.
struct DeviceFrame {
    submitted: Instant,
    time: Duration,
    passes: usize,
    fences: Vec<FrameFence>,
}

impl<B> SimulatedDevice<B> {
    /// A device that takes so long for each frame.
    pub fn new(inner: B, frame_time: Duration) -> Self {
        let (frames, received) = channel();
        let thread = thread::spawn(move || draw_frames(&received));
        let device = Arc::new(Device { frames: Some(frames), thread: Some(thread) });
        Self { inner, next_times: Mutex::default(), frame_time, device }
    }

    /// Another backend on the same device, which takes so long for each of its frames: those of both are drawn in the
    /// order in which they are submitted.
    pub fn beside<C>(&self, inner: C, frame_time: Duration) -> SimulatedDevice<C> {
        SimulatedDevice { inner, next_times: Mutex::default(), frame_time, device: Arc::clone(&self.device) }
    }

    /// The times of the frames that are submitted next, in order. Those after them take the usual time.
    pub fn with_next_times(self, times: impl IntoIterator<Item = Duration>) -> Self {
        self.next_times.lock().unwrap().extend(times);
        self
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.frames = None;
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

fn draw_frames(frames: &Receiver<DeviceFrame>) {
    let mut free = Instant::now();
    for DeviceFrame { submitted, time, passes, fences } in frames {
        let start = free.max(submitted);
        for fence in fences {
            let share = if passes == 0 { 1.0 } else { fence.passes as f64 / passes as f64 };
            sleep_until(start + time.mul_f64(share));
            fence.setter.set();
        }
        free = start + time;
        sleep_until(free);
    }
}

/// More exact than a sleep alone, which may take a tenth of a millisecond more.
fn sleep_until(time: Instant) {
    const SPIN: Duration = Duration::from_micros(200);
    if let Some(rest) = time.checked_duration_since(Instant::now()).and_then(|rest| rest.checked_sub(SPIN)) {
        thread::sleep(rest);
    }
    while Instant::now() < time {
        thread::yield_now();
    }
}

impl<B: Backend> BackendLayer for SimulatedDevice<B> {
    type Inner = B;

    fn inner(&self) -> &B {
        &self.inner
    }

    fn adapter_name(&self) -> String {
        format!("{}, {:?} a frame", self.inner.adapter_name(), self.frame_time)
    }

    fn submit(
        &self,
        frame: B::Frame,
        queues: Vec<ViewQueue<B::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<B::Submission, BackendError> {
        let passes = queues.iter().map(|queue| queue.passes.len()).sum();
        let submission = self.inner.submit(frame, queues, Vec::new())?;
        let time = self.next_times.lock().unwrap().pop_front().unwrap_or(self.frame_time);
        let frame = DeviceFrame { submitted: Instant::now(), time, passes, fences };
        self.device
            .frames
            .as_ref()
            .expect("it ends when it is dropped")
            .send(frame)
            .expect("the device runs until then");
        Ok(submission)
    }
}

impl<B: UploadPicture> UploadPicture for SimulatedDevice<B> {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        self.inner.upload_picture(picture)
    }
}
