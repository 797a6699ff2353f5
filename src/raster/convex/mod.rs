//! Convex parts of meshes: what is behind one and within its projection is hidden, and the projection is convex too.

mod convex_part;
mod plane;
mod welded_mesh;
mod closed_body;
mod flat_polygons;
mod decomposition;

pub use convex_part::ConvexPart;
pub use plane::Plane;
