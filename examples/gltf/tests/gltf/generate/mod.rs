//! Small glTF files, made in code.

pub mod builder;
pub mod deforming;
pub mod shapes;
pub mod static_scenes;
