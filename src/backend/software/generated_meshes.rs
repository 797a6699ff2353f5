//! Meshes whose vertices CPU nodes make.

use std::collections::HashMap;
use std::sync::Arc;

use super::meshes::Meshes;
use crate::backend::BackendError;
use crate::scene::{GeneratedContents, Mesh};

/// What nodes have filled in the frames that were drawn.
#[derive(Default)]
pub(super) struct GeneratedMeshes {
    /// The latest content of each buffer, by its identity.
    latest: HashMap<u64, Arc<GeneratedContents>>,
}

impl GeneratedMeshes {
    /// Takes over what nodes have filled in the frame that is drawn, and returns its meshes, with the triangles of those that nodes make. What
    /// none of its meshes needs is dropped.
    ///
    /// # Errors
    /// If nodes have made a mesh that cannot be drawn. Then everything is as before.
    pub(super) fn update(
        &mut self,
        generated: &[Arc<GeneratedContents>],
        meshes: &Meshes,
    ) -> Result<Meshes, BackendError> {
        let mut next = Self { latest: self.latest.clone() };
        next.latest.extend(generated.iter().map(|contents| (contents.layout().identity, Arc::clone(contents))));
        let complete = next.complete(meshes)?;
        let geometries = || meshes.iter().flatten().filter_map(|mesh| mesh.generated_geometry());
        next.latest.retain(|identity, _| geometries().any(|geometry| geometry.reads(*identity)));
        *self = next;
        Ok(complete)
    }

    /// The meshes of the frame, with the triangles of those that nodes make.
    ///
    /// # Errors
    /// If nodes have made a mesh that cannot be drawn.
    fn complete(&self, meshes: &Meshes) -> Result<Meshes, BackendError> {
        let is_generated = |mesh: &Option<Arc<Mesh>>| mesh.as_ref().is_some_and(|mesh| !mesh.has_triangles());
        if !meshes.iter().any(is_generated) {
            return Ok(Arc::clone(meshes));
        }
        let complete = |mesh: &Option<Arc<Mesh>>| {
            let Some(mesh) = mesh else { return Ok(None) };
            let contents_of = |identity: u64| self.latest.get(&identity).map(Arc::clone);
            let made = mesh.with_contents(contents_of);
            let made = made.map_err(|source| BackendError::GeneratedMesh { mesh: mesh.name().to_owned(), source })?;
            Ok(Some(made.map_or_else(|| Arc::clone(mesh), Arc::new)))
        };
        meshes.iter().map(complete).collect()
    }
}
