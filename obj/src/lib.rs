//! Reads OBJ files, with the material libraries and textures that they name, into scenes of [`drawloom`].
//!
//! [`load`] reads a file from disk; [`read`] reads one from wherever an engine keeps its files. Either returns a scene
//! of objects, materials and lights of emissive surfaces, and reports what it could not take from the file. The engine
//! adds its own cameras and further lights.
//!
//! ```
//! use drawloom::glam::DVec3;
//! use drawloom::scene::Camera;
//! use drawloom_obj::ObjLimits;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A file may come from anyone. A message that names a limit says which one to raise.
//! let limits = ObjLimits { all_textures_bytes: 1 << 30, ..ObjLimits::default() };
//! let imported = drawloom_obj::load_within("tests/square.obj", &limits)?;
//! assert_eq!(imported.triangles, 2);
//! for warning in &imported.warnings {
//!     println!("{warning}");
//! }
//! // `tests/square.obj`: `subdivide` in line 7 left out
//! assert_eq!(imported.warning_counts["file with ignored statements"], 1);
//!
//! let mut scene = imported.scene;
//! let (center, radius) = scene.as_scene_ref().bounding_sphere();
//! scene.cameras.push(Camera::looking_at("main", center + DVec3::Z * 3.0 * radius, center));
//! # Ok(())
//! # }
//! ```
//!
//! Only regular files are read, within [`ObjLimits`]. What is malformed, or not supported, is left out, counted and
//! named by an [`ObjWarning`]. A file that cannot be read, exceeds a limit, or has no triangle to draw is an
//! [`ObjError`].

#![forbid(unsafe_code)]

// Each module uses only modules above it; `tests/architecture` of the workspace fails otherwise.
mod error;
mod warnings;
mod ignored;
mod limits;
mod statements;
mod files;
mod texture;
mod polygon;
mod preprocessing;
mod geometry;
mod emission;
mod library;
mod material;
mod import;

pub use error::{IgnoredKeyword, ObjError, ObjWarning};
pub use import::{Imported, load, load_within, read, read_within};
pub use limits::ObjLimits;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
