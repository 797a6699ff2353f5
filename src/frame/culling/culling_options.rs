//! What decides which stages of culling a frame has.

use super::culling_tables::CullingTables;
use crate::process::{AttachmentExtent, Draws, FramePlan, Pass};
use crate::quality::{Quality, TransformPrecision};
use crate::view::RenderView;

/// What culling a frame does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) struct CullingOptions {
    /// The side of a tile of the coarse depth buffers in pixels; `None` without occlusion tests.
    pub(super) occlusion_tile: Option<u32>,
    culls_triangles: bool,
}

impl CullingOptions {
    /// The options of a frame whose meshes the tables have.
    pub(in crate::frame) fn new(quality: &Quality, tables: &CullingTables) -> Self {
        // The bounds of triangle culling hold only for camera-relative transforms.
        let is_exact = quality.transforms == TransformPrecision::CameraRelative;
        Self { occlusion_tile: quality.occlusion, culls_triangles: tables.has_cullable_meshes() && is_exact }
    }

    /// Whether triangles of meshes with triangle culling are culled.
    pub(in crate::frame) fn culls_triangles(self) -> bool {
        self.culls_triangles
    }
}

/// Whether the triangles of meshes with triangle culling may be culled in a pass.
pub(in crate::frame) fn allows_triangle_culling(
    plan: &FramePlan,
    draws: &[Draws<'_>],
    view: &RenderView,
    pass: &Pass,
) -> bool {
    // Triangle culling tests undeformed triangles against the centres of the picture's pixels.
    draws[pass.process_index].allows_triangle_culling()
        && plan.attachment_extent(pass.process_index) == AttachmentExtent::PICTURE
        && view.can_cull_triangles()
}
