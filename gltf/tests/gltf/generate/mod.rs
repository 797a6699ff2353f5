//! Small glTF files, made in code.

pub mod builder;
pub mod deforming;
pub mod grammar;
pub mod mutations;
pub mod random_accessors;
pub mod shapes;
pub mod static_scenes;
