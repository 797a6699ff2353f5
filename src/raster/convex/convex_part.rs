//! A convex part of a mesh.

use glam::DVec3;

use super::Plane;

/// A part of a mesh that is convex: a closed body, or a flat piece of surface. In object space, in metres.
///
/// Its picture is all that lies between the pictures of its points, and what is behind that and behind its faces cannot be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexPart {
    /// Its corners; some may lie between others.
    pub points: Vec<DVec3>,
    /// Pairs of points between which the part reaches; those along its rim are among them.
    pub edges: Vec<[u32; 2]>,
    /// Its faces: all of them of a body, and one of a flat piece.
    pub faces: Vec<Plane>,
    /// Whether it is a body. A flat piece that is not drawn from behind hides nothing from there.
    pub is_closed: bool,
    /// How far the mesh is from what is described here, in metres: no point of its rim, seen from wherever, and no point of a
    /// face is farther from its place than this.
    pub slack: f64,
    /// How large it is, in square metres: what it is ranked by.
    pub area: f64,
}

impl ConvexPart {
    /// The most that a mesh has.
    pub const MAX_PARTS: usize = 64;
    /// Meshes of more triangles have none: what hides much is simple.
    pub const MAX_TRIANGLES: usize = 4096;
    /// The most faces of one.
    pub const MAX_FACES: usize = 64;
    /// The most corners of a flat one.
    pub const MAX_CORNERS: usize = 64;
}
