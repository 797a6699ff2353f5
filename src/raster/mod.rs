//! A rasteriser for the CPU: what draws in software, and what finds out which objects others hide.
//!
//! It is written for any [`Real`] number: f32 is fast enough to look at, and f64 is what the others are measured by.

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
