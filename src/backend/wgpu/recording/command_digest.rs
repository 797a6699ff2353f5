//! A digest of the commands that an engine's code records: equal commands have equal digests. By it, builds with debug
//! assertions find items whose versions do not say that they changed.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use wgpu::util::RenderEncoder;
use wgpu::{BindGroup, Buffer, BufferSlice, IndexFormat, RenderPipeline};

/// Takes the digest of commands, and hands them on to an encoder, if there is one.
pub(super) struct CommandDigest<'i, 'a> {
    inner: Option<&'i mut dyn RenderEncoder<'a>>,
    hasher: DefaultHasher,
}

impl<'i, 'a> CommandDigest<'i, 'a> {
    pub(super) fn new(inner: Option<&'i mut dyn RenderEncoder<'a>>) -> Self {
        Self { inner, hasher: DefaultHasher::new() }
    }

    /// The digest of all commands so far.
    pub(super) fn value(&self) -> u64 {
        self.hasher.finish()
    }

    /// Adds a command: its name, and its arguments.
    fn add(&mut self, command: &str, arguments: impl Hash) {
        (command, arguments).hash(&mut self.hasher);
    }
}

/// What a slice of a buffer is known by.
fn slice(of: &BufferSlice<'_>) -> (u64, u64, u64) {
    let mut hasher = DefaultHasher::new();
    of.buffer().hash(&mut hasher);
    (hasher.finish(), of.offset(), of.size())
}

impl<'a> RenderEncoder<'a> for CommandDigest<'_, 'a> {
    fn set_bind_group(&mut self, index: u32, bind_group: Option<&'a BindGroup>, offsets: &[u32]) {
        self.add("bind group", (index, bind_group, offsets));
        if let Some(inner) = &mut self.inner {
            inner.set_bind_group(index, bind_group, offsets);
        }
    }

    fn set_pipeline(&mut self, pipeline: &'a RenderPipeline) {
        self.add("pipeline", pipeline);
        if let Some(inner) = &mut self.inner {
            inner.set_pipeline(pipeline);
        }
    }

    fn set_index_buffer(&mut self, buffer: BufferSlice<'a>, format: IndexFormat) {
        self.add("index buffer", (slice(&buffer), format));
        if let Some(inner) = &mut self.inner {
            inner.set_index_buffer(buffer, format);
        }
    }

    fn set_vertex_buffer(&mut self, slot: u32, buffer: Option<BufferSlice<'a>>) {
        self.add("vertex buffer", (slot, buffer.as_ref().map(slice)));
        if let Some(inner) = &mut self.inner {
            inner.set_vertex_buffer(slot, buffer);
        }
    }

    fn draw(&mut self, vertices: Range<u32>, instances: Range<u32>) {
        self.add("draw", (&vertices, &instances));
        if let Some(inner) = &mut self.inner {
            inner.draw(vertices, instances);
        }
    }

    fn draw_indexed(&mut self, indices: Range<u32>, base_vertex: i32, instances: Range<u32>) {
        self.add("indexed draw", (&indices, base_vertex, &instances));
        if let Some(inner) = &mut self.inner {
            inner.draw_indexed(indices, base_vertex, instances);
        }
    }

    fn draw_indirect(&mut self, buffer: &'a Buffer, offset: u64) {
        self.add("indirect draw", (buffer, offset));
        if let Some(inner) = &mut self.inner {
            inner.draw_indirect(buffer, offset);
        }
    }

    fn draw_indexed_indirect(&mut self, buffer: &'a Buffer, offset: u64) {
        self.add("indexed indirect draw", (buffer, offset));
        if let Some(inner) = &mut self.inner {
            inner.draw_indexed_indirect(buffer, offset);
        }
    }

