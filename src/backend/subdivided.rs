//! Meshes in smaller triangles, for views that show straight edges bent.

use crate::scene::Mesh;

/// No mesh becomes more triangles than this.
const MOST_TRIANGLES: usize = 1 << 18;

/// The mesh with its edges halved so often; and whether it has longer edges than it should, because there would be too many
/// triangles.
pub(super) fn subdivided(mesh: &Mesh, halvings: u32) -> (Mesh, bool) {
    // A little more, lest halves that were rounded up are halved again.
    let longest = mesh.longest_edge() / (1_u64 << halvings) as f32 * 1.001;
    let subdivided = mesh.subdivided(longest, MOST_TRIANGLES);
    let is_coarse = subdivided.longest_edge() > longest;
    (subdivided, is_coarse)
}
