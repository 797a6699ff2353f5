//! Statistics of a frame.

use std::time::Duration;

use super::tables::FrameTables;
use crate::backend::{FrameRequest, TargetMemory};
use crate::raster::CulledTriangles;
use crate::scene::ViewKind;
use crate::timeline::FrameTuning;
use crate::view::{Rejection, RenderView};

/// Statistics of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStatistics {
    /// Objects in the scene.
    pub objects: usize,
    /// Valid lights in the scene; the others are among the rejections.
    pub lights: usize,
    /// One for each view.
    pub views: Vec<ViewStatistics>,
    /// Bytes that were uploaded to the device.
    pub uploaded: u64,
    /// The memory of the frame's targets. The software backend does not tell.
    pub targets: TargetMemory,
    /// The thread time of each group of stages.
    pub stages: StageTimes,
    /// What was left out or cannot be drawn as requested, and why.
    pub rejections: Vec<Rejection>,
    /// What was chosen by measurement, and by which costs.
    pub tuning: FrameTuning,
}

/// Statistics of a view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewStatistics {
    /// The camera's name.
    pub name: String,
    /// The kind of view.
    pub kind: ViewKind,
    /// Objects it sees.
    pub visible: usize,
    /// Objects in its frustum that others hide: see [`Quality::occlusion`](crate::quality::Quality::occlusion).
    pub occluded: usize,
    /// Lights that reach it.
    pub lights: usize,
    /// Commands, over all its processes.
    pub commands: usize,
    /// Instanced draws, over all its processes.
    pub batches: usize,
    /// Bundles that the batches fill, whether they are recorded as bundles or not.
    pub bundles: usize,
    /// Triangles that were tested and culled on the CPU, over all its processes: see
    /// [`Mesh::with_triangle_culling`](crate::scene::Mesh::with_triangle_culling).
    pub culled_triangles: CulledTriangles,
}

/// The thread time of each group of stages, summed over workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Checking objects, uploading them if all changed, and finding the objects and lights that each view sees.
    pub visibility: Duration,
    /// Filling commands.
    pub fill: Duration,
    /// Sorting commands, and ordering objects by bin.
    pub sort: Duration,
    /// Merging commands into batches, joining these to draw lists, and culling triangles.
    pub instance: Duration,
    /// Other uploads, recording and finishing passes.
    pub record: Duration,
    /// Submitting; 0 until the frame is submitted.
    pub submit: Duration,
}

impl FrameStatistics {
    /// The statistics of a frame whose stages have run.
    pub(super) fn new(
        request: &FrameRequest<'_>,
        tables: &FrameTables,
        (uploaded, targets): (u64, TargetMemory),
        stages: StageTimes,
        tuning: FrameTuning,
    ) -> Self {
        let views =
            request.views.iter().enumerate().map(|(index, view)| ViewStatistics::new(index, view, request, tables));
        Self {
            objects: request.scene.object_count(),
            lights: request.lights.len(),
            views: views.collect(),
            uploaded,
            targets,
            stages,
            rejections: request.rejections.list(),
            tuning,
        }
    }
}

impl ViewStatistics {
    fn new(index: usize, view: &RenderView, request: &FrameRequest<'_>, tables: &FrameTables) -> Self {
        let mut statistics = Self {
            name: view.name().to_owned(),
            kind: view.kind(),
            visible: tables.visibility[index].set.count(),
            occluded: tables.occlusion[index].hidden(),
            lights: tables.lights[index].gpu_lights().len(),
            commands: 0,
            batches: 0,
            bundles: 0,
            culled_triangles: CulledTriangles::default(),
        };
        for (table, _) in tables.passes.iter().zip(request.passes).filter(|(_, pass)| pass.view_index == index) {
            let list = table.list.read();
            statistics.commands += list.objects.len();
            statistics.batches += list.batches.len();
            statistics.bundles += list.bundle_count();
            statistics.culled_triangles += table.triangles.read().culled();
        }
        statistics
    }
}