    fn set_immediates(&mut self, offset: u32, data: &[u8]) {
        self.add("immediates", (offset, data));
        if let Some(inner) = &mut self.inner {
            inner.set_immediates(offset, data);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;

    /// Counts the calls that reach it.
    #[derive(Default)]
    struct Counter(usize);

    impl<'a> RenderEncoder<'a> for Counter {
        fn set_bind_group(&mut self, _: u32, _: Option<&'a BindGroup>, _: &[u32]) {
            self.0 += 1;
        }

        fn set_pipeline(&mut self, _: &'a RenderPipeline) {
            self.0 += 1;
        }

        fn set_index_buffer(&mut self, _: BufferSlice<'a>, _: IndexFormat) {
            self.0 += 1;
        }

        fn set_vertex_buffer(&mut self, _: u32, _: Option<BufferSlice<'a>>) {
            self.0 += 1;
        }

        fn draw(&mut self, _: Range<u32>, _: Range<u32>) {
            self.0 += 1;
        }

        fn draw_indexed(&mut self, _: Range<u32>, _: i32, _: Range<u32>) {
            self.0 += 1;
        }

        fn draw_indirect(&mut self, _: &'a Buffer, _: u64) {
            self.0 += 1;
        }

        fn draw_indexed_indirect(&mut self, _: &'a Buffer, _: u64) {
            self.0 += 1;
        }

        fn set_immediates(&mut self, _: u32, _: &[u8]) {
            self.0 += 1;
        }
    }

    type Record<'a> = Box<dyn Fn(&mut dyn RenderEncoder<'a>) + 'a>;

    /// Commands that differ from each other.
    fn commands<'a>([one, other]: [&'a Buffer; 2]) -> Vec<Record<'a>> {
        let format = IndexFormat::Uint16;
        vec![
            Box::new(move |encoder| encoder.set_bind_group(0, None, &[])),
            Box::new(move |encoder| encoder.set_bind_group(1, None, &[])),
            Box::new(move |encoder| encoder.set_bind_group(0, None, &[4])),
            Box::new(|encoder| encoder.draw(0..3, 0..1)),
            Box::new(|encoder| encoder.draw(0..4, 0..1)),
            Box::new(|encoder| encoder.draw(0..3, 1..2)),
            Box::new(|encoder| encoder.draw_indexed(0..3, 0, 0..1)),
            Box::new(|encoder| encoder.draw_indexed(0..3, 1, 0..1)),
            Box::new(|encoder| encoder.draw_indexed(0..3, 0, 1..2)),
            Box::new(|encoder| encoder.draw_indexed(3..6, 0, 0..1)),
            Box::new(|encoder| encoder.set_immediates(0, &[1])),
            Box::new(|encoder| encoder.set_immediates(4, &[1])),
            Box::new(|encoder| encoder.set_immediates(0, &[2])),
            Box::new(move |encoder| encoder.set_vertex_buffer(0, None)),
            Box::new(move |encoder| encoder.set_vertex_buffer(1, None)),
            Box::new(move |encoder| encoder.set_vertex_buffer(0, Some(one.slice(..)))),
            Box::new(move |encoder| encoder.set_vertex_buffer(0, Some(one.slice(4..)))),
            Box::new(move |encoder| encoder.set_vertex_buffer(0, Some(one.slice(..4)))),
            Box::new(move |encoder| encoder.set_vertex_buffer(0, Some(other.slice(..)))),
            Box::new(move |encoder| encoder.set_index_buffer(one.slice(..), format)),
            Box::new(move |encoder| encoder.set_index_buffer(one.slice(..), IndexFormat::Uint32)),
            Box::new(move |encoder| encoder.set_index_buffer(other.slice(..), format)),
            Box::new(move |encoder| encoder.draw_indirect(one, 0)),
            Box::new(move |encoder| encoder.draw_indirect(one, 4)),
            Box::new(move |encoder| encoder.draw_indirect(other, 0)),
            Box::new(move |encoder| encoder.draw_indexed_indirect(one, 0)),
            Box::new(move |encoder| encoder.draw_indexed_indirect(one, 4)),
        ]
    }

    #[test]
    fn other_commands_have_other_digests_and_all_are_handed_on() {
        let (device, _) = noop_device();
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::INDEX | wgpu::BufferUsages::INDIRECT;
        let descriptor = wgpu::BufferDescriptor { label: None, size: 64, usage, mapped_at_creation: false };
        let [one, other] = [(); 2].map(|()| device.create_buffer(&descriptor));
        let commands = commands([&one, &other]);
        let mut digests = vec![CommandDigest::new(None).value()];
        for command in &commands {
            let mut counter = Counter::default();
            let mut digest = CommandDigest::new(Some(&mut counter));
            command(&mut digest);
            let value = digest.value();
            let mut again = CommandDigest::new(None);
            command(&mut again);
            assert_eq!((again.value(), counter.0), (value, 1));
            digests.push(value);
        }
        digests.sort_unstable();
        digests.dedup();
        assert_eq!(digests.len(), commands.len() + 1);
    }
}
