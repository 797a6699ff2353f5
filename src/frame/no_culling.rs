//! Replaces `culling` if the feature `occlusion` is off: frames cull objects by their view frustum alone. Each function
//! that the rest of the frame calls is in both modules.

use std::iter;
use std::sync::Arc;
use std::time::Duration;

use super::stages::tables::FrameTables;
use crate::command::DrawList;
use crate::process::{Draws, FramePlan, Pass};
use crate::quality::Quality;
use crate::raster::CulledTriangles;
use crate::scene::Assets;
use crate::timeline::{Labels, TuningChoice};
use crate::view::{RenderView, UsedMeshes};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CullingOptions;

impl CullingOptions {
    pub(super) fn new(_: &Quality, _: &CullingTables) -> Self {
        Self
    }

    pub(super) fn culls_triangles(self) -> bool {
        false
    }
}

pub(super) fn allows_triangle_culling(_: &FramePlan, _: &[Draws<'_>], _: &RenderView, _: &Pass) -> bool {
    false
}

#[derive(Default)]
pub(super) struct CullingTables;

impl CullingTables {
    pub(super) fn update(&mut self, _: &Assets, _: &UsedMeshes) {}

    pub(super) fn hidden(&self, _view: usize) -> usize {
        0
    }

    pub(super) fn set_views(&mut self, _: &[RenderView]) {}

    pub(super) fn tests_occlusion(&self, _view: usize) -> bool {
        false
    }

    pub(super) fn add_time(&self, _view: usize, _: Duration) {}

    pub(super) fn subtract_time(&self, _view: usize, _: Duration) {}

    pub(super) fn is_cullable(&self, _mesh: u32) -> bool {
        false
    }
}

pub(super) struct OcclusionControls;

impl OcclusionControls {
    pub(super) fn new(_: CullingOptions, _: &FramePlan, _: &[Draws<'_>], _: &[Pass], _: &[RenderView]) -> Self {
        Self
    }

    pub(super) fn is_possible(&self, _view: usize) -> bool {
        false
    }

    pub(super) fn inherit_measurements(&mut self, _: &Self, _: impl Iterator<Item = Option<usize>>) {}

    pub(super) fn begin_frame(&self, _: &mut FrameTables, _: &Assets, _: &[RenderView]) {}

    pub(super) fn choices(&self, _: &FrameTables, _: &[Arc<Labels>]) -> impl Iterator<Item = TuningChoice> {
        iter::empty()
    }

    pub(super) fn update(&mut self, _: &FrameTables) {}
}

#[derive(Debug, Default)]
pub(super) struct PassTriangles;

impl PassTriangles {
    pub(super) fn begin_frame(&mut self, _culls_triangles: bool) {}

    pub(super) fn culled(&self) -> CulledTriangles {
        CulledTriangles::default()
    }

    pub(super) fn find(&mut self, _: &DrawList, _: &CullingTables, _: &Assets) {}
}
