//! Which views test for occlusion.

use std::sync::Arc;

use super::super::tables::FrameTables;
use super::culling_options::CullingOptions;
use super::occlusion_control::OcclusionControl;
use crate::command::Selection;
use crate::process::{Draws, FramePlan, Pass};
use crate::scene::Assets;
use crate::timeline::{Labels, TuningChoice};
use crate::view::RenderView;

/// Which views of a stage graph test for occlusion, by measurement.
#[derive(Debug)]
pub(in crate::frame) struct OcclusionControls {
    options: CullingOptions,
    of_views: Vec<OcclusionControl>,
}

impl OcclusionControls {
    /// The controls of views in frames with these passes.
    pub(in crate::frame) fn new(
        options: CullingOptions,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        passes: &[Pass],
        views: &[RenderView],
    ) -> Self {
        let control_of = |view: (usize, &RenderView)| {
            // What is behind a clip plane hides nothing.
            let is_enabled = options.occlusion_tile.is_some() && !view.1.has_oblique_near_plane();
            OcclusionControl::new(is_enabled, plan, draws, passes, view)
        };
        Self { options, of_views: views.iter().enumerate().map(control_of).collect() }
    }

    /// Whether a view can test for occlusion.
    pub(in crate::frame) fn is_possible(&self, view: usize) -> bool {
        self.of_views[view].is_possible()
    }

    /// The objects that may occlude others in a view.
    pub(in crate::frame) fn occluders(&self, view: usize) -> &[Selection] {
        self.of_views[view].occluders.as_deref().unwrap_or_default()
    }

    /// Takes over what was measured in the frames of another graph. `kept` has the index of each view there; `None` for
    /// a view that it does not have.
    pub(in crate::frame) fn inherit_measurements(&mut self, before: &Self, kept: impl Iterator<Item = Option<usize>>) {
        for (control, kept) in self.of_views.iter_mut().zip(kept) {
            if let Some(index) = kept {
                control.inherit_measurements(&before.of_views[index]);
            }
        }
    }

    /// Begins a frame of these views in the tables.
    pub(in crate::frame) fn begin_frame(&self, tables: &mut FrameTables, assets: &Assets, views: &[RenderView]) {
        if self.of_views.iter().any(OcclusionControl::is_possible) {
            tables.culling.occluder_meshes.sync(assets, tables.objects.used_meshes());
        }
        let tile = self.options.occlusion_tile;
        for (index, (control, view)) in self.of_views.iter().zip(views).enumerate() {
            tables.culling.occlusion[index].reset(view, tile.filter(|_| control.is_on()));
        }
    }

    /// The choices for a frame that was recorded, of views that have these labels.
    pub(in crate::frame) fn choices<'a>(
        &'a self,
        tables: &'a FrameTables,
        labels: &'a [Arc<Labels>],
    ) -> impl Iterator<Item = TuningChoice> + 'a {
        let views = self.of_views.iter().zip(labels).zip(tables.culling.occlusion.iter());
        views.filter_map(|((control, labels), occlusion)| control.choice(occlusion.is_on(), labels))
    }

    /// Updates the control of each view with the times of a frame that was recorded.
    pub(in crate::frame) fn update(&mut self, tables: &FrameTables) {
        // Of all views at most one begins a trial in a frame. Another one is first in each frame, so that none waits
        // forever.
        let (count, mut may_try) = (self.of_views.len().max(1), true);
        let first = self.of_views.iter().map(|control| control.frames() as usize).max().unwrap_or(0) % count;
        let (before, after) = self.of_views.split_at_mut(first);
        for (view, control) in
            (first..).zip(after).chain((0..).zip(before)).filter(|(_, control)| control.is_possible())
        {
            let occlusion = &tables.culling.occlusion[view];
            let visibility = &tables.visibility[view];
            let objects = visibility.set.count() + visibility.static_groups.object_count() + occlusion.hidden();
            control.update(occlusion.nanoseconds(), objects, occlusion.is_on(), &mut may_try);
        }
    }
}
