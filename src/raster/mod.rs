//! A rasteriser for the CPU: the software backend and occlusion culling use it.
//!
//! It is generic over [`Real`] numbers: f32 for speed, f64 as the reference that other results are measured against.
//! Engines use its vectors in CPU shaders; the rasteriser itself is private.

mod coarse_depth;
mod convex;
mod real;
mod silhouettes;
mod vector;
#[cfg(feature = "software")]
mod pixel_bounds;
mod grid;
#[cfg(feature = "software")]
mod triangle;
mod triangle_culling;

pub(crate) use coarse_depth::CoarseDepth;
pub(crate) use convex::{ConvexPart, Plane};
pub(crate) use grid::Winding;
#[cfg(feature = "software")]
pub(crate) use pixel_bounds::PixelBounds;
pub use real::Real;
pub(crate) use silhouettes::Silhouettes;
#[cfg(feature = "software")]
pub(crate) use triangle::{NearPlane, Triangle};
pub use triangle_culling::CulledTriangles;
pub(crate) use triangle_culling::{CullVertex, cull_triangles};
pub use vector::{Quaternion, Vector, Vector2, Vector3, Vector4};
