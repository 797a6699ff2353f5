//! What a frame can hold of its scene.

use std::cell::Cell;

use crate::backend::{Backend, CallPanic, GuardedBackend, SceneLimits};
use crate::quality::VertexFormat;
use crate::scene::{ColumnLayout, Mesh, SceneRef};
use crate::unwind::emit;
use crate::view::{ObjectTable, TableLimits};

/// What a frame can hold of its scene, as the object table asks for it.
#[derive(Debug, Default)]
pub(super) struct SceneCapacity {
    /// The limits of the backend, and what else decides which meshes can be drawn; `None` before the first frame with a
    /// backend.
    conditions: Option<(SceneLimits, VertexFormat)>,
    /// Counts how often the conditions changed.
    revision: u64,
    /// The size of an element in the widest column that the latest plan reads.
    column_stride: usize,
}

impl SceneCapacity {
    /// Begins a frame of the object table within the limits of a backend, with vertices in this format.
    ///
    /// # Errors
    /// If the backend panics. The next frame asks it of all meshes again.
    pub(super) fn begin_frame<B: Backend>(
        &mut self,
        backend: &GuardedBackend<B>,
        limits: SceneLimits,
        scene: &SceneRef<'_>,
        objects: &mut ObjectTable,
        vertices: VertexFormat,
    ) -> Result<(), CallPanic> {
        if self.conditions.replace((limits, vertices)) != Some((limits, vertices)) {
            self.revision += 1;
        }
        let panic = Cell::new(None);
        let can_draw = |mesh: &Mesh| {
            can_draw(backend, mesh, vertices).unwrap_or_else(|failed| {
                panic.set(Some(failed));
                false
            })
        };
        objects.begin_frame_within(scene, &self.limits(&can_draw));
        panic.take().map_or(Ok(()), |panic| {
            self.forget_backend();
            Err(panic)
        })
    }

    /// The plan reads these columns. If they are wider than those of the plan before, fewer objects may have room; if
    /// they are narrower, more.
    pub(super) fn set_columns(&mut self, columns: &[ColumnLayout], scene: &SceneRef<'_>, objects: &mut ObjectTable) {
        self.column_stride = columns.iter().map(|column| column.stride).max().unwrap_or(0);
        // The table knows which meshes can be drawn.
        let limits = self.limits(&|_| true);
        if limits.objects.min(scene.object_count()) != objects.len() {
            objects.begin_frame_anew(scene, &limits);
        }
    }

    /// The next frame is one of another backend.
    pub(super) fn forget_backend(&mut self) {
        self.conditions = None;
    }

    fn limits<'a>(&self, can_draw: &'a dyn Fn(&Mesh) -> bool) -> TableLimits<'a> {
        let (limits, _) = self.conditions.unwrap_or_default();
        TableLimits {
            objects: limits.max_objects(self.column_stride).min(TableLimits::MAX_OBJECTS),
            material_bytes: limits.binding_bytes,
            can_draw,
            revision: self.revision,
        }
    }
}

/// Whether a backend draws a mesh with vertices in this format. Warns by name of one that it does not draw.
///
/// # Errors
/// If the backend panics.
fn can_draw<B: Backend>(backend: &GuardedBackend<B>, mesh: &Mesh, vertices: VertexFormat) -> Result<bool, CallPanic> {
    let Err(problem) = backend.check_mesh(mesh, vertices)? else { return Ok(true) };
    let mesh = mesh.name();
    emit(|| tracing::warn!(target: "drawloom", mesh = ?mesh, %problem, "objects with this mesh are left out"));
    Ok(false)
}
