//! A rasteriser for the CPU: the software backend and occlusion culling use it.
//!
//! It is generic over [`Real`] numbers: f32 for speed, f64 as the reference that other results are measured against.

mod coarse_depth;
mod convex;
mod real;
mod silhouettes;
mod vector;
mod pixel_bounds;
mod grid;
mod clip;
mod edge;
mod triangle;
mod triangle_culling;

pub use coarse_depth::CoarseDepth;
pub use convex::{ConvexPart, Plane};
pub use grid::{MAX_PICTURE_SIZE, Winding};
pub use pixel_bounds::PixelBounds;
pub use real::Real;
pub use silhouettes::Silhouettes;
pub use triangle::{Interpolated, Triangle};
pub use triangle_culling::{CullVertex, CulledTriangles, cull_triangles};
pub use vector::{Quaternion, Vector, Vector2, Vector3, Vector4};
