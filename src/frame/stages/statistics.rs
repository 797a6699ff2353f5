//! Statistics of a frame, and warnings of what is not drawn as requested.

use std::time::Duration;

use super::tables::{FrameTables, PassTable};
use crate::backend::{FrameRequest, TargetMemory};
use crate::command::Batch;
use crate::frame::static_groups::StaticGroupStatistics;
#[cfg(feature = "wgpu")]
use crate::process::{Draws, FramePlan, RequestLog};
use crate::raster::CulledTriangles;
use crate::scene::{Assets, ViewKind};
use crate::timeline::{FrameTuning, Timeline, TuningSubject};
use crate::unwind::emit;
use crate::view::{IssueReason, RenderView, SceneIssue};

/// Statistics of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStatistics {
    /// Objects in the scene.
    pub objects: usize,
    /// Valid lights in the scene; the others are among the scene issues.
    pub lights: usize,
    /// One for each view.
    pub views: Vec<ViewStatistics>,
    /// The thread time of each view's own stages and of those of its passes, summed over workers. 0 for a view that is
    /// not drawn.
    pub view_times: Vec<Duration>,
    /// What the frame did with the scene's [static groups](crate::scene::StaticGroup).
    pub static_groups: StaticGroupStatistics,
    /// Bytes that were uploaded to the device.
    pub uploaded: u64,
    /// Bytes that [CPU nodes](crate::frame::CpuNode) have filled, which are uploaded when the frame is submitted.
    pub generated: u64,
    /// The memory of the frame's targets. The software backend does not tell.
    pub targets: TargetMemory,
    /// The thread time of each group of stages.
    pub stages: StageTimes,
    /// What was left out or cannot be drawn as requested, and why.
    pub scene_issues: Vec<SceneIssue>,
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
    /// How many frames before this one it was drawn: 0 if this frame draws it. Else all figures below are 0: see
    /// [`Redraw`](crate::scene::Redraw).
    pub age: u32,
    /// Objects it sees, and all those that it executes with static groups.
    pub visible: usize,
    /// Static groups that it executes.
    pub static_groups: usize,
    /// The objects of these static groups.
    pub objects_of_static_groups: usize,
    /// Objects in its frustum that others hide: see [`Quality::occlusion`](crate::quality::Quality::occlusion). 0
    /// without the feature `occlusion`.
    pub occluded: usize,
    /// Lights that reach it.
    pub lights: usize,
    /// Items that it sees, over all its processes.
    pub items: usize,
    /// Commands, over all its processes.
    pub commands: usize,
    /// Instanced draws, over all its processes.
    pub batches: usize,
    /// Bundles that the batches and items fill, whether they are recorded as bundles or not.
    pub bundles: usize,
    /// Triangles that were tested and culled on the CPU, over all its processes: see
    /// `Mesh::with_triangle_culling`. 0 without the feature `occlusion`.
    pub culled_triangles: CulledTriangles,
    /// What levels of detail save; `None` where [`Quality::level_of_detail`](crate::quality::Quality::level_of_detail)
    /// is 0 or no mesh has levels.
    pub levels_of_detail: Option<LevelStatistics>,
}

/// The triangles of objects at their levels of detail, over all processes of a view, before any are subdivided or
/// culled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelStatistics {
    /// At the levels that are drawn. Cached views draw none.
    pub triangles: usize,
    /// At level 0.
    pub full_detail_triangles: usize,
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
    /// The engine's own [nodes](crate::frame::CpuNode).
    pub nodes: Duration,
    /// Submitting; 0 until the frame is submitted.
    pub submit: Duration,
}

impl StageTimes {
    /// The thread time of all groups.
    pub fn total(&self) -> Duration {
        let Self { visibility, fill, sort, instance, record, nodes, submit } = *self;
        visibility + fill + sort + instance + record + nodes + submit
    }
}

impl FrameStatistics {
    /// The quality level of each view of a [`ViewBudget`](crate::frame::ViewBudget), by name: 0 at its best.
    pub fn levels(&self) -> impl Iterator<Item = (&str, usize)> {
        let choices = self.tuning.choices.iter().filter(|choice| choice.subject == TuningSubject::QualityLevel);
        choices.filter_map(|choice| Some((choice.labels.view.as_deref()?, choice.chosen)))
    }

    /// Tells a timeline what the frame did with static groups, if the scene has any.
    pub(in crate::frame) fn count_static_groups(&self, timeline: &Timeline) {
        if self.static_groups != StaticGroupStatistics::default() {
            let executed = self.views.iter().map(|view| view.static_groups).sum::<usize>();
            let objects = self.views.iter().map(|view| view.objects_of_static_groups).sum::<usize>();
            timeline.count("static groups recorded", self.static_groups.recorded as f64);
            timeline.count("static groups executed", executed as f64);
            timeline.count("objects of executed static groups", objects as f64);
        }
    }

