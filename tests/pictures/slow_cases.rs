//! Cases that draw for several seconds on two cores, most of them with each recording strategy. Less of the same is in faster cases.

use libtest_mimic::Trial;

const NAMES: &[&str] = &[
    "a_class_without_lights_costs_nothing",
    "a_class_without_shadowed_lights_costs_nothing",
    "a_filtered_view_is_the_picture_of_a_scene_with_only_those_objects",
    "a_frame_in_flight_keeps_its_vertices",
    "a_mesh_and_a_texture_larger_than_a_frame_may_upload_arrive_in_pieces",
    "a_mesh_in_the_engines_buffers_looks_like_one_in_the_pages",
    "a_mesh_is_drawn_in_the_first_frame_in_which_an_object_has_it",
    "a_mirror_shows_the_scene_of_its_latest_redraw_and_the_rest_is_up_to_date",
    "a_moved_light_lags_together_with_its_shadow",
    "after_a_warm_up_lights_glass_and_mirrors_come_and_go_without_new_pipelines",
    "cached_bundles_are_recorded_again_when_a_shader_or_its_parameters_change",
    "cached_shadow_maps_equal_new_ones_while_nothing_moves",
    "deformed_objects_look_like_meshes_of_that_shape",
    "every_object_of_a_list_around_65536_is_drawn_once",
    "every_object_of_a_list_of_a_million_is_drawn_once",
    "every_pass_is_timed_once_with_every_strategy",
    "every_strategy_draws_meshes_in_the_engines_buffers",
    "every_strategy_draws_the_same_bytes",
    "frames_after_a_change_of_formats_are_those_of_a_new_renderer",
    "frames_in_flight_are_independent_with_every_strategy",
    "level_0_is_the_same_and_the_last_level_its_mean_with_every_strategy",
    "levels_of_detail_draw_the_bytes_of_their_triangles_with_any_strategy",
    "levels_of_detail_that_change_draw_the_same_bytes_with_any_strategy_and_order",
    "lights_that_are_switched_off_cost_nothing",
    "memory_of_meshes_and_textures_is_used_again",
    "meshes_in_the_engines_buffers_come_and_go",
    "meshes_that_come_one_by_one_are_drawn_like_meshes_that_come_at_once",
    "no_old_shadow_remains_when_lights_or_views_are_added_or_removed",
    "no_strategy_changes_the_picture_of_pieces",
    "pictures_without_contrast_are_unchanged",
    "pieces_follow_another_quality_plan_backend_and_instancing",
    "processes_change_with_the_requirements_and_are_cached",
    "same_bytes_of_coincident_copies",
    "same_bytes_of_sponza",
    "same_bytes_of_the_projects_own_scene",
    "shares_of_the_materials_change_no_byte",
    "streamed_scenes_look_the_same_once_everything_is_there",
    "tiles_of_a_parallel_projection_are_the_whole_picture",
    "tiles_put_together_are_the_whole_picture",
    "triangle_culling_changes_no_byte_while_other_things_change",
    "triangle_culling_changes_no_byte_with_any_strategy",
    "views_that_share_textures_have_the_same_pictures",
];

/// Whether a case is one of them.
pub fn contain(name: &str) -> bool {
    NAMES.contains(&name)
}

/// # Panics
/// One of them is no case.
pub fn check(trials: &[Trial]) {
    for name in NAMES {
        assert!(trials.iter().any(|trial| trial.name() == *name), "{name} is no case");
    }
}
