//! Scenes: objects, meshes, materials, lights and cameras.
//!
//! A frame reads a [`SceneRef`], which borrows slices. [`Scene`] owns such slices; an engine with storage of its own
//! lends its own instead.

mod asset_loader;
mod assets;
mod camera;
mod camera_matrices;
mod changes;
mod chunk_users;
mod clip_plane;
mod cuboid;
mod derived_camera;
#[cfg(feature = "wgpu")]
mod mesh_buffers;
mod error;
mod generated_buffer;
mod generated_geometry;
mod generated_mesh;
mod impostor;
mod layer_mask;
mod level_of_detail;
mod light;
mod material;
mod material_predicate;
mod material_type;
mod mesh;
mod mesh_levels;
mod node_column;
mod object_column;
mod view_filter;
mod view_kind;
mod object_set;
mod owned_scene;
mod packed_vertex;
mod static_group;
mod projection;
mod redraw;
mod sampler;
mod scene_ref;
#[cfg(feature = "meshopt")]
mod simplified_levels;
mod subdivision;
mod texture;
mod topology;
mod transform;
mod vertex_attribute;
mod whole_picture;

pub use asset_loader::{Arrivals, AssetLoader, LoadError};
pub use assets::{Asset, Assets};
pub use camera::Camera;
pub(crate) use camera::child_name;
pub use changes::Changes;
pub(crate) use chunk_users::run_node_job;
pub use clip_plane::ClipPlane;
pub use error::SceneError;
pub use generated_buffer::GeneratedBuffer;
pub(crate) use generated_buffer::{ChunkError, GeneratedSource};
pub use generated_geometry::GeneratedIndices;
#[cfg(feature = "wgpu")]
pub(crate) use generated_geometry::{GeneratedGeometry, IndexSource};
pub(crate) use internal::*;
pub use layer_mask::LayerMask;
pub use level_of_detail::LevelOfDetail;
pub use light::{Light, LightKind, ShadowProjection};
pub(crate) use light::{LightFields, LightFieldsMut, LightRules, LightVolume};
pub use material::{Blend, Material};
pub use material_predicate::MaterialPredicate;
pub use material_type::{MaterialType, MaterialValues};
pub use mesh::{Bounds, Mesh, Vertex};
#[cfg(feature = "wgpu")]
pub use mesh_buffers::{IndexBuffer, MeshBuffers, StreamAttribute, StreamLayout, VertexStream};
#[cfg(feature = "wgpu")]
pub(crate) use mesh_buffers::{NORMAL, NumberKind, POSITION, UV};
pub(crate) use node_column::Column;
pub use node_column::{ChunkInUse, ColumnChunk, NodeColumn, WrittenColumn, WrittenColumns};
pub use object_column::{ColumnValues, ObjectColumn, PREVIOUS_OBJECTS};
pub use object_set::ObjectSet;
pub use owned_scene::{ObjectHandle, RenderObject, Scene};
pub use projection::Projection;
pub use redraw::Redraw;
pub use sampler::{AddressMode, Filter, Sampler};
pub use scene_ref::SceneRef;
pub use static_group::StaticGroup;
pub use texture::{Texture, TextureClass, TextureFormat};
pub use topology::Topology;
pub(crate) use transform::is_unit;
pub use vertex_attribute::{AttributeValue, VERTEX_COLOR, VERTEX_INDEX, VertexAttribute};
pub use view_filter::{FilteredObjects, ViewFilter};
pub use view_kind::ViewKind;
pub use whole_picture::WholePicture;

/// Layouts that backends read: for backends, and for the tests of this repository. No part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::generated_buffer::{GeneratedContents, GeneratedLayout};
    pub use super::material_type::MaterialLayout;
    pub use super::object_column::ColumnLayout;
    pub use super::packed_vertex::PackedVertex;
    pub use super::vertex_attribute::{AttributeFormat, AttributeLayout};
}
