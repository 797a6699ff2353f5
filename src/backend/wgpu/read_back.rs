//! Reading back parts of targets without waiting for the device.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use super::error_scope::{poll, with_error_scope};
use super::resources::{ViewTarget, WgpuTargets};
use crate::backend::{BackendError, Picture, ReadBack};
use crate::process::Format;

/// A rectangle of a target as one frame leaves it, on its way back to the CPU: see
/// [`RecordedFrame::read_back`](crate::RecordedFrame::read_back).
pub struct WgpuReadBack {
    device: wgpu::Device,
    buffer: wgpu::Buffer,
    size: [u32; 2],
    format: Format,
    /// Shared with the copy while that is not submitted, and then with the callback of the mapping.
    progress: Arc<Progress>,
}

struct Progress {
    state: Mutex<State>,
    /// Notified when the buffer is mapped, or will not be.
    ended: Condvar,
}

/// How far a read-back is.
#[derive(Debug)]
enum State {
    /// Its frame is not submitted.
    Recorded,
    /// The device may not be done with it.
    Submitted(wgpu::SubmissionIndex),
    Done,
    Failed(String),
}

impl WgpuReadBack {
    /// A thread that is about to run a callback does so much sooner, however busy the machine is.
    const MAX_CALLBACK_DELAY: Duration = Duration::from_secs(30);

    /// The pixels, if the device is done with the frame; `None` if it is not, or the frame is not submitted yet. It
    /// does not wait.
    ///
    /// # Errors
    /// If the frame was dropped, or the device is lost.
    pub fn try_read(&self) -> Result<Option<Picture>, BackendError> {
        poll(&self.device, wgpu::PollType::Poll)?;
        match &*self.progress.state.lock() {
            State::Recorded if Arc::strong_count(&self.progress) == 1 => Err(BackendError::NotSubmitted),
            State::Recorded | State::Submitted(_) => Ok(None),
            State::Done => self.picture().map(Some),
            State::Failed(message) => Err(BackendError::DeviceLost { message: message.clone() }),
        }
    }

    /// Waits until the device is done with the frame, which is submitted, and returns the pixels.
    ///
    /// # Errors
    /// If the frame is not submitted, or the device is lost.
    pub fn read(&self) -> Result<Picture, BackendError> {
        let submitted = |state: &State| match state {
            State::Submitted(index) => Some(index.clone()),
            _ => None,
        };
        let mut index = submitted(&self.progress.state.lock());
        if index.is_none() {
            if let Some(picture) = self.try_read()? {
                return Ok(picture);
            }
            // Another thread may have submitted it meanwhile.
            index = submitted(&self.progress.state.lock());
        }
        if index.is_none() && matches!(*self.progress.state.lock(), State::Recorded) {
            return Err(BackendError::NotSubmitted);
        }
        poll(&self.device, wgpu::PollType::Wait { submission_index: index, timeout: None })?;
        // The device is done with the frame, so the callback has run, or another thread that polled is about to run it.
        let deadline = Instant::now() + Self::MAX_CALLBACK_DELAY;
        let mut state = self.progress.state.lock();
        while matches!(*state, State::Recorded | State::Submitted(_)) {
            if self.progress.ended.wait_until(&mut state, deadline).timed_out() {
                return Err(BackendError::Timeout { timeout: Self::MAX_CALLBACK_DELAY });
            }
        }
        drop(state);
        self.try_read()?.ok_or(BackendError::NotSubmitted)
    }

    fn picture(&self) -> Result<Picture, BackendError> {
        let lost = |error: wgpu::MapRangeError| BackendError::DeviceLost { message: error.to_string() };
        let padded = self.buffer.get_mapped_range(..).map_err(lost)?;
        let ([width, height], format) = (self.size, self.format);
        let row_length = width as usize * format.bytes();
        let mut bytes = Vec::with_capacity(row_length * height as usize);
        // A row at a time, which is several times as fast as byte by byte.
        for row in padded.chunks_exact(padded_row(width, format)) {
            bytes.extend_from_slice(&row[..row_length]);
        }
        Ok(Picture { width, height, format, bytes })
    }
}

impl ReadBack for WgpuReadBack {
    fn try_read(&self) -> Result<Option<Picture>, BackendError> {
        Self::try_read(self)
    }

