//! Scenes of meshes that joints or morph targets deform.

use super::builder::Builder;

/// To be written.
pub fn none() -> Builder {
    Builder::new()
}
