//! OBJ files.
//!
//! [`load`] reads one from disk; [`read`] reads one from wherever an engine keeps its files. Either returns a scene of
//! objects, materials and lights of emissive surfaces, and reports what it could not take from the file. The engine adds
//! its own cameras and further lights.

mod emission;
mod error;
mod geometry;
mod import;
mod library;
mod material;
mod polygon;
mod preprocessing;

pub use error::{ObjError, ObjWarning};
pub use import::{Imported, load, read};