    /// The statistics of a frame of this many valid lights whose stages have run.
    pub(in crate::frame) fn new(
        request: &FrameRequest<'_>,
        lights: usize,
        tables: &FrameTables,
        (uploaded, targets): (u64, TargetMemory),
        stages: StageTimes,
        tuning: FrameTuning,
    ) -> Self {
        let views = request.views.iter().enumerate();
        let mut views: Vec<_> =
            views.map(|(index, view)| ViewStatistics::without_passes(index, view, tables)).collect();
        for (pass, table) in request.passes.iter().zip(&tables.passes) {
            views[pass.view_index].add_pass(table, request.scene.assets);
        }
        Self {
            objects: request.scene.object_count(),
            lights,
            views,
            view_times: tables.view_times.times().collect(),
            static_groups: tables.static_groups.statistics(),
            uploaded,
            generated: request.generated.iter().map(|contents| contents.byte_count() as u64).sum(),
            targets,
            stages,
            scene_issues: request.scene_issues.list_of(request.scene, |item| process_of_item(request, item)),
            tuning,
        }
    }
}

/// The process that draws an item, by its index among all that are lent.
fn process_of_item<'a>(request: &FrameRequest<'a>, item: usize) -> Option<&'a str> {
    let mut end = 0;
    let lent = request.items.iter().find(|lent| {
        end += lent.keys.len();
        item < end
    });
    lent.map(|lent| lent.process)
}

impl ViewStatistics {
    /// The statistics of a view, by index, before its passes are counted.
    fn without_passes(index: usize, view: &RenderView, tables: &FrameTables) -> Self {
        let visibility = &tables.visibility[index];
        Self {
            name: view.name().to_owned(),
            kind: view.kind(),
            age: view.age,
            visible: visibility.set.count() + visibility.static_groups.object_count(),
            static_groups: visibility.static_groups.executed().len(),
            objects_of_static_groups: visibility.static_groups.object_count(),
            occluded: tables.culling.hidden(index),
            lights: tables.lights[index].light_count(),
            items: 0,
            commands: 0,
            batches: 0,
            bundles: 0,
            culled_triangles: CulledTriangles::default(),
            levels_of_detail: tables.levels.get(index).map(|_| LevelStatistics::default()),
        }
    }

    fn add_pass(&mut self, table: &PassTable, assets: &Assets) {
        let list = table.list.read();
        self.items += list.items.items().len();
        self.commands += list.drawn_count();
        self.batches += list.batches.len();
        self.bundles += list.bundle_count();
        self.culled_triangles += table.triangles.read().culled();
        if let Some(levels) = &mut self.levels_of_detail {
            levels.add(&list.batches, assets);
        }
    }
}

impl LevelStatistics {
    fn add(&mut self, batches: &[Batch], assets: &Assets) {
        for &Batch { mesh, state, count, .. } in batches {
            let Some((_, mesh)) = assets.meshes.get_with_revision(mesh) else { continue };
            self.triangles += mesh.triangle_count_of(state.level_of_detail()) * count as usize;
            self.full_detail_triangles += mesh.triangle_count() * count as usize;
        }
    }
}

/// What warnings were about: each is reported when it changes, not in every frame.
#[derive(Debug, Default)]
pub(in crate::frame) struct Warnings {
    /// The scene issues of the latest frames.
    reported: Vec<SceneIssue>,
    /// Processes with raw passes, each with something that it declares, from plans whose frames were observed.
    #[cfg(feature = "wgpu")]
    observed: Vec<(String, String)>,
}

impl Warnings {
    /// Warns of the scene issues of a frame that are not reported yet. Some of them only drawing finds, so a frame with
    /// cached views finds a part of these: that many or more were reported.
    pub(in crate::frame) fn report(&mut self, scene_issues: &[SceneIssue], has_cached_views: bool) {
        let is_partial = |reason| {
            use IssueReason::{CoarseEdges, LightLimit, UndrawableMesh};
            has_cached_views && matches!(reason, CoarseEdges | LightLimit | UndrawableMesh)
        };
        for issue in scene_issues {
            let is_part = |known: &SceneIssue| {
                is_partial(known.reason) && known.reason == issue.reason && known.count >= issue.count
            };
            let is_reported = self.reported.iter().any(|known| known == issue || is_part(known));
            // A light that is switched off is no mistake, and what is streamed arrives.
            let is_expected = matches!(
                issue.reason,
                IssueReason::DarkLight | IssueReason::NotResident | IssueReason::TextureNotResident
            );
            if is_expected || is_reported {
                continue;
            }
            let SceneIssue { reason, count, first, name } = issue;
            // A name is the engine's, or a file's.
            let (reason, name) = (reason.name(), name.as_deref().map(tracing::field::debug));
            emit(|| tracing::warn!(target: "drawloom", count, first, name, "not drawn as requested: {reason}"));
        }
        let before: Vec<_> = self.reported.drain(..).filter(|known| is_partial(known.reason)).collect();
        self.reported.extend_from_slice(scene_issues);
        for before in before {
            match self.reported.iter_mut().find(|known| known.reason == before.reason) {
                Some(known) if known.count < before.count => *known = before,
                Some(_) => {}
                None => self.reported.push(before),
            }
        }
    }

