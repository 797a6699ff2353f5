//! Culling beyond the view frustum (S 9.6): of objects that others hide, and of triangles that cover no pixel. If
//! the feature `occlusion` is off, `no_culling.rs` replaces this module.

mod cullable_meshes;
mod culling_options;
mod culling_tables;
mod occluders;
mod occlusion_control;
mod occlusion_controls;
mod pass_triangles;
mod view_occlusion;

pub(super) use culling_options::{CullingOptions, allows_triangle_culling};
pub(super) use culling_tables::CullingTables;
pub(super) use occlusion_controls::OcclusionControls;
pub(super) use pass_triangles::PassTriangles;
