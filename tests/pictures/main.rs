//! Pictures drawn by wgpu on the machine's adapter.
//!
//! Without an adapter, without its timestamps, or without the scenes beside the repository, the cases that need them
//! are reported as ignored. `DRAWLOOM_REQUIRE_ADAPTER=1`, `DRAWLOOM_REQUIRE_TIMESTAMPS=1` and
//! `DRAWLOOM_REQUIRE_SCENES=1` make each of these fail them. The [`slow_cases`] are ignored without
//! `DRAWLOOM_SLOW_CASES=1`. `DRAWLOOM_RENEW_REFERENCES=1` rewrites the references: check each of them before you commit
//! it.

mod attributes;
mod buffers;
mod cached_layers;
mod cameras;
mod cascades;
mod changes;
mod changing_shaders;
mod columns;
mod cube_shadows;
mod deformation;
mod depth_states;
mod determinism;
mod compute;
mod cpu_nodes;
mod imported_meshes;
mod device_times;
mod devices;
mod extremes;
mod fences;
mod fixture;
mod formats;
mod geometry;
mod history;
mod image_distance;
mod imported_targets;
mod item_data;
mod item_faults;
mod items;
mod kept_processes;
mod large_lists;
mod levels_of_detail;
mod light_cut_off;
mod light_sums;
mod light_volumes;
mod lighting;
mod mask_shadows;
mod masks;
mod materials;
mod mip_levels;
mod moving_in;
mod multisampling;
mod view_filter;
mod static_groups;
mod own_pipelines;
mod own_views;
mod pipeline_state;
mod placement;
mod post;
mod precision;
mod prepared_pipelines;
mod previous_objects;
mod processes;
mod random_scenes;
mod raw_encoders;
mod rays;
mod read_back;
mod redraw;
mod references;
mod requirements;
mod resources;
mod retained;
mod sampled_histories;
mod sampled_layers;
mod sampled_views;
mod shadow_bias;
mod shadow_casters;
mod shadow_interval;
mod shadow_scenes;
mod shadows;
mod shared_encoders;
mod slow_cases;
mod software;
mod split_screen;
mod stencil;
mod strategies;
mod streaming;
mod target_formats;
mod textures;
mod transforms;
mod transient_targets;
mod transparency;
mod triangles;
mod vertex_colors;
mod warm_up;

use drawloom_testing::shared_scenes;
use libtest_mimic::{Arguments, Failed, Trial};

