//! What culling keeps from frame to frame.

use std::time::Duration;

use super::cullable_meshes::CullableMeshes;
use super::view_occlusion::ViewOcclusion;
use crate::scene::Assets;
use crate::view::{OccluderMeshes, PerView, RenderView, UsedMeshes};

/// What culling keeps from frame to frame.
#[derive(Default)]
pub(in crate::frame) struct CullingTables {
    pub(in crate::frame) occlusion: PerView<ViewOcclusion>,
    /// The convex parts of meshes, for views that test for occlusion.
    pub(in crate::frame) occluder_meshes: OccluderMeshes,
    /// The meshes whose triangles are culled.
    cullable_meshes: CullableMeshes,
}

impl CullingTables {
    /// Finds the meshes that ask for triangle culling, and that objects use.
    pub(in crate::frame) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        self.cullable_meshes.update(assets, used);
    }

    /// The number of objects that a view leaves out as hidden.
    pub(in crate::frame) fn hidden(&self, view: usize) -> usize {
        self.occlusion[view].hidden()
    }

    /// Begins a frame of these views.
    pub(in crate::frame) fn set_views(&mut self, views: &[RenderView]) {
        self.occlusion.set_views(views, |_| {});
    }

    /// Whether a view tests for occlusion in this frame.
    pub(in crate::frame) fn tests_occlusion(&self, view: usize) -> bool {
        self.occlusion[view].is_on()
    }

    /// Adds the thread time of a job whose work depends on the occlusion tests of a view.
    pub(in crate::frame) fn add_time(&self, view: usize, took: Duration) {
        self.occlusion[view].add_time(took);
    }

    /// Takes away a time that such a job spends on other views.
    pub(in crate::frame) fn subtract_time(&self, view: usize, took: Duration) {
        self.occlusion[view].subtract_time(took);
    }

    /// Whether objects use a mesh that asks for triangle culling.
    pub(super) fn has_cullable_meshes(&self) -> bool {
        !self.cullable_meshes.is_empty()
    }

    /// Whether the mesh in a slot asks for triangle culling.
    pub(in crate::frame) fn is_cullable(&self, mesh: u32) -> bool {
        self.cullable_meshes.contains(mesh)
    }
}
