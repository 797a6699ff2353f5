//! Buffers, textures and bind group layouts on the device.

mod attribute_set;
mod bind_group_layouts;
mod buffers;
mod cached_bind_group;
mod imported_meshes;
mod gpu_material;
mod growing_buffer;
mod imported_target;
mod light_meshes;
mod material_cache;
mod mesh_cache;
mod mesh_pages;
mod mesh_snapshot;
mod mirrored_buffer;
mod object_buffer;
mod page_set;
mod placeholder_targets;
mod range_allocator;
mod small_targets;
mod snapshot_lifetimes;
mod storage_buffers;
mod subdivided_mesh;
mod target_cache;
mod target_mip_levels;
mod target_texture;
mod texture_arrays;
mod texture_layers;
mod transient_targets;
mod upload_queue;
mod vertex_layout;
mod view_array;

pub(crate) use attribute_set::vertex_format;
pub(crate) use bind_group_layouts::{
    BindGroupLayouts, SampledTarget, binding_type, engine_layout, process_layout, texture_format,
};
pub(crate) use buffers::new_buffer;
pub(crate) use cached_bind_group::{BindingResource, CachedBindGroup};
pub(crate) use growing_buffer::{ALIGNMENT, GrowingBuffer, check_storage_binding_size, size_with_headroom};
pub(crate) use imported_meshes::{VertexSlot, VertexStreamLayouts};
pub(crate) use imported_target::ImportedTarget;
pub(crate) use light_meshes::LightMeshes;
pub(crate) use material_cache::{MaterialCache, MaterialSnapshot, MaterialTextures};
pub(crate) use mesh_cache::MeshCache;
pub(crate) use mesh_snapshot::{MeshPageIndices, MeshSnapshot, attribute_of};
pub(crate) use mirrored_buffer::MirroredBuffer;
pub(crate) use object_buffer::{ObjectBuffer, shares_memory};
pub(crate) use snapshot_lifetimes::SnapshotToken;
pub(crate) use storage_buffers::StorageBuffers;
pub(crate) use subdivided_mesh::SubdividedMesh;
pub(crate) use target_cache::{TargetCache, ViewTarget, WgpuTargets};
pub(crate) use target_texture::sample_count;
pub(crate) use upload_queue::UploadQueue;
pub(crate) use vertex_layout::{vertex_attributes, vertex_stride};
pub(crate) use view_array::shape_dimension;
