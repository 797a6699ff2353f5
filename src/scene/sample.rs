//! The project's own scene.
