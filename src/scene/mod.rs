//! What is drawn: objects, meshes, materials, lights and cameras.
//!
//! [`SceneRef`] is what a frame reads; [`Scene`] owns one, and an engine with storage of its own lends its slices instead.

mod assets;
mod camera;
mod collection;
pub mod defaults;
mod error;
mod light;
mod material;
mod mesh;
#[cfg(feature = "obj")]
pub mod obj;
mod packed_vertex;
pub mod sample;
mod scene_ref;
mod subdivision;

pub use assets::{Asset, Assets};
pub use camera::{Camera, Projection, ViewKind};
pub use collection::{ObjectHandle, RenderObject, Scene};
pub use error::SceneError;
pub use light::{Light, LightKind};
pub use material::{Blend, Material, Texture};
pub use mesh::{Bounds, Mesh, Topology, Vertex};
pub use packed_vertex::PackedVertex;
pub use scene_ref::SceneRef;
pub(crate) use scene_ref::is_unit;