    /// Ends a frame of this plan. Warns of what raw passes have not asked for in the first frames that encoded them,
    /// though their processes declare it. A process is in many plans: what one of them has shown is not observed again.
    #[cfg(feature = "wgpu")]
    pub(in crate::frame) fn report_unrequested(&mut self, plan: &FramePlan, draws: &[Draws<'_>]) {
        for (planned, draws) in plan.processes().iter().zip(draws) {
            let Draws::Raw(_) = draws else { continue };
            for (resource, is_requested) in planned.requests.end_frame(&planned.declaration) {
                let declared = (planned.name.clone(), resource);
                if self.observed.contains(&declared) {
                    continue;
                }
                if !is_requested {
                    let ((process, resource), frames) = (&declared, RequestLog::OBSERVED_FRAMES);
                    emit(|| {
                        tracing::warn!(
                            target: "drawloom",
                            %process,
                            "declares {resource}, which its raw pass has not asked for in {frames} frames"
                        );
                    });
                }
                self.observed.push(declared);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use tracing::span::{Attributes, Id, Record};
    use tracing::subscriber::NoSubscriber;
    use tracing::{Dispatch, Event, Metadata, Subscriber};

    use super::*;

    #[test]
    fn the_total_of_a_frame_is_that_of_all_groups_of_stages() {
        let [visibility, fill, sort, instance, record, nodes, submit] =
            [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000].map(Duration::from_nanos);
        let times = StageTimes { visibility, fill, sort, instance, record, nodes, submit };
        assert_eq!(times.total(), Duration::from_nanos(1_111_111));
    }

    /// Counts events.
    struct Counter(Arc<AtomicUsize>);

    impl Subscriber for Counter {
        fn enabled(&self, _: &Metadata<'_>) -> bool {
            true
        }

        fn new_span(&self, _: &Attributes<'_>) -> Id {
            Id::from_u64(1)
        }

        fn record(&self, _: &Id, _: &Record<'_>) {}

        fn record_follows_from(&self, _: &Id, _: &Id) {}

        fn event(&self, _: &Event<'_>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }

        fn enter(&self, _: &Id) {}

        fn exit(&self, _: &Id) {}
    }

    #[test]
    fn an_issue_is_reported_when_it_changes_and_not_because_a_frame_sees_a_part_of_it() {
        use IssueReason::{CoarseEdges, UndrawableMesh, UnknownObject};
        // With a single subscriber, the first thread to reach an event would decide for all whether it is wanted.
        let _second = Dispatch::new(NoSubscriber::default());
        let events = Arc::new(AtomicUsize::new(0));
        let subscriber = Dispatch::new(Counter(Arc::clone(&events)));
        let mut warnings = Warnings::default();
        let first = Cell::new(0);
        let mut warned = |issues: &[(IssueReason, usize)], has_cached_views| {
            let issues: Vec<_> = issues
                .iter()
                .map(|&(reason, count)| SceneIssue { reason, count, first: first.get(), name: None })
                .collect();
            tracing::dispatcher::with_default(&subscriber, || warnings.report(&issues, has_cached_views));
            events.swap(0, Ordering::Relaxed)
        };
        let (all, with_cached_views) = (false, true);
        assert_eq!(warned(&[(CoarseEdges, 5)], all), 1);
        assert_eq!(warned(&[(CoarseEdges, 5)], all), 0, "it is known");
        assert_eq!(warned(&[(CoarseEdges, 3)], with_cached_views), 0, "a part of it");
        assert_eq!(warned(&[], with_cached_views), 0);
        assert_eq!(warned(&[(CoarseEdges, 5)], all), 0, "it was there all the time");
        assert_eq!(warned(&[(CoarseEdges, 6)], with_cached_views), 1, "more than were known");
        assert_eq!(warned(&[(CoarseEdges, 6)], with_cached_views), 0, "they are known now");
        first.set(3);
        assert_eq!(warned(&[(CoarseEdges, 6)], with_cached_views), 0, "as many others");
        assert_eq!(warned(&[(CoarseEdges, 6)], all), 0, "these are known too");
        first.set(0);
        assert_eq!(warned(&[(CoarseEdges, 4)], all), 1, "fewer, as all views are drawn");
        assert_eq!(warned(&[(CoarseEdges, 4), (UndrawableMesh, 2)], with_cached_views), 1, "another reason");
        assert_eq!(warned(&[(UndrawableMesh, 1)], with_cached_views), 0);
        assert_eq!(warned(&[(CoarseEdges, 4), (UndrawableMesh, 2)], all), 0);
        assert_eq!(
            warned(&[(CoarseEdges, 4), (UndrawableMesh, 2), (UnknownObject, 1)], all),
            1,
            "a reason of all frames"
        );
        assert_eq!(warned(&[(CoarseEdges, 4), (UndrawableMesh, 2)], all), 0);
        assert_eq!(warned(&[(CoarseEdges, 4), (UndrawableMesh, 2), (UnknownObject, 1)], all), 1, "it is back");
    }
}
