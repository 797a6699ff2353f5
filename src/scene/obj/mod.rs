//! OBJ files.
//!
//! [`load`] reads one from disk; [`read`] reads one from wherever an engine keeps its files. Either returns a scene of
//! objects, materials and lights of emissive surfaces, and reports what it could not take from the file. The engine adds
//! its own cameras and further lights.
//!
//! A file may come from anyone: only regular files are read, within [`ObjLimits`], and what is malformed is left out, counted and
//! named by an [`ObjWarning`].

mod emission;
mod error;
mod files;
mod geometry;
mod ignored;
mod import;
mod library;
mod limits;
mod material;
mod polygon;
mod preprocessing;
mod statements;
mod texture;
mod warnings;

pub use error::{IgnoredKeyword, ObjError, ObjWarning};
pub use import::{Imported, load, load_within, read, read_within};
pub use limits::ObjLimits;
