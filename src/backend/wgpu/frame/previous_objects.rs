//! The objects of the frame before, on the device.

use std::mem;
use std::ops::Range;

use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::backend::wgpu::resources::GrowingBuffer;
use crate::view::GpuObject;

/// The objects of the frame that was submitted last, for processes that read
/// [`PREVIOUS_OBJECTS`](crate::scene::PREVIOUS_OBJECTS). A frame binds the buffer that is current when it begins. Its
/// passes read what the frame before left there, and behind them it copies its own objects over that.
pub(super) struct PreviousObjects {
    current: GrowingBuffer,
    /// The buffer that the frame submitted last has bound, and what it holds.
    latest: Option<wgpu::Buffer>,
    held: Contents,
}

/// The objects that are in a buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Contents {
    pub(super) objects: usize,
    /// The epoch of their table.
    pub(super) epoch: u64,
}

/// A range of objects, and the buffer that they are copied from.
type ObjectCopy<'a> = (&'a wgpu::Buffer, Range<usize>);

impl PreviousObjects {
    const LABEL: &str = "the objects of the frame before";

    pub(super) fn new() -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Self { current: GrowingBuffer::new(Self::LABEL, usage), latest: None, held: Contents::default() }
    }

    /// In bytes.
    pub(super) fn size(&self) -> u64 {
        self.current.size()
    }

    /// Makes room for this many objects, and returns the buffer.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(super) fn reserve(
        &mut self,
        device: &wgpu::Device,
        objects: usize,
    ) -> Result<Option<wgpu::Buffer>, BackendError> {
        self.current.reserve(device, objects * size_of::<GpuObject>())?;
        Ok(self.current.buffer().cloned())
    }

    /// What a frame that has bound a buffer copies into it: before its passes, what the buffer lacks of the frame
    /// before; behind them, the frame's `objects`. Nothing is known of the buffers until that is
    /// [submitted](Self::set_held).
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(super) fn copies(
        &mut self,
        device: &wgpu::Device,
        objects: &wgpu::Buffer,
        next: Contents,
        bound: &wgpu::Buffer,
    ) -> Result<[Option<wgpu::CommandBuffer>; 2], BackendError> {
        let (held, latest) = (mem::take(&mut self.held), self.latest.replace(bound.clone()));
        let kept = held.objects.min(next.objects);
        let moved = latest.as_ref().filter(|latest| *latest != bound && kept > 0);
        // An object that the frame before did not have is where it was.
        let new = (kept < next.objects).then_some((objects, kept..next.objects));
        let before: Vec<_> = moved.map(|latest| (latest, 0..kept)).into_iter().chain(new).collect();
        let behind: Vec<_> = (held != next).then_some((objects, 0..next.objects)).into_iter().collect();
        if before.is_empty() && behind.is_empty() {
            return Ok([None, None]);
        }
        let encode = |copies: Vec<ObjectCopy<'_>>| {
            let descriptor = wgpu::CommandEncoderDescriptor { label: Some(Self::LABEL) };
            let mut encoder = device.create_command_encoder(&descriptor);
            for (source, objects) in copies {
                let [start, end] = [objects.start, objects.end].map(|object| (object * size_of::<GpuObject>()) as u64);
                encoder.copy_buffer_to_buffer(source, start, bound, start, end - start);
            }
            encoder.finish()
        };
        with_error_scope(device, Self::LABEL, || {
            [before, behind].map(|copies| (!copies.is_empty()).then(|| encode(copies)))
        })
    }

    /// A frame with those copies was submitted, so the buffer that it has bound holds these objects.
    pub(super) fn set_held(&mut self, held: Contents) {
        self.held = held;
    }
}
