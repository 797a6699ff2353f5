//! Meshes and materials on the device.

use std::sync::Arc;

use super::arena::{Arena, filled_buffer};
use super::growing_buffer::check_storage;
use super::layouts::Layouts;
use super::textures::{TextureArrays, TexturePlace};
use super::uploads::Uploads;
use super::vertices::{stride, with_bytes};
use crate::backend::BackendError;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Material, Mesh};
use crate::view::{RejectionReason, Rejections};

/// What a frame draws from. It stays valid while assets change for later frames.
pub(super) struct AssetSnapshot {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    /// By mesh slot.
    pub(super) meshes: Vec<Option<MeshRange>>,
    /// Materials and textures: `@group(1)`.
    pub(super) group: wgpu::BindGroup,
}

/// Where a mesh lies in the arenas.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshRange {
    pub(super) base_vertex: i32,
    pub(super) first_index: u32,
    pub(super) index_count: u32,
    revision: u64,
}

/// Keeps meshes, materials and textures on the device, and uploads what changed since the last frame.
pub(super) struct AssetCache {
    vertices: Arena,
    /// How they lie there.
    format: VertexFormat,
    indices: Arena,
    meshes: Vec<Option<MeshRange>>,
    textures: TextureArrays,
    /// Identities and revisions of what the snapshot holds.
    current: Option<[(u64, u64); 3]>,
    snapshot: Option<Arc<AssetSnapshot>>,
    /// What was counted when the snapshot was made, so that every frame reports it.
    rejected: Vec<(RejectionReason, usize)>,
}

impl Default for AssetCache {
    fn default() -> Self {
        Self {
            vertices: new_vertex_arena(),
            format: VertexFormat::default(),
            indices: Arena::new("indices", wgpu::BufferUsages::INDEX),
            meshes: Vec::new(),
            textures: TextureArrays::default(),
            current: None,
            snapshot: None,
            rejected: Vec::new(),
        }
    }
}

impl AssetCache {
    /// What a frame of these assets, with vertices of this format, draws from.
    ///
    /// # Errors
    /// If the device has no room for them.
    pub(super) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &Uploads,
        layouts: &Layouts,
        assets: &Assets,
        vertices: VertexFormat,
        rejections: &Rejections,
    ) -> Result<Arc<AssetSnapshot>, BackendError> {
        let wanted = [
            (assets.meshes.identity(), assets.meshes.revision()),
            (assets.materials.identity(), assets.materials.revision()),
            (assets.textures.identity(), assets.textures.revision()),
        ];
        let snapshot = match &self.snapshot {
            Some(snapshot) if self.current == Some(wanted) && self.format == vertices => Arc::clone(snapshot),
            _ => {
                if self.format != vertices {
                    // A mesh begins a whole number of vertices into the arena, so one holds those of one size.
                    (self.vertices, self.format) = (new_vertex_arena(), vertices);
                    self.meshes.clear();
                }
                if self.current.is_none_or(|current| current[0].0 != wanted[0].0) {
                    self.meshes.clear();
                }
                self.rejected.clear();
                // Until the new snapshot is whole there is none: an error must not leave half of one behind.
                self.current = None;
                self.update_meshes(device, uploads, assets)?;
                self.textures.update(device, uploads, assets, &mut self.rejected);
                let snapshot = Arc::new(self.snapshot(device, uploads, layouts, assets)?);
                self.current = Some(wanted);
                self.snapshot = Some(Arc::clone(&snapshot));
                snapshot
            }
        };
        for &(reason, index) in &self.rejected {
            rejections.count(reason, index);
        }
        Ok(snapshot)
    }

    fn update_meshes(&mut self, device: &wgpu::Device, uploads: &Uploads, assets: &Assets) -> Result<(), BackendError> {
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
            // Everything moves to new buffers, and what was garbage stays behind.
            let bytes = assets.iter::<Mesh>().map(|(_, mesh)| bytes_of(mesh, format));
            let (vertex_bytes, index_bytes) = bytes.fold((0, 0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
            self.vertices.renew(device, vertex_bytes)?;
            self.indices.renew(device, index_bytes)?;
            changed = assets
                .meshes
                .iter_with_revision()
                .map(|(handle, revision, mesh)| (handle.index() as usize, revision, mesh))
                .collect();
        }
        for (slot, revision, mesh) in changed {
            let vertices = with_bytes(mesh, format, |bytes| self.vertices.append(uploads, bytes));
            let indices = self.indices.append(uploads, bytemuck::cast_slice(mesh.indices()));
            self.meshes[slot] = Some(MeshRange {
                base_vertex: (vertices / stride(format)) as i32,
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
        uploads: &Uploads,
        layouts: &Layouts,
        assets: &Assets,
    ) -> Result<AssetSnapshot, BackendError> {
        let mut records = vec![MaterialRecord::default(); assets.materials.slot_count().max(1)];
        for (handle, material) in assets.iter::<Material>() {
            let place = self.texture_of(assets, handle.index(), material);
            records[handle.index() as usize] = MaterialRecord::new(material, place);
        }
        let bytes: &[u8] = bytemuck::cast_slice(&records);
        check_storage(device, bytes.len())?;
        let materials = filled_buffer(device, uploads, "materials", bytes, wgpu::BufferUsages::STORAGE)?;

        let views = self.textures.views(device);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("textures"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: materials.as_entire_binding() }];
        for (binding, view) in (1..).zip(&views) {
            entries.push(wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) });
        }
        entries.push(wgpu::BindGroupEntry { binding: 5, resource: wgpu::BindingResource::Sampler(&sampler) });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("assets"),
            layout: &layouts.assets,
            entries: &entries,
        });

        // A scene without a mesh has nothing to draw, but its bundles want buffers all the same.
        for arena in [&mut self.vertices, &mut self.indices] {
            if arena.buffer().is_none() {
                arena.renew(device, 0)?;
            }
        }
        let (Some(vertices), Some(indices)) = (self.vertices.buffer(), self.indices.buffer()) else {
            return Err(BackendError::BrokenRule { rule: "arenas have buffers".to_owned() });
        };
        Ok(AssetSnapshot { vertices: vertices.clone(), indices: indices.clone(), meshes: self.meshes.clone(), group })
    }

    fn texture_of(&mut self, assets: &Assets, slot: u32, material: &Material) -> Option<TexturePlace> {
        let texture = material.texture?;
        if assets.get(texture).is_err() {
            self.rejected.push((RejectionReason::StaleTexture, slot as usize));
            return None;
        }
        self.textures.place(texture.index())
    }
}

/// A material as shaders read it: `Material` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct MaterialRecord {
    diffuse: [f32; 3],
    opacity: f32,
    emission: [f32; 3],
    texture_array: u32,
    texture_layer: u32,
    double_sided: u32,
    blend: u32,
    padding: u32,
}

impl MaterialRecord {
    fn new(material: &Material, place: Option<TexturePlace>) -> Self {
        let place = place.unwrap_or(TexturePlace::NONE);
        Self {
            diffuse: material.diffuse.to_array(),
            opacity: material.opacity,
            emission: material.emission.to_array(),
            texture_array: place.array,
            texture_layer: place.layer,
            double_sided: u32::from(material.double_sided),
            blend: material.blend as u32,
            padding: 0,
        }
    }
}

fn new_vertex_arena() -> Arena {
    Arena::new("vertices", wgpu::BufferUsages::VERTEX)
}

fn bytes_of(mesh: &Mesh, format: VertexFormat) -> (u64, u64) {
    (mesh.vertices().len() as u64 * stride(format), size_of_val(mesh.indices()) as u64)
}
