//! Buffers, textures and bind group layouts on the device.

mod bind_groups;
mod buffers;
mod imported_meshes;
mod imported_target;
mod light_meshes;
mod material_cache;
mod mesh_cache;
mod mesh_check;
mod mesh_pages;
mod mesh_room;
mod mesh_snapshot;
mod page_set;
mod placeholder_targets;
mod range_allocator;
mod residents;
mod small_targets;
mod snapshot_lifetimes;
mod storage_buffers;
mod target_cache;
mod target_mip_levels;
mod target_texture;
mod texture_arrays;
mod texture_layers;
mod texture_streaming;
mod transient_targets;
mod vertex_data;
mod view_array;

pub(crate) use bind_groups::{
    BindGroupLayouts, BindingResource, CachedBindGroup, SampledTarget, binding_type, engine_layout_entries,
    process_layout_entries, texture_format,
};
pub(crate) use buffers::{
    ALIGNMENT, CountedQueue, GrowingBuffer, MirroredBuffer, check_storage_binding_size, size_with_headroom,
};
pub(crate) use imported_meshes::{ImportedMeshes, VertexSlot, VertexStreamLayouts};
pub(crate) use imported_target::ImportedTarget;
pub(crate) use light_meshes::LightMeshes;
pub(crate) use material_cache::{MaterialCache, MaterialSnapshot, MaterialTextures};
pub(crate) use mesh_cache::{MeshBudget, MeshCache};
pub(crate) use mesh_check::{check_mesh, fits_in_buffers};
pub(crate) use mesh_pages::{MeshTarget, ResidentMeshes};
pub(crate) use mesh_snapshot::{MeshPageIndices, MeshSnapshot, attribute_of};
pub(crate) use residents::{EndOfUpload, InFlight, Placed, Unplaced};
pub(crate) use snapshot_lifetimes::{LastReader, SnapshotToken};
pub(crate) use storage_buffers::StorageBuffers;
pub(crate) use target_cache::{TargetCache, ViewTarget, WgpuTargets};
pub(crate) use target_texture::sample_count;
pub(crate) use texture_arrays::{ResidentTextures, TextureLocation};
pub(crate) use texture_layers::copy_rows;
pub(crate) use texture_streaming::ArrayBudget;
pub(crate) use vertex_data::{SubdividedMesh, vertex_attributes, vertex_format, vertex_stride};
pub(crate) use view_array::shape_dimension;
