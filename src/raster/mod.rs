//! A rasteriser for the CPU: the software backend and occlusion culling use it.
//!
//! It is generic over [`Real`] numbers: f32 for speed, f64 as the reference that other results are measured against.
//! Engines use its vectors in CPU shaders; the rasteriser itself is private.

#[cfg(feature = "occlusion")]
mod coarse_depth;
#[cfg(feature = "occlusion")]
mod convex;
mod real;
#[cfg(feature = "occlusion")]
mod silhouettes;
mod vector;
#[cfg(feature = "software")]
mod pixel_bounds;
#[cfg(any(feature = "occlusion", feature = "software"))]
mod grid;
#[cfg(feature = "software")]
mod triangle;
mod culled_triangles;
#[cfg(feature = "occlusion")]
mod triangle_culling;

#[cfg(feature = "occlusion")]
pub(crate) use coarse_depth::CoarseDepth;
#[cfg(feature = "occlusion")]
pub(crate) use convex::{ConvexPart, Plane};
pub use culled_triangles::CulledTriangles;
#[cfg(any(feature = "occlusion", feature = "software"))]
pub(crate) use grid::Winding;
#[cfg(feature = "software")]
pub(crate) use pixel_bounds::PixelBounds;
pub use real::Real;
#[cfg(feature = "occlusion")]
pub(crate) use silhouettes::Silhouettes;
#[cfg(feature = "software")]
pub(crate) use triangle::{NearPlane, Triangle};
#[cfg(feature = "occlusion")]
pub(crate) use triangle_culling::{CullVertex, cull_triangles};
pub use vector::{Quaternion, Vector, Vector2, Vector3, Vector4};