type Case = (&'static str, fn() -> Result<(), Failed>);

fn main() {
    let arguments = Arguments::from_args();
    let no_adapter = fixture::device().is_err();
    let is_set = |name| std::env::var_os(name).is_some_and(|value| value == "1");
    let required = is_set("DRAWLOOM_REQUIRE_ADAPTER");
    let no_scenes = shared_scenes::are_optional_and_missing();
    let no_timestamps = !is_set("DRAWLOOM_REQUIRE_TIMESTAMPS") && !device_times::has_timestamps();
    let mut trials = Vec::new();
    let cases = [
        (attributes::CASES, Needs::Adapter),
        (buffers::CASES, Needs::Adapter),
        (cached_layers::CASES, Needs::Adapter),
        (cameras::CASES, Needs::Adapter),
        (cascades::CASES, Needs::Adapter),
        (changes::CASES, Needs::Adapter),
        (extremes::CASES, Needs::Adapter),
        (fences::CASES, Needs::Adapter),
        (formats::CASES, Needs::Adapter),
        (geometry::CASES, Needs::Adapter),
        (history::CASES, Needs::Adapter),
        (imported_targets::CASES, Needs::Adapter),
        (item_data::CASES, Needs::Adapter),
        (item_faults::CASES, Needs::Adapter),
        (items::CASES, Needs::Adapter),
        (kept_processes::CASES, Needs::Adapter),
        (large_lists::CASES, Needs::Adapter),
        (levels_of_detail::CASES, Needs::Adapter),
        (light_cut_off::CASES, Needs::Adapter),
        (light_sums::CASES, Needs::Adapter),
        (light_volumes::CASES, Needs::Adapter),
        (lighting::CASES, Needs::Adapter),
        (changing_shaders::CASES, Needs::Adapter),
        (columns::CASES, Needs::Adapter),
        (previous_objects::CASES, Needs::Adapter),
        (compute::CASES, Needs::Adapter),
        (cpu_nodes::CASES, Needs::Adapter),
        (cube_shadows::CASES, Needs::Adapter),
        (deformation::CASES, Needs::Adapter),
        (mask_shadows::CASES, Needs::Adapter),
        (masks::CASES, Needs::Adapter),
        (materials::CASES, Needs::Adapter),
        (mip_levels::CASES, Needs::Adapter),
        (moving_in::CASES, Needs::Adapter),
        (multisampling::CASES, Needs::Adapter),
        (view_filter::CASES, Needs::Adapter),
        (static_groups::CASES, Needs::Adapter),
        (own_pipelines::CASES, Needs::Adapter),
        (own_views::CASES, Needs::Adapter),
        (pipeline_state::CASES, Needs::Adapter),
        (placement::CASES, Needs::Adapter),
        (post::CASES, Needs::Adapter),
        (precision::CASES, Needs::Adapter),
        (prepared_pipelines::CASES, Needs::Adapter),
        (processes::CASES, Needs::Adapter),
        (random_scenes::CASES, Needs::Adapter),
        (raw_encoders::CASES, Needs::Adapter),
        (read_back::CASES, Needs::Adapter),
        (redraw::CASES, Needs::Adapter),
        (references::CASES, Needs::Adapter),
        (references::CASES_OF_SHARED_SCENES, Needs::AdapterAndSharedScenes),
        (requirements::CASES, Needs::Adapter),
        (resources::CASES, Needs::Adapter),
        (retained::CASES, Needs::Adapter),
        (sampled_histories::CASES, Needs::Adapter),
        (sampled_layers::CASES, Needs::Adapter),
        (sampled_views::CASES, Needs::Adapter),
        (depth_states::CASES, Needs::Adapter),
        (determinism::CASES, Needs::Adapter),
        (determinism::CASES_OF_SHARED_SCENES, Needs::AdapterAndSharedScenes),
        (split_screen::CASES, Needs::Adapter),
        (stencil::CASES, Needs::Adapter),
        (shared_encoders::CASES, Needs::Adapter),
        (strategies::CASES, Needs::Adapter),
        (streaming::CASES, Needs::Adapter),
        (transparency::CASES, Needs::Adapter),
        (shadow_bias::CASES, Needs::Adapter),
        (shadow_casters::CASES, Needs::Adapter),
        (shadow_interval::CASES, Needs::Adapter),
        (shadow_scenes::CASES, Needs::Adapter),
        (shadows::CASES, Needs::Adapter),
        (software::CASES, Needs::Adapter),
        (software::CASES_OF_SHARED_SCENES, Needs::AdapterAndSharedScenes),
        (target_formats::CASES, Needs::Adapter),
        (textures::CASES, Needs::Adapter),
        (transforms::CASES, Needs::Adapter),
        (transient_targets::CASES, Needs::Adapter),
        (triangles::CASES, Needs::Adapter),
        (vertex_colors::CASES, Needs::Adapter),
        (warm_up::CASES, Needs::Adapter),
        (imported_meshes::CASES, Needs::Adapter),
        (device_times::CASES, Needs::AdapterAndTimestamps),
        (devices::CASES, Needs::Nothing),
    ];
    for (cases, needs) in cases {
        let is_left_out = match needs {
            Needs::Nothing | Needs::Adapter => false,
            Needs::AdapterAndTimestamps => no_timestamps,
            Needs::AdapterAndSharedScenes => no_scenes,
        };
        let lacks_adapter = needs != Needs::Nothing && no_adapter;
        for &(name, case) in cases {
            let case = move || if lacks_adapter { Err("there is no graphics adapter".into()) } else { case() };
            let is_too_slow = drawloom_testing::slow_cases::leave_out(slow_cases::NAMES, name);
            let is_ignored = is_left_out || is_too_slow || (lacks_adapter && !required);
            trials.push(Trial::test(name, case).with_ignored_flag(is_ignored));
        }
    }
    slow_cases::check(&trials);
    libtest_mimic::run(&arguments, trials).exit();
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Needs {
    Nothing,
    Adapter,
    AdapterAndTimestamps,
    AdapterAndSharedScenes,
}
