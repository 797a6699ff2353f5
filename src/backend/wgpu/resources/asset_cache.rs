//! The cache of meshes, materials and textures on the device.

use std::sync::Arc;

use super::arena::{Arena, filled_buffer};
use super::attribute_arenas::{AttributeArenas, AttributeBuffers};
use super::bind_group_layouts::BindGroupLayouts;
use super::device_meshes::DeviceMeshes;
use super::gpu_material::GpuMaterial;
use super::growing_buffer::check_storage_binding_size;
use super::texture_arrays::{TextureArrays, TextureLocation};
use super::upload_queue::UploadQueue;
use super::vertex_layout::{vertex_stride, with_vertex_bytes};
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::subdivision_cache::missing_mesh_error;
use crate::command::Batch;
use crate::process::DeclaredAttribute;
use crate::quality::VertexFormat;
use crate::scene::{Assets, AttributeLayout, Material, Mesh};
use crate::view::{RejectionReason, Rejections};

/// The meshes, materials and textures of a frame. It stays valid while assets change for later frames.
pub(crate) struct AssetSnapshot {
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    attributes: AttributeBuffers,
    /// By mesh slot.
    meshes: Vec<Option<MeshRange>>,
    /// Those that are not in the arenas.
    pub(crate) device_meshes: DeviceMeshes,
    /// Materials and textures: `@group(1)`.
    pub(crate) group: wgpu::BindGroup,
}

impl AssetSnapshot {
    /// The range of a batch's mesh in the arenas.
    ///
    /// # Errors
    /// If there is no such mesh. This is a bug in Drawloom.
    pub(crate) fn mesh_range(&self, batch: &Batch) -> Result<MeshRange, BackendError> {
        let mesh = self.meshes.get(batch.mesh as usize).copied().flatten();
        mesh.ok_or_else(missing_mesh_error)
    }

    /// Whether one pipeline of each process draws both batches.
    pub(crate) fn share_pipeline(&self, one: &Batch, other: &Batch) -> bool {
        one.state == other.state
            && (self.device_meshes.is_empty() || self.device_meshes.have_equal_layouts(one.mesh, other.mesh))
    }

    /// The values of an attribute of all meshes in the arenas.
    ///
    /// # Errors
    /// If no plan has required it. This is a bug in Drawloom.
    pub(crate) fn attribute(&self, layout: AttributeLayout) -> Result<&wgpu::Buffer, BackendError> {
        attribute_of(&self.attributes, layout)
    }
}

/// The buffer of an attribute.
///
/// # Errors
/// If there is none. This is a bug in Drawloom.
pub(crate) fn attribute_of(
    attributes: &AttributeBuffers,
    layout: AttributeLayout,
) -> Result<&wgpu::Buffer, BackendError> {
    let found = attributes.iter().find(|(known, _)| *known == layout);
    found.map(|(_, buffer)| buffer).ok_or_else(|| broken_rule("attributes are uploaded before they are drawn"))
}

/// The range of a mesh in the arenas.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshRange {
    pub(crate) base_vertex: i32,
    pub(crate) first_index: u32,
    pub(crate) index_count: u32,
    revision: u64,
}

/// Keeps meshes, materials and textures on the device, and uploads those that changed since the last frame.
pub(crate) struct AssetCache {
    vertices: Arena,
    /// Of the vertices in the arena.
    format: VertexFormat,
    indices: Arena,
    attributes: AttributeArenas,
    meshes: Vec<Option<MeshRange>>,
    device_meshes: DeviceMeshes,
    textures: TextureArrays,
    /// Identities and revisions of the snapshot's meshes, materials and textures.
    current: Option<[(u64, u64); 3]>,
    snapshot: Option<Arc<AssetSnapshot>>,
    /// Rejections that making the snapshot found. Every frame that uses the snapshot reports them.
    rejected: Vec<(RejectionReason, usize)>,
}

impl Default for AssetCache {
    fn default() -> Self {
        Self {
            vertices: new_vertex_arena(),
            format: VertexFormat::default(),
            indices: Arena::new("indices", wgpu::BufferUsages::INDEX),
            attributes: AttributeArenas::default(),
            meshes: Vec::new(),
            device_meshes: DeviceMeshes::default(),
            textures: TextureArrays::default(),
            current: None,
            snapshot: None,
            rejected: Vec::new(),
        }
    }
}

impl AssetCache {
    /// Adds the attributes that a plan's processes read. Returns whether one of them is new.
    pub(crate) fn require_attributes(&mut self, attributes: &[DeclaredAttribute]) -> bool {
        let changed = self.attributes.require(attributes);
        if changed {
            // Nothing fits into an arena without room, so all meshes move to a new one, with all attributes.
            self.vertices = new_vertex_arena();
            self.current = None;
        }
        changed
    }

