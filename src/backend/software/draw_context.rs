//! What the frames of one rasterizer share while they are drawn.

use std::sync::Arc;

use parking_lot::Mutex;

use super::executor::Executor;
use super::generated_meshes::{GeneratedMeshes, UndrawableMeshes};
use crate::backend::subdivision_cache::SubdivisionCache;
use crate::scene::Mesh;

/// What the frames of one rasterizer share while they are drawn.
pub(super) struct DrawContext {
    pub(super) executor: Executor,
    /// Held while a frame is drawn: one frame is drawn at a time.
    pub(super) drawing: Mutex<GeneratedMeshes>,
    pub(super) undrawable: UndrawableMeshes,
    pub(super) subdivisions: SubdivisionCache<Arc<Mesh>>,
}
