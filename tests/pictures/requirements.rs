//! The deferred pipeline has the processes that a scene requires, and no others.

mod cached_plans;
mod cost;
mod needed_processes;

use drawloom::backend::Picture;
use drawloom::process::{Deferred, Fxaa, LightVolumes};
use drawloom::scene::{Changes, LayerMask, Light, LightKind, Mesh, Scene, SceneRef};
use drawloom::view::LightClass;
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::cube;
use drawloom_testing::scenes::everything::{SIZE, class_of, dark, everything, glasses, without_shadow};
use libtest_mimic::Failed;

use self::cost::{Cost, drawn, expect_changed, expect_difference, expect_same, expect_saved};
use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("a_class_without_lights_costs_nothing", || no_light_of_a_class(false)),
    ("a_class_without_shadowed_lights_costs_nothing", || no_light_of_a_class(true)),
    ("lights_that_are_switched_off_cost_nothing", dark_lights),
    ("without_a_light_that_casts_shadows_there_is_no_shadow_map", no_casters),
    ("without_glass_there_is_no_transparency_process", no_glass),
    ("without_lights_there_is_no_light_process", no_light),
    ("an_empty_scene_is_cleared_and_tone_mapped", empty_scene),
    ("without_post_processing_steps_there_is_none", no_post),
    ("without_a_depth_pre_pass_there_is_none", no_depth_pre_pass),
    ("every_process_is_needed_by_another_or_changes_the_picture", needed_processes::every_process_is_needed),
    ("every_process_in_a_mirror_changes_what_it_shows", needed_processes::every_process_of_a_mirror_is_needed),
    ("a_mesh_is_drawn_in_the_first_frame_in_which_an_object_has_it", first_use_of_meshes),
    ("processes_change_with_the_requirements_and_are_cached", cached_plans::cached_plans),
];

const MAPS: ShadowMaps = ShadowMaps {
    side: 128,
    max_distance: 20.0,
    cascades: 1,
    split_lambda: 0.5,
    bias: 1.0,
    filter: 1,
    layers: LayerMask::ALL,
};
const BYTES_OF_A_MAP: i64 = 128 * 128 * 4;
/// A list, a mirrored list, and a double-sided strip, which subdivision converts to a list.
const OPAQUE_STATES: i64 = 3;
/// Also that list for hemispherical lights, and those of the sun's map, which clamps depth.
const OPAQUE_STATES_IN_MAPS: i64 = 4 + OPAQUE_STATES;
const GLASS_STATES: i64 = 3;
/// One of directional lights and one of all others, without and with shadow maps.
const LIGHT_PIPELINES: i64 = 4;

fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(MAPS))
}

/// The number of shadow maps of the scene's lights of a class, one light of each.
fn map_count(class: LightClass) -> i64 {
    match class.kind {
        _ if !class.shadowed => 0,
        LightKind::Point => 6,
        _ => 1,
    }
}

fn scene_without(class: LightClass) -> Scene {
    let mut scene = everything();
    scene.lights.retain(|light| class_of(light) != class);
    scene
}

fn full() -> Result<(Cost, Picture), Failed> {
    drawn(deferred(), &everything())
}

fn no_light_of_a_class(shadowed: bool) -> Result<(), Failed> {
    let full = full()?;
    for class in LightClass::all().filter(|class| class.shadowed == shadowed) {
        let name = LightVolumes::name_of(class);
        // Lights with a range share theirs.
        let pipelines = i64::from(class.kind == LightKind::Directional);
        let mut saved = Cost { passes: 1, pipelines, lights: 1, ..Cost::default() };
        if class.shadowed {
            let maps = map_count(class);
            saved = Cost { passes: 1 + maps, target_bytes: maps * BYTES_OF_A_MAP, shadow_views: maps, ..saved };
            // Only hemispherical lights see the strip subdivided.
            saved.pipelines += i64::from(class.kind == LightKind::Hemispherical);
            // Only its maps clamp depth.
            saved.pipelines += if class.kind == LightKind::Directional { OPAQUE_STATES } else { 0 };
        }
        expect_saved(&full, &name, &scene_without(class), deferred().leave_out(&name), saved)?;
    }
    Ok(())
}

fn dark_lights() -> Result<(), Failed> {
    for class in LightClass::all() {
        let mut scene = everything();
        for light in scene.lights.iter_mut().filter(|light| class_of(light) == class) {
            *light = dark(*light);
        }
        let expected = drawn(deferred(), &scene_without(class))?;
        expect_same(&LightVolumes::name_of(class), &drawn(deferred(), &scene)?, &expected)?;
    }
    Ok(())
}

fn no_casters() -> Result<(), Failed> {
    let mut scene = everything();
    let casters = scene.lights.iter().filter(|light| light.casts_shadow()).count() as i64;
    let maps: i64 = scene.lights.iter().map(|light| map_count(class_of(light))).sum();
    for light in &mut scene.lights {
        *light = without_shadow(*light);
    }
    let saved = Cost {
        passes: casters + maps,
        pipelines: LIGHT_PIPELINES / 2 + OPAQUE_STATES_IN_MAPS,
        targets: 1,
        target_bytes: maps * BYTES_OF_A_MAP,
        shadow_views: maps,
        ..Cost::default()
    };
    let bare = || Deferred::to_picture().shadow_maps(None);
    expect_saved(&full()?, "shadows", &scene, bare(), saved)?;
    // With `None` no light casts shadows.
    expect_same("no shadow maps", &drawn(bare(), &everything())?, &drawn(deferred(), &scene)?)?;
    let mut casting = everything();
    casting.lights.retain(Light::casts_shadow);
    scene.lights = casting.lights.iter().copied().map(without_shadow).collect();
    expect_same("no shadow maps, shadowed lights alone", &drawn(bare(), &casting)?, &drawn(deferred(), &scene)?)
}

