//! An engine's own loader: any glTF 2.0 scene, read with the crate `gltf`, and drawn with Drawloom.
//!
//! [`load`] makes a [`World`] of a file, and [`draw`] makes a picture of that. What a file has beyond what is drawn is a
//! [warning](World::warnings), and what is wrong with it a [`LoadError`].
//!
//! - `document`, `files`, `accessors`: the file, its buffers, and typed values in them;
//! - `nodes`, `transforms`, `animations`, `keyframes`: where nodes are;
//! - `primitives`, `triangles`, `vertex_joints`, `morph_targets`, `skins`, `poses`: meshes and their shapes;
//! - `materials`, `images`, `texture_arrays`, `mip_levels`: surfaces;
//! - `lights`, `cameras`, `loader`, `world_builder`, `world`: the scene;
//! - `surfaces`, `deformation`, `device_textures`, `picture`: how it is drawn.

mod accessors;
mod animations;
mod attributes;
mod cameras;
mod deformation;
mod device_textures;
mod document;
mod error;
mod files;
mod images;
mod keyframes;
mod lights;
mod loader;
mod materials;
mod mip_levels;
mod morph_targets;
mod nodes;
mod picture;
mod poses;
mod primitives;
mod skins;
mod surfaces;
mod texture_arrays;
mod transforms;
mod triangles;
mod vertex_joints;
mod warnings;
mod world;
mod world_builder;

pub use error::{LoadError, Problem};
pub use loader::{LoadOptions, load};
pub use picture::{draw, open_device};
pub use world::World;
