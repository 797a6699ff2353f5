//! Query sets, and what their timestamps are of.

/// Bytes of one timestamp.
const TIMESTAMP_BYTES: u64 = wgpu::QUERY_SIZE as u64;

/// The names of a pass's process and view.
pub(crate) struct PassName {
    pub(crate) process: String,
    pub(crate) view: String,
}

/// The size of both timestamps of this many passes.
pub(crate) fn timestamp_bytes(passes: usize) -> usize {
    passes * 2 * TIMESTAMP_BYTES as usize
}

/// A query set for `count` timestamps.
pub(crate) fn new_query_set(device: &wgpu::Device, count: u32) -> wgpu::QuerySet {
    let descriptor = wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count };
    device.create_query_set(&descriptor)
}
