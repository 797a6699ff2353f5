//! Meshes whose vertices CPU nodes make.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::meshes::Meshes;
use crate::scene::{GeneratedContents, Mesh};
use crate::unwind::emit_unlocked;

/// What nodes have filled in the frames that were drawn.
#[derive(Default)]
pub(super) struct GeneratedMeshes {
    /// The latest content of each buffer, by its identity.
    latest: HashMap<u64, Arc<GeneratedContents>>,
    /// The names of meshes that the latest frame left out, as they were filled with what is no mesh.
    left_out: HashSet<String>,
}

impl GeneratedMeshes {
    /// Takes over what nodes have filled in the frame that is drawn, and returns its meshes, with the triangles of
    /// those that nodes make. What none of its meshes needs is dropped. A mesh that is filled with what is no mesh has
    /// no triangles, and a warning names it.
    pub(super) fn update(&mut self, generated: &[Arc<GeneratedContents>], meshes: &Meshes) -> Meshes {
        self.latest.extend(generated.iter().map(|contents| (contents.layout().identity, Arc::clone(contents))));
        let complete = self.complete(meshes);
        let geometries = || meshes.iter().flatten().filter_map(|mesh| mesh.generated_geometry());
        self.latest.retain(|identity, _| geometries().any(|geometry| geometry.reads(*identity)));
        complete
    }

    /// The meshes of the frame, with the triangles of those that nodes make.
    fn complete(&mut self, meshes: &Meshes) -> Meshes {
        let is_generated = |mesh: &Option<Arc<Mesh>>| mesh.as_ref().is_some_and(|mesh| !mesh.has_triangles());
        if !meshes.iter().any(is_generated) {
            return Arc::clone(meshes);
        }
        let left_out_before = std::mem::take(&mut self.left_out);
        let mut complete = |mesh: &Arc<Mesh>| {
            let made =
                mesh.with_contents(|identity| self.latest.get(&identity).map(Arc::clone)).unwrap_or_else(|problem| {
                    let name = mesh.name().to_owned();
                    self.left_out.insert(name.clone());
                    if !left_out_before.contains(&name) {
                        emit_unlocked(move || {
                            let message = "nodes have filled this mesh with what cannot be drawn: it is left out";
                            tracing::warn!(target: "drawloom", mesh = ?name, %problem, "{message}");
                        });
                    }
                    None
                });
            made.map_or_else(|| Arc::clone(mesh), Arc::new)
        };
        meshes.iter().map(|mesh| mesh.as_ref().map(&mut complete)).collect()
    }
}
