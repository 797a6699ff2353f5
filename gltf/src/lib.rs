//! Loads glTF 2.0 files as scenes that Drawloom draws.
//!
//! [`load`] makes a [`World`] of a file. [`World::as_scene_ref`] is the scene that a renderer records; its surfaces,
//! skins and morph targets are drawn by processes that `draw::add_world` adds to the renderer.
//!
//! | type | what it is |
//! | --- | --- |
//! | [`LoadOptions`], [`GltfLimits`], [`Progress`] | what of a file is drawn, what it may take, how far loading is |
//! | [`World`] | a loaded scene, and the warnings about what was left out |
//! | [`LoadError`], [`Problem`], [`UnknownLimit`] | a file that is refused, and why; a limit that does not exist |
//! | `draw::add_world`, `draw::shadow_maps` | its processes and its shadow maps, for a renderer |
//! | `draw::open_device`, `draw::DrawError` | a device with the limits that they need, and why there is none |
//!
//! What the loader accepts:
//! - A file that is glTF 2.0 is loaded. An element with which something is wrong is left out, and the rest is drawn: an
//!   image, a primitive, an attribute, a skin, a channel of an animation. Each is a [warning](World::warnings) that
//!   names the element. So is what a file has beyond what is drawn: points and lines, other extensions, more than two
//!   sets of texture coordinates.
//! - A file of another version, one that requires an extension that is not known, one that exceeds a
//!   [limit](GltfLimits), and one of whose scene nothing is left is a [`LoadError`], which names what is wrong.
//!
//! # Features
//!
//! - `draw` (default): the module `draw`, on wgpu. The loader alone draws nothing, and needs no graphics library.
//!
//! # Modules
//!
//! - `error`, `limits`, `warnings`: what a file may take, and what is said of it;
//! - `json`, `glb`, `version`, `files`, `element`, `document`, `accessors`: the file, its elements and buffers, and
//!   typed values in them;
//! - `transforms`, `nodes`, `keyframes`, `animations`: where nodes are;
//! - `attributes`, `triangles`, `vertex_joints`, `morph_targets`, `primitives`, `skins`, `poses`: meshes and their
//!   shapes;
//! - `surface`, `surface_kind`, `jpeg`, `images`, `textures`, `texture_slots`, `materials`: surfaces;
//! - `cameras`, `lights`, `world`, `parts`, `world_builder`, `progress`, `loader`: the scene;
//! - `draw`: how it is drawn.

#![forbid(unsafe_code)]

// Each module uses only modules above it; `tests/architecture` of the workspace fails otherwise.
mod error;
mod limits;
mod warnings;
mod progress;
mod json;
mod glb;
mod version;
mod files;
mod element;
mod document;
mod accessors;
mod transforms;
mod nodes;
mod keyframes;
mod animations;
mod cameras;
mod lights;
mod attributes;
mod triangles;
mod vertex_joints;
mod morph_targets;
mod primitives;
mod skins;
mod surface;
mod surface_kind;
mod jpeg;
mod images;
mod textures;
mod texture_slots;
mod materials;
mod poses;
mod world;
mod parts;
mod world_builder;
mod loader;
#[cfg(feature = "draw")]
pub mod draw;

pub use error::{LoadError, Problem};
pub use limits::{GltfLimits, UnknownLimit};
pub use loader::{LoadOptions, load, load_bytes};
pub use progress::Progress;
pub use world::World;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(all(doctest, feature = "draw"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
