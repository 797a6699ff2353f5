//! A convex part of a mesh.

use glam::DVec3;

use super::Plane;

/// A convex part of a mesh: a closed body or a flat polygon. In object space, in metres.
///
/// Its projection is the convex hull of its projected points. Whatever is within that and behind its faces is hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexPart {
    /// The vertices; some may lie between others.
    pub points: Vec<DVec3>,
    /// Pairs of connected points, including all edges of any projection's outline.
    pub edges: Vec<[u32; 2]>,
    /// The planes of a body's faces, or the plane of a polygon.
    pub faces: Vec<Plane>,
    /// Whether it is a closed body. A polygon whose back faces are culled hides nothing when seen from behind.
    pub is_closed: bool,
    /// A bound of the distance in metres between the part and the mesh: of any point of a face, and of any projection's
    /// outline.
    pub slack: f64,
    /// The surface area in square metres, by which parts are ranked.
    pub area: f64,
}

impl ConvexPart {
    /// The maximum number of parts of a mesh.
    pub const MAX_PARTS: usize = 64;
    /// Meshes with more triangles have no parts: good occluders are simple.
    pub const MAX_TRIANGLES: usize = 4096;
    /// The maximum number of faces of a body.
    pub const MAX_FACES: usize = 64;
    /// The maximum number of corners of a polygon.
    pub const MAX_CORNERS: usize = 64;
}
