//! What several fuzz targets share.

pub mod imports;
pub mod scenes;