    fn read(&self) -> Result<Picture, BackendError> {
        Self::read(self)
    }
}

/// A copy of a rectangle to a buffer, made when its frame is submitted.
pub(crate) struct ReadBackCopy {
    target: ViewTarget,
    origin: [u32; 2],
    size: [u32; 2],
    buffer: wgpu::Buffer,
    progress: Arc<Progress>,
}

impl ReadBackCopy {
    /// Encodes it behind the frame's passes.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let ([x, y], [width, height]) = (self.origin, self.size);
        let source = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x, y, z: self.target.layer },
            ..self.target.texture.as_image_copy()
        };
        let bytes_per_row = Some(padded_row(width, self.target.format()) as u32);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        let destination = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(source, destination, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
    }

    /// Maps the buffer when the device is done with the frame, which was submitted.
    pub(crate) fn submitted(self, device: &wgpu::Device, index: &wgpu::SubmissionIndex) {
        let Self { buffer, progress, .. } = self;
        let in_callback = Arc::clone(&progress);
        let mapped = move |result: Result<(), wgpu::BufferAsyncError>| {
            *in_callback.state.lock() = match result {
                Ok(()) => State::Done,
                Err(error) => State::Failed(error.to_string()),
            };
            in_callback.ended.notify_all();
        };
        // The buffer of a device that is lost by now is invalid.
        if let Err(error) = with_error_scope(device, "read back", || buffer.map_async(wgpu::MapMode::Read, .., mapped))
        {
            *progress.state.lock() = State::Failed(error.to_string());
            progress.ended.notify_all();
            return;
        }
        // Set only after the request, so a thread that sees it and waits for the submission finds the buffer mapped.
        // Another thread may have polled already.
        let mut state = progress.state.lock();
        if matches!(*state, State::Recorded) {
            *state = State::Submitted(index.clone());
        }
    }
}

/// A read-back of a rectangle of a view's target, and the copy that its frame makes for it.
///
/// # Errors
/// If there is no such target, it is transient, it cannot be copied from, or the rectangle is empty, not in it, or a
/// part of a depth target.
pub(crate) fn new_read_back(
    device: &wgpu::Device,
    targets: &WgpuTargets,
    view: usize,
    target: &str,
    [origin, size]: [[u32; 2]; 2],
) -> Result<(WgpuReadBack, ReadBackCopy), BackendError> {
    let found = targets.find(view, target)?.clone();
    if found.is_transient() {
        return Err(BackendError::TransientTarget { view, target: target.to_owned() });
    }
    let (whole, format) = ([found.texture.width(), found.texture.height()], found.format());
    let is_within = |axis: usize| origin[axis].checked_add(size[axis]).is_some_and(|end| end <= whole[axis]);
    let problem = if size.contains(&0) {
        Some("it is empty")
    } else if !(0..2).all(is_within) {
        Some("it is not within the target")
    } else if found.texture.sample_count() > 1 {
        Some("it is multisampled: resolve it, and read the resolved target")
    } else if !found.texture.usage().contains(wgpu::TextureUsages::COPY_SRC) {
        Some("it is an imported texture without the usage COPY_SRC")
    } else if format.has_depth() && format.has_stencil() {
        Some("depth with a stencil is not read back")
    } else if format.is_depth_stencil() && size != whole {
        Some("no device copies a part of depth or of a stencil")
    } else {
        None
    };
    if let Some(problem) = problem {
        return Err(BackendError::InvalidReadBack { view, target: target.to_owned(), origin, size, whole, problem });
    }
    let descriptor = wgpu::BufferDescriptor {
        label: Some("read back"),
        size: padded_row(size[0], format) as u64 * u64::from(size[1]),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    };
    let buffer = with_error_scope(device, target, || device.create_buffer(&descriptor))?;
    let progress = Arc::new(Progress { state: Mutex::new(State::Recorded), ended: Condvar::new() });
    let copy = ReadBackCopy { target: found, origin, size, buffer: buffer.clone(), progress: Arc::clone(&progress) };
    Ok((WgpuReadBack { device: device.clone(), buffer, size, format, progress }, copy))
}

/// The number of bytes of a row in a buffer.
fn padded_row(width: u32, format: Format) -> usize {
    (width as usize * format.bytes()).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize)
}
