//! The content of a scene, and the elements of its file that were left out.

use std::collections::BTreeMap;

use drawloom::scene::{Mesh, Scene};
use drawloom_obj::{Imported, ObjWarning};
use drawloom_output::print_diagnostic;
use serde::Serialize;

/// The figures of a scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Content {
    /// Triangles of all objects.
    pub triangles: usize,
    /// Vertices of all objects.
    pub vertices: usize,
    /// Triangles of the file that were left out, because they have no area.
    pub degenerate_triangles: usize,
    /// Warnings about the file, by kind.
    pub warnings: BTreeMap<&'static str, usize>,
}

impl Content {
    /// Notes what an import left out, and prints its warnings.
    pub fn of_file(imported: &Imported) -> Self {
        print_warnings(&imported.warnings);
        let mut not_listed = imported.warning_counts.clone();
        for warning in &imported.warnings {
            not_listed.entry(warning.kind()).and_modify(|count| *count -= 1);
        }
        for (kind, count) in not_listed.into_iter().filter(|(_, count)| *count > 0) {
            print_diagnostic!("warning: {count} more of the kind `{kind}`");
        }
        Self {
            degenerate_triangles: imported.degenerate_triangles,
            warnings: imported.warning_counts.clone(),
            ..Self::default()
        }
    }

    /// Counts what the objects of the scene consist of.
    pub fn count(&mut self, scene: &Scene) {
        let scene = scene.as_scene_ref();
        for &mesh in scene.meshes {
            // Objects without a mesh are rejected when frames are drawn.
            if let Ok(mesh) = scene.assets.get::<Mesh>(mesh) {
                self.triangles += mesh.triangle_count();
                self.vertices += mesh.vertices().len();
            }
        }
    }
}

/// Prints what was left out of a file or replaced.
pub fn print_warnings(warnings: &[ObjWarning]) {
    for warning in warnings {
        print_diagnostic!("warning: {warning}");
    }
}