    /// The attributes of a mesh in buffers of its own.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn attributes_of(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        mesh: &Mesh,
    ) -> Result<AttributeBuffers, BackendError> {
        self.attributes.of_mesh(device, uploads, mesh)
    }

    /// The snapshot of these assets, with vertices of this format: the latest one if nothing changed.
    ///
    /// # Errors
    /// If the device has no room for them.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        layouts: &BindGroupLayouts,
        assets: &Assets,
        vertices: VertexFormat,
        rejections: &Rejections,
    ) -> Result<Arc<AssetSnapshot>, BackendError> {
        let requested = [
            (assets.meshes.identity(), assets.meshes.revision()),
            (assets.materials.identity(), assets.materials.revision()),
            (assets.textures.identity(), assets.textures.revision()),
        ];
        let snapshot = match &self.snapshot {
            Some(snapshot) if self.current == Some(requested) && self.format == vertices => Arc::clone(snapshot),
            _ => {
                if self.format != vertices {
                    // `base_vertex` counts in vertices, so all vertices in an arena have one size.
                    (self.vertices, self.format) = (new_vertex_arena(), vertices);
                    self.meshes.clear();
                }
                if self.current.is_none_or(|current| current[0].0 != requested[0].0) {
                    self.meshes.clear();
                }
                self.rejected.clear();
                // No snapshot is current until the new one is complete, so an error leaves no partial one behind.
                self.current = None;
                self.update_meshes(device, uploads, assets)?;
                let meshes = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
                let attributes = self.attributes.required();
                self.device_meshes = self.device_meshes.updated(device, uploads, meshes, attributes)?;
                self.textures.update(device, uploads, assets, &mut self.rejected);
                let snapshot = Arc::new(self.snapshot(device, uploads, layouts, assets)?);
                self.current = Some(requested);
                self.snapshot = Some(Arc::clone(&snapshot));
                snapshot
            }
        };
        for &(reason, index) in &self.rejected {
            rejections.count(reason, index);
        }
        Ok(snapshot)
    }

    fn update_meshes(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        assets: &Assets,
    ) -> Result<(), BackendError> {
        self.meshes.resize(assets.meshes.slot_count(), None);
        let mut live = vec![false; self.meshes.len()];
        let mut changed = Vec::new();
        for (handle, revision, mesh) in assets.meshes.iter_with_revision() {
            let slot = handle.index() as usize;
            live[slot] = true;
            if self.meshes[slot].is_none_or(|range| range.revision != revision) {
                changed.push((slot, revision, mesh));
            }
        }
        for (range, live) in self.meshes.iter_mut().zip(live) {
            if !live {
                *range = None;
            }
        }
        let format = self.format;
        let bytes = changed.iter().map(|(_, _, mesh)| bytes_of(mesh, format));
        let (vertex_bytes, index_bytes) = bytes.fold((0, 0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
        if !self.vertices.fits(vertex_bytes) || !self.indices.fits(index_bytes) {
            // All live meshes move to new buffers, which leaves the garbage behind.
            let bytes = assets.iter::<Mesh>().map(|(_, mesh)| bytes_of(mesh, format));
            let (vertex_bytes, index_bytes) = bytes.fold((0, 0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
            self.vertices.reallocate(device, vertex_bytes)?;
            self.indices.reallocate(device, index_bytes)?;
            self.attributes.reallocate(device, self.vertices.size() / vertex_stride(format))?;
            changed = assets
                .meshes
                .iter_with_revision()
                .map(|(handle, revision, mesh)| (handle.index() as usize, revision, mesh))
                .collect();
        }
        for (slot, revision, mesh) in changed {
            let vertices = with_vertex_bytes(mesh, format, |bytes| self.vertices.append(uploads, bytes));
            let indices = self.indices.append(uploads, bytemuck::cast_slice(mesh.indices()));
            self.attributes.write(uploads, mesh, vertices / vertex_stride(format));
            self.meshes[slot] = Some(MeshRange {
                base_vertex: (vertices / vertex_stride(format)) as i32,
                first_index: (indices / 4) as u32,
                index_count: mesh.indices().len() as u32,
                revision,
            });
        }
        Ok(())
    }

    fn snapshot(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        layouts: &BindGroupLayouts,
        assets: &Assets,
    ) -> Result<AssetSnapshot, BackendError> {
        let mut materials = vec![GpuMaterial::default(); assets.materials.slot_count().max(1)];
        for (handle, material) in assets.iter::<Material>() {
            let texture = self.texture_location(assets, handle.index(), material);
            materials[handle.index() as usize] = GpuMaterial::new(material, texture);
        }
        let bytes: &[u8] = bytemuck::cast_slice(&materials);
        check_storage_binding_size(device, bytes.len())?;
        let materials = filled_buffer(device, uploads, "materials", bytes, wgpu::BufferUsages::STORAGE)?;

        let views = self.textures.views(device);
        let samplers = [
            linear_sampler(device, "textures", wgpu::AddressMode::Repeat),
            linear_sampler(device, "targets", wgpu::AddressMode::ClampToEdge),
        ];
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: materials.as_entire_binding() }];
        for (binding, view) in (1..).zip(&views) {
            entries.push(wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) });
        }
        for (binding, sampler) in (5..).zip(&samplers) {
            entries.push(wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::Sampler(sampler) });
        }
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("assets"),
            layout: &layouts.assets,
            entries: &entries,
        });

        let (Some(vertices), Some(indices)) = (self.vertices.buffer(), self.indices.buffer()) else {
            return Err(BackendError::BrokenRule { rule: "arenas have buffers".to_owned() });
        };
        let (vertices, indices, attributes) = (vertices.clone(), indices.clone(), self.attributes.buffers().clone());
        let (meshes, device_meshes) = (self.meshes.clone(), self.device_meshes.clone());
        Ok(AssetSnapshot { vertices, indices, attributes, meshes, device_meshes, group })
    }

    fn texture_location(&mut self, assets: &Assets, slot: u32, material: &Material) -> Option<TextureLocation> {
        let texture = material.texture?;
        if assets.get(texture).is_err() {
            self.rejected.push((RejectionReason::StaleTexture, slot as usize));
            return None;
        }
        self.textures.location(texture.index())
    }
}

fn linear_sampler(device: &wgpu::Device, label: &str, outside: wgpu::AddressMode) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some(label),
        address_mode_u: outside,
        address_mode_v: outside,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    })
}

fn new_vertex_arena() -> Arena {
    Arena::new("vertices", wgpu::BufferUsages::VERTEX)
}

fn bytes_of(mesh: &Mesh, format: VertexFormat) -> (u64, u64) {
    (mesh.vertices().len() as u64 * vertex_stride(format), size_of_val(mesh.indices()) as u64)
}
