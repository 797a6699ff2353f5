//! What several fuzz targets share.

pub mod gltf_worlds;
pub mod imports;
pub mod scenes;