/// The assets still have the materials.
fn no_glass() -> Result<(), Failed> {
    let mut scene = everything();
    let glasses = glasses(&scene);
    for handle in scene.objects().collect::<Vec<_>>() {
        let material = scene.object(handle)?.material;
        if glasses.iter().any(|(glass, _)| *glass == material) {
            scene.remove_object(handle)?;
        }
    }
    let saved = Cost { passes: 1, pipelines: GLASS_STATES, ..Cost::default() };
    expect_saved(&full()?, "transparency", &scene, deferred().leave_out("transparency"), saved)
}

fn no_light() -> Result<(), Failed> {
    let mut scene = everything();
    let lights = scene.lights.len() as i64;
    let maps: i64 = scene.lights.iter().map(|light| map_count(class_of(light))).sum();
    scene.lights.clear();
    let saved = Cost {
        passes: lights + maps,
        pipelines: LIGHT_PIPELINES + OPAQUE_STATES_IN_MAPS,
        targets: 1,
        target_bytes: maps * BYTES_OF_A_MAP,
        shadow_views: maps,
        lights,
        ..Cost::default()
    };
    let kinds = LightKind::ALL.map(|kind| LightVolumes::name_of(LightClass { kind, shadowed: false }));
    let bare = kinds.into_iter().fold(Deferred::to_picture().shadow_maps(None), Deferred::leave_out);
    expect_saved(&full()?, "lights", &scene, bare, saved)
}

fn empty_scene() -> Result<(), Failed> {
    let mut scene = Scene::new();
    scene.cameras = everything().cameras;
    let (cost, _) = drawn(deferred(), &scene)?;
    let pixels = i64::from(SIZE[0] * SIZE[1]);
    // Depth, normal, diffuse and radiance, and the picture.
    let expected = Cost { passes: 2, pipelines: 1, targets: 5, target_bytes: pixels * 24, ..Cost::default() };
    if (cost.draws, cost.commands) != (0, 0) {
        return Err(format!("{cost:?} draws nothing").into());
    }
    expect_difference("an empty scene", cost, expected)
}

fn no_post() -> Result<(), Failed> {
    let without = drawn(Deferred::new().shadow_maps(Some(MAPS)), &everything())?;
    let pixels = i64::from(SIZE[0] * SIZE[1]);
    let step = Cost { passes: 1, pipelines: 1, targets: 1, target_bytes: pixels * 4, ..Cost::default() };
    let (one, one_picture) = drawn(deferred(), &everything())?;
    let (two, two_picture) = drawn(deferred().post(Fxaa::default()), &everything())?;
    for saved in [one.minus(without.0), two.minus(one)] {
        expect_difference("a step", saved, step)?;
    }
    expect_changed("fxaa", &one_picture, &two_picture)?;
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
    let recorded = fixture.record(&everything())?;
    let radiance = fixture.submit(recorded)?.read(0, "radiance")?;
    if radiance == without.1 { Ok(()) } else { Err("without tone mapping, radiance differs".into()) }
}

fn no_depth_pre_pass() -> Result<(), Failed> {
    let (with, with_picture) = drawn(deferred().depth_pre_pass(true), &everything())?;
    let (without, picture) = drawn(deferred(), &everything())?;
    let saved = Cost { passes: 1, pipelines: OPAQUE_STATES, ..Cost::default() };
    expect_difference("a depth pre-pass", with.minus(without), saved)?;
    if with_picture == picture { Ok(()) } else { Err("it changes the picture".into()) }
}

/// The objects get their meshes one after the other. Some of these are larger than the buffers of the meshes before.
fn first_use_of_meshes() -> Result<(), Failed> {
    let mut scene = everything();
    let expected = drawn(deferred(), &scene)?.1;
    let block = scene.assets().iter::<Mesh>().find(|(_, mesh)| mesh.name() == "cube").ok_or("no cube")?.0;
    let mut last = scene.as_scene_ref().meshes.to_vec();
    for (size, mesh) in (1..).zip(last.iter_mut().filter(|mesh| **mesh == block)) {
        let cube = cube();
        let vertices = cube.vertices().iter().copied().cycle().take(size * 24 * 100).collect();
        *mesh = scene.add(Mesh::new("large cube", cube.topology(), vertices, cube.indices().to_vec())?)?;
    }
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
    let mut meshes = vec![last[0]; last.len()];
    for object in 0..last.len() {
        meshes[object] = last[object];
        let changed = [object as u32];
        let changes = if object == 0 { Changes::Unknown } else { Changes::Objects(&changed) };
        let mut new = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
        let mut pictures = Vec::new();
        for (fixture, changes) in [(&mut fixture, changes), (&mut new, Changes::Unknown)] {
            let recorded = fixture.renderer.record(SceneRef { meshes: &meshes, changes, ..scene.as_scene_ref() })?;
            pictures.push(fixture.submit(recorded)?.read(0, "picture")?);
        }
        if pictures[0] != pictures[1] {
            return Err(format!("object {object}: a new renderer draws another picture").into());
        }
        if (meshes == last) != (pictures[0] == expected) {
            return Err(format!("object {object}: the picture is that of all meshes too early, or never").into());
        }
    }
    Ok(())
}
