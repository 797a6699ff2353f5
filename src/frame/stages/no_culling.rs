//! Replaces `culling` if the feature `occlusion` is off: frames cull objects by their view frustum alone. Each function
//! that the rest of the frame calls is in both modules.

use std::iter;
use std::sync::Arc;
use std::time::Duration;

use super::tables::FrameTables;
use crate::command::DrawList;
use crate::process::{Draws, FramePlan, Pass};
use crate::quality::Quality;
use crate::raster::CulledTriangles;
use crate::scene::Assets;
use crate::timeline::{Labels, TuningChoice};
use crate::view::{RenderView, UsedMeshes};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) struct CullingOptions;

impl CullingOptions {
    pub(in crate::frame) fn new(_: &Quality, _: &CullingTables) -> Self {
        Self
    }

    pub(in crate::frame) fn culls_triangles(self) -> bool {
        false
    }
}

pub(in crate::frame) fn allows_triangle_culling(_: &FramePlan, _: &[Draws<'_>], _: &RenderView, _: &Pass) -> bool {
    false
}

#[derive(Default)]
pub(in crate::frame) struct CullingTables;

impl CullingTables {
    pub(in crate::frame) fn update(&mut self, _: &Assets, _: &UsedMeshes) {}

    pub(in crate::frame) fn hidden(&self, _view: usize) -> usize {
        0
    }

    pub(in crate::frame) fn set_views(&mut self, _: &[RenderView]) {}

    pub(in crate::frame) fn tests_occlusion(&self, _view: usize) -> bool {
        false
    }

    pub(in crate::frame) fn add_time(&self, _view: usize, _: Duration) {}

    pub(in crate::frame) fn subtract_time(&self, _view: usize, _: Duration) {}

    pub(in crate::frame) fn is_cullable(&self, _mesh: u32) -> bool {
        false
    }
}

pub(in crate::frame) struct OcclusionControls;

impl OcclusionControls {
    pub(in crate::frame) fn new(
        _: CullingOptions,
        _: &FramePlan,
        _: &[Draws<'_>],
        _: &[Pass],
        _: &[RenderView],
    ) -> Self {
        Self
    }

    pub(in crate::frame) fn is_possible(&self, _view: usize) -> bool {
        false
    }

    pub(in crate::frame) fn inherit_measurements(&mut self, _: &Self, _: impl Iterator<Item = Option<usize>>) {}

    pub(in crate::frame) fn begin_frame(&self, _: &mut FrameTables, _: &Assets, _: &[RenderView]) {}

    pub(in crate::frame) fn choices(&self, _: &FrameTables, _: &[Arc<Labels>]) -> impl Iterator<Item = TuningChoice> {
        iter::empty()
    }

    pub(in crate::frame) fn update(&mut self, _: &FrameTables) {}
}

#[derive(Debug, Default)]
pub(in crate::frame) struct PassTriangles;

impl PassTriangles {
    pub(in crate::frame) fn begin_frame(&mut self, _culls_triangles: bool) {}

    pub(in crate::frame) fn culled(&self) -> CulledTriangles {
        CulledTriangles::default()
    }

    pub(in crate::frame) fn find(&mut self, _: &DrawList, _: &CullingTables, _: &Assets) {}
}
