//! Convex parts of meshes, which occlusion culling uses as occluders: the projection of a convex part is convex.

mod convex_part;
mod plane;
mod welded_mesh;
mod closed_body;
mod flat_polygons;
mod decomposition;

pub use convex_part::ConvexPart;
pub use plane::Plane;
