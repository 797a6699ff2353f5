//! Meshes whose vertices CPU nodes make.

use std::collections::HashMap;
use std::sync::Arc;

use parking_lot::Mutex;

use super::meshes::Meshes;
use crate::backend::FrameRequest;
use crate::scene::{GeneratedContents, Mesh, SceneError};
use crate::unwind::emit_unlocked;
use crate::view::IssueReason;

/// What nodes have filled in the frames that were drawn.
#[derive(Default)]
pub(super) struct GeneratedMeshes {
    /// The latest content of each buffer, by its identity.
    latest: HashMap<u64, Arc<GeneratedContents>>,
}

impl GeneratedMeshes {
    /// Takes over what nodes have filled in the frame that is drawn, and returns its meshes, with the triangles of
    /// those that nodes make. What none of its meshes needs is dropped. A mesh that is filled with what is no mesh has
    /// no triangles, and is added to `undrawable`.
    pub(super) fn update(
        &mut self,
        generated: &[Arc<GeneratedContents>],
        meshes: &Meshes,
        undrawable: &UndrawableMeshes,
    ) -> Meshes {
        self.latest.extend(generated.iter().map(|contents| (contents.layout().identity, Arc::clone(contents))));
        let complete = self.complete(meshes, undrawable);
        let geometries = || meshes.iter().flatten().filter_map(|mesh| mesh.generated_geometry());
        self.latest.retain(|identity, _| geometries().any(|geometry| geometry.reads(*identity)));
        complete
    }

    /// The meshes of the frame, with the triangles of those that nodes make.
    fn complete(&self, meshes: &Meshes, undrawable: &UndrawableMeshes) -> Meshes {
        let mut problems = Vec::new();
        let is_generated = |mesh: &Option<Arc<Mesh>>| mesh.as_ref().is_some_and(|mesh| !mesh.has_triangles());
        let complete = if meshes.iter().any(is_generated) {
            let mut complete = |(slot, mesh): (usize, &Arc<Mesh>)| {
                let made = mesh.with_contents(|identity| self.latest.get(&identity).map(Arc::clone));
                let made = made.unwrap_or_else(|problem| {
                    problems.push((slot, Arc::clone(mesh), problem));
                    None
                });
                made.map_or_else(|| Arc::clone(mesh), Arc::new)
            };
            let by_slot = meshes.iter().enumerate();
            by_slot.map(|(slot, mesh)| mesh.as_ref().map(|mesh| complete((slot, mesh)))).collect()
        } else {
            Arc::clone(meshes)
        };
        undrawable.replace(problems);
        complete
    }
}

/// The meshes, by slot, that nodes have filled with what is no mesh in the latest frame that was drawn. Frames count
/// their objects when they begin: only the drawing of a frame finds such meshes.
#[derive(Default)]
pub(super) struct UndrawableMeshes(Mutex<HashMap<usize, Arc<Mesh>>>);

impl UndrawableMeshes {
    /// Warns of each mesh that was not among them before.
    fn replace(&self, problems: Vec<(usize, Arc<Mesh>, SceneError)>) {
        let mut meshes = self.0.lock();
        let before = std::mem::take(&mut *meshes);
        for (slot, mesh, problem) in problems {
            if !before.get(&slot).is_some_and(|known| Arc::ptr_eq(known, &mesh)) {
                let name = mesh.name().to_owned();
                emit_unlocked(move || {
                    let message = "nodes have filled this mesh with what cannot be drawn: it is left out";
                    tracing::warn!(target: "drawloom", mesh = ?name, %problem, "{message}");
                });
            }
            meshes.insert(slot, mesh);
        }
    }

    /// Counts the objects of a frame that have one of these meshes, which the frame knows as `known`.
    pub(super) fn count_objects(&self, request: &FrameRequest<'_>, known: &Meshes) {
        let meshes = self.0.lock();
        if meshes.is_empty() {
            return;
        }
        let used = request.objects.used_meshes();
        let objects = request.scene.meshes.iter().take(request.objects.len()).enumerate();
        let undrawable = objects.filter(|(_, handle)| {
            let slot = handle.index() as usize;
            let known = known.get(slot).and_then(Option::as_ref).filter(|_| used.contains(**handle));
            known.zip(meshes.get(&slot)).is_some_and(|(known, undrawable)| Arc::ptr_eq(known, undrawable))
        });
        request.scene_issues.count_all_once(IssueReason::UndrawableMesh, undrawable.map(|(object, _)| object));
    }
}
