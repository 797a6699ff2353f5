//! The pipeline of a frame: its stages, in order.

pub(super) mod context;
#[cfg(feature = "occlusion")]
pub(super) mod culling;
pub(super) mod granularity;
#[cfg(not(feature = "occlusion"))]
pub(super) mod no_culling;
pub(super) mod stage;
pub(super) mod stage_graph;
pub(super) mod statistics;
pub(super) mod tables;
#[cfg(feature = "occlusion")]
mod of_culling;
mod of_passes;
mod of_views;

#[cfg(not(feature = "occlusion"))]
pub(super) use no_culling as culling;
#[cfg(feature = "occlusion")]
use of_culling::*;
use of_passes::*;
use of_views::*;

use self::context::FrameContext;
use self::granularity::StageGroup::{self, Fill, Instance, Record, Sort, Visibility};
use self::stage::Chunking::{ByCost, ByDraws, PerBucket, PerItem};
use self::stage::StageOwner::{Frame, Pass, View};
use self::stage::{Chunking, Stage, StageJob, StageOwner};
use self::tables::PassMode as Mode;
use crate::backend::Backend;
use crate::command::DrawList;
use crate::graph::NodeError;

impl<B: Backend> Stage<B> {
    /// All stages. To add one, add a row, and a function that does the work of a job.
    ///
    /// The columns: the name; what has a node of its own for it; the stage that it waits for, or alternatives; which
    /// passes have it; the number of its items; how they are divided into jobs; which of the
    /// [`StageTimes`](super::StageTimes) counts it; the work.
    #[rustfmt::skip] // A row a stage.
    pub(super) const ALL: &'static [Self] = &[
        stage("objects", Frame, &[], Mode::always, changed_blocks, ByCost, Visibility, update_objects),
        stage("bins", Frame, &["objects"], Mode::always, one, PerItem, Visibility, complete_objects),
        stage("upload", Frame, &["objects"], Mode::always, outdated_blocks, ByCost, Record, upload_objects),
        stage("item order", Frame, &[], Mode::draws_items, lent_items, PerItem, Sort, sort_items),
        stage("item bounds", Frame, &["item order"], Mode::draws_items, item_blocks, ByCost, Visibility, copy_item_bounds),
        stage("record static groups", Frame, &["bins"], Mode::has_static_groups, changed_groups, PerItem, Sort, record_groups),

        stage("visibility", View, &["bins"], Mode::draws_objects, tested_words, ByCost, Visibility, test_frustum),
        stage("levels", View, &["visibility"], Mode::chooses_levels, level_words, ByCost, Visibility, choose_levels),
        #[cfg(feature = "occlusion")]
        stage("occluders", View, &["levels", "visibility"], Mode::tests_occlusion, one_if_testing, PerItem, Visibility, choose_occluders),
        #[cfg(feature = "occlusion")]
        stage("coarse depth", View, &["occluders"], Mode::tests_occlusion, depth_strips, ByCost, Visibility, draw_occluders),
        #[cfg(feature = "occlusion")]
        stage("occlusion", View, &["coarse depth"], Mode::tests_occlusion, objects_if_testing, ByCost, Visibility, test_occlusion),
        stage("compact", View, &["occlusion", "levels", "visibility"], Mode::draws_objects, one, PerItem, Visibility, rank_visible),

        stage("cull items", Pass, &["item bounds"], Mode::draws_items, item_blocks_of_pass, ByCost, Visibility, cull_items),
        stage("list items", Pass, &["cull items"], Mode::draws_items, one, PerItem, Sort, list_items),
        stage("fill", Pass, &["compact"], Mode::sorts_commands, visible_objects, ByDraws { draws_per_item: 1 }, Fill, make_commands),
        // It chooses the size of the sort's jobs.
        stage("split", Pass, &["fill"], Mode::sorts_commands, one_unless_kept, PerItem, Sort, divide_commands).with_costs_of("sort"),
        stage("sort", Pass, &["split"], Mode::sorts_commands, buckets, PerBucket, Sort, sort_commands),
        stage("instance", Pass, &["sort"], Mode::sorts_commands, buckets, PerItem, Instance, merge_commands),
        stage("bin", Pass, &["compact"], Mode::orders_by_bin, segments, PerItem, Sort, bin_objects),
        stage("execute static groups", Pass, &["bin"], Mode::lists_static_groups, one_if_executed, PerItem, Instance, execute_groups),
        stage("join", Pass, &["instance", "execute static groups", "bin"], Mode::draws_objects, one_unless_kept, PerItem, Instance, join),
        #[cfg(feature = "occlusion")]
        stage("triangles", Pass, &["join"], Mode::has_cullable_meshes, cullable_draws, ByDraws { draws_per_item: 1 }, Instance, cull_triangles),
        #[cfg(feature = "occlusion")]
        stage("cull list", Pass, &["triangles"], Mode::has_cullable_meshes, one, PerItem, Instance, remove_culled),
        stage("prepare", Pass, &["cull list", "join", "list items"], Mode::has_parts, one, PerItem, Record, prepare),
        stage("record", Pass, &["prepare"], Mode::has_parts, parts, ByDraws { draws_per_item: DrawList::BATCHES_PER_BUNDLE }, Record, record),
        stage("finish", Pass, &["record"], Mode::always, one, PerItem, Record, finish),
    ];

    /// The stages that the frame, a view or a pass may have, in order.
    pub(super) fn all_of(of: StageOwner) -> impl Iterator<Item = &'static Self> {
        Self::ALL.iter().filter(move |stage| stage.of == of)
    }

    /// Shares the estimate of another stage's costs.
    const fn with_costs_of(self, cost_kind: &'static str) -> Self {
        Self { cost_kind, ..self }
    }

    /// Whether it takes longer or shorter where the view tests for occlusion: what comes after the test does, and what
    /// a view without it does not have.
    pub(super) fn depends_on_occlusion(&self, mode: Mode) -> bool {
        self.of == Pass || !(self.is_needed)(Mode { tests_occlusion: false, ..mode })
    }
}

/// A row of the table.
#[expect(clippy::too_many_arguments, reason = "they are the columns of a table")]
const fn stage<B: Backend>(
    name: &'static str,
    of: StageOwner,
    after: &'static [&'static str],
    is_needed: fn(Mode) -> bool,
    width: fn(&FrameContext<'_, B>, usize) -> usize,
    chunking: Chunking,
    group: StageGroup,
    run: fn(&FrameContext<'_, B>, StageJob<'_>) -> Result<(), NodeError>,
) -> Stage<B> {
    Stage { name, of, after, is_needed, width, chunking, group, cost_kind: name, run }
}

fn one<B: Backend>(_: &FrameContext<'_, B>, _of: usize) -> usize {
    1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::NullBackend;

    #[test]
    fn a_stage_waits_only_for_stages_that_stand_before_it() {
        let mut known = Vec::new();
        for Stage { name, after, .. } in Stage::<NullBackend>::ALL {
            let of_other_features = ["occlusion", "cull list"];
            let is_known = |before: &&&str| {
                known.contains(*before) || cfg!(not(feature = "occlusion")) && of_other_features.contains(*before)
            };
            assert!(after.iter().all(|before| is_known(&before)), "{name} waits for {after:?}, after {known:?}");
            assert!(!known.contains(name), "{name} is listed twice");
            known.push(name);
        }
    }

    #[test]
    fn the_stages_of_the_frame_come_before_those_of_views_and_those_before_the_ones_of_passes() {
        let owners = Stage::<NullBackend>::ALL.iter().map(|stage| stage.of as usize);
        assert!(owners.is_sorted());
    }
}
