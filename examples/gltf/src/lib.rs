//! An engine's own loader of glTF 2.0, whose scenes Drawloom draws.
//!
//! [`load`] makes a [`World`] of a file, and [`draw`] makes a picture of that.
//!
//! What the loader accepts:
//! - A file that is glTF 2.0 is loaded. An element with which something is wrong is left out, and the rest is drawn: an
//!   image, a primitive, an attribute, a skin, a channel of an animation. Each is a [warning](World::warnings) that
//!   names the element. So is what a file has beyond what is drawn: points and lines, other extensions, more than two
//!   sets of texture coordinates.
//! - A file of another version, one that requires an extension that is not known, one that exceeds a
//!   [limit](GltfLimits), and one of whose scene nothing is left is a [`LoadError`], which names what is wrong.
//!
//! The modules:
//! - `json`, `glb`, `version`, `document`, `element`, `files`, `accessors`: the file, its elements and buffers, and
//!   typed values in them;
//! - `limits`, `warnings`, `error`, `text`: what a file may take, and what is said of it;
//! - `nodes`, `transforms`, `animations`, `keyframes`: where nodes are;
//! - `primitives`, `triangles`, `vertex_joints`, `morph_targets`, `skins`, `poses`: meshes and their shapes;
//! - `materials`, `texture_slots`, `surface`, `surface_kind`, `images`, `texture_arrays`, `array_sizes`, `mip_levels`:
//!   surfaces;
//! - `lights`, `cameras`, `loader`, `world_builder`, `world`: the scene;
//! - `surfaces`, `deformation`, `device_textures`, `picture`: how it is drawn.

mod accessors;
mod animations;
mod array_sizes;
mod attributes;
mod cameras;
#[cfg(feature = "draw")]
mod deformation;
#[cfg(feature = "draw")]
mod device_textures;
mod document;
mod element;
mod error;
mod files;
mod glb;
mod images;
mod jpeg;
mod json;
mod keyframes;
mod lights;
mod limits;
mod loader;
mod materials;
mod mip_levels;
mod morph_targets;
mod nodes;
#[cfg(feature = "draw")]
mod picture;
mod poses;
mod primitives;
mod skins;
mod surface;
mod surface_kind;
#[cfg(feature = "draw")]
mod surfaces;
mod texture_arrays;
mod texture_slots;
mod transforms;
mod triangles;
mod version;
mod vertex_joints;
mod warnings;
mod world;
mod world_builder;

pub use error::{LoadError, Problem};
pub use limits::GltfLimits;
pub use loader::{LoadOptions, load, load_bytes};
#[cfg(feature = "draw")]
pub use picture::{draw, open_device};
pub use world::World;
