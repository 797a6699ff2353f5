//! The deferred pipeline has the processes that a scene requires, and no others.

use drawloom::backend::{Picture, WgpuResources};
use drawloom::process::{Deferred, Fxaa, LightVolumes};
use drawloom::scene::{Blend, Changes, LayerMask, Light, LightKind, Material, Mesh, Scene, SceneRef, ViewKind};
use drawloom::view::{LightClass, ShadowMaps};
use drawloom_testing::scenes::cube;
use drawloom_testing::scenes::everything::{SIZE, class_of, dark, everything, glasses, without_shadow};
use libtest_mimic::Failed;

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
    ("every_process_is_needed_by_another_or_changes_the_picture", every_process_is_needed),
    ("a_mesh_is_drawn_in_the_first_frame_in_which_an_object_has_it", first_use_of_meshes),
    ("processes_change_with_the_requirements_and_are_cached", cached_plans),
];

const MAPS: ShadowMaps = ShadowMaps { side: 128, max_distance: 20.0, bias: 1.0, filter: 1, layers: LayerMask::ALL };
const BYTES_OF_A_MAP: i64 = 128 * 128 * 4;
/// A list, a mirrored list, and a double-sided strip, which subdivision converts to a list.
const OPAQUE_STATES: i64 = 3;
const OPAQUE_STATES_IN_MAPS: i64 = 4;
const GLASS_STATES: i64 = 3;

fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(MAPS))
}

/// The processes of one frame of a new renderer, and their costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Cost {
    passes: i64,
    pipelines: i64,
    targets: i64,
    target_bytes: i64,
    shadow_views: i64,
    lights: i64,
}

impl Cost {
    fn minus(self, other: Self) -> Self {
        Self {
            passes: self.passes - other.passes,
            pipelines: self.pipelines - other.pipelines,
            targets: self.targets - other.targets,
            target_bytes: self.target_bytes - other.target_bytes,
            shadow_views: self.shadow_views - other.shadow_views,
            lights: self.lights - other.lights,
        }
    }
}

/// A new renderer's picture of a scene, and its costs.
fn drawn(deferred: Deferred, scene: &Scene) -> Result<(Cost, Picture), Failed> {
    let output = deferred.output();
    let mut fixture = Fixture::with(2, |builder| builder.deferred(deferred))?;
    let recorded = fixture.record(scene)?;
    let views = &recorded.statistics().views;
    let mut cost = Cost {
        passes: recorded.queues().iter().map(|queue| queue.passes.len() as i64).sum(),
        shadow_views: views.iter().filter(|view| view.kind == ViewKind::Shadow).count() as i64,
        lights: views.iter().map(|view| view.lights as i64).sum(),
        ..Cost::default()
    };
    let picture = fixture.submit(recorded)?.read(0, output)?;
    let WgpuResources { pipelines, targets, target_bytes, .. } = fixture.renderer.backend().resources();
    (cost.pipelines, cost.targets, cost.target_bytes) = (pipelines as i64, targets as i64, target_bytes as i64);
    Ok((cost, picture))
}

/// Checks a scene without a feature. Its cost and its picture must equal those of a bare pipeline without a process for the
/// feature, and its cost must be lower than that of the scene with everything, by `saved`.
fn expect_saved(
    full: &(Cost, Picture),
    context: &str,
    scene: &Scene,
    bare: Deferred,
    saved: Cost,
) -> Result<(), Failed> {
    let (cost, picture) = drawn(deferred(), scene)?;
    let (bare_cost, bare_picture) = drawn(bare, scene)?;
    if cost != bare_cost {
        return Err(format!("{context}: {cost:?}, where a pipeline without it has {bare_cost:?}").into());
    }
    if picture != bare_picture {
        return Err(format!("{context}: a pipeline without it draws another picture").into());
    }
    if full.0.minus(cost) != saved {
        return Err(format!("{context}: {:?} is saved, and should be {saved:?}", full.0.minus(cost)).into());
    }
    expect_changed(context, &full.1, &picture)
}

/// Fails if two pictures differ by no more than rounding.
fn expect_changed(context: &str, one: &Picture, other: &Picture) -> Result<(), Failed> {
    let pixels = one.bytes.chunks_exact(4).zip(other.bytes.chunks_exact(4));
    let differ = |one: &[u8], other: &[u8]| one.iter().zip(other).any(|(one, other)| one.abs_diff(*other) > 8);
    let changed = pixels.filter(|(one, other)| differ(one, other)).count();
    if changed >= 20 { Ok(()) } else { Err(format!("{context}: only {changed} pixels change").into()) }
}

fn expect_same(context: &str, one: &(Cost, Picture), other: &(Cost, Picture)) -> Result<(), Failed> {
    if one.0 != other.0 {
        return Err(format!("{context}: {:?} should be {:?}", one.0, other.0).into());
    }
    if one.1 == other.1 { Ok(()) } else { Err(format!("{context}: the picture differs").into()) }
}

/// Every class of lights.
fn classes() -> impl Iterator<Item = LightClass> {
    LightClass::all().filter(|class| class.kind != LightKind::Point || !class.shadowed)
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
    for class in classes().filter(|class| class.shadowed == shadowed) {
        let name = LightVolumes::name_of(class);
        let mut saved = Cost { passes: 1, pipelines: 1, lights: 1, ..Cost::default() };
        if class.shadowed {
            saved = Cost { passes: 2, target_bytes: BYTES_OF_A_MAP, shadow_views: 1, ..saved };
            // Only hemispherical lights see the strip subdivided.
            saved.pipelines += i64::from(class.kind == LightKind::Hemispherical);
        }
        expect_saved(&full, &name, &scene_without(class), deferred().leave_out(&name), saved)?;
    }
    Ok(())
}

fn dark_lights() -> Result<(), Failed> {
    for class in classes() {
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
    for light in &mut scene.lights {
        *light = without_shadow(*light);
    }
    let saved = Cost {
        passes: casters + casters,
        pipelines: casters + OPAQUE_STATES_IN_MAPS,
        targets: 1,
        target_bytes: casters * BYTES_OF_A_MAP,
        shadow_views: casters,
        lights: 0,
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
    let casters = scene.lights.iter().filter(|light| light.casts_shadow()).count() as i64;
    scene.lights.clear();
    let saved = Cost {
        passes: lights + casters,
        pipelines: lights + OPAQUE_STATES_IN_MAPS,
        targets: 1,
        target_bytes: casters * BYTES_OF_A_MAP,
        shadow_views: casters,
        lights,
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
    if cost == expected { Ok(()) } else { Err(format!("{cost:?} should be {expected:?}").into()) }
}

fn no_post() -> Result<(), Failed> {
    let without = drawn(Deferred::new().shadow_maps(Some(MAPS)), &everything())?;
    let pixels = i64::from(SIZE[0] * SIZE[1]);
    let step = Cost { passes: 1, pipelines: 1, targets: 1, target_bytes: pixels * 4, ..Cost::default() };
    let (one, one_picture) = drawn(deferred(), &everything())?;
    let (two, two_picture) = drawn(deferred().post(Fxaa::default()), &everything())?;
    for saved in [one.minus(without.0), two.minus(one)] {
        if saved != step {
            return Err(format!("a step costs {saved:?}, and should cost {step:?}").into());
        }
    }
    expect_changed("fxaa", &one_picture, &two_picture)?;
    let mut fixture = Fixture::with(2, |builder| builder.deferred(deferred()))?;
    let recorded = fixture.record(&everything())?;
    let radiance = fixture.submit(recorded)?.read(0, "radiance")?;
    if radiance == without.1 { Ok(()) } else { Err("without tone mapping, radiance differs".into()) }
}

fn no_depth_pre_pass() -> Result<(), Failed> {
    let (with, with_picture) = drawn(deferred().depth_pre_pass(true), &everything())?;
    let (without, picture) = drawn(deferred(), &everything())?;
    let saved = Cost { passes: 1, pipelines: OPAQUE_STATES, ..Cost::default() };
    if with.minus(without) != saved {
        return Err(format!("{:?} is saved, and should be {saved:?}", with.minus(without)).into());
    }
    if with_picture == picture { Ok(()) } else { Err("it changes the picture".into()) }
}

fn every_process_is_needed() -> Result<(), Failed> {
    let all = || deferred().depth_pre_pass(true).post(Fxaa::default());
    let mut fixture = Fixture::with(2, |builder| builder.deferred(all()))?;
    let picture = fixture.draw(&everything())?;
    let names = fixture.renderer.plan().processes().iter().map(|planned| planned.name.clone());
    let mut needed_by_others = Vec::new();
    let (mut count, mut changed) = (0, 0);
    for name in names {
        count += 1;
        let without = all().leave_out(&name);
        match Fixture::with(2, |builder| builder.deferred(without)) {
            Ok(mut fixture) => {
                expect_changed(&name, &picture, &fixture.draw(&everything())?)?;
                changed += 1;
            }
            Err(error) => needed_by_others.push((name, error.message().unwrap_or_default().to_owned())),
        }
    }
    let expected = [("depth pre-pass", "\"depth\""), ("geometry buffer", "\"normal\"")];
    let named = needed_by_others.iter().zip(expected);
    if needed_by_others.len() != expected.len()
        || !named.clone().all(|((name, error), (other, target))| name == other && error.contains(target))
    {
        return Err(format!("{needed_by_others:?} should be {expected:?}").into());
    }
    // A process per class of lights, shadow casters, transparency, and the two steps of post-processing.
    if (changed, count) == (11, 13) { Ok(()) } else { Err(format!("{changed} of {count} change the picture").into()) }
}

/// A change of the scene; the number of cached plans after it is first drawn, and the number of new pipelines then.
type Step = (&'static str, usize, usize, fn(&mut Scene) -> Result<(), Failed>);

const STEPS: &[Step] = &[
    // The plan of an empty scene always exists.
    ("everything", 2, EVERY_PIPELINE, |_| Ok(())),
    ("the last spot light with a shadow is removed", 3, 0, |scene| {
        scene.lights.retain(|light| light.kind() != LightKind::Spot || !light.casts_shadow());
        Ok(())
    }),
    ("it is added again", 3, 0, |scene| {
        scene.lights = everything().lights;
        Ok(())
    }),
    // Without shadows the shader of glass reads no maps.
    ("all shadows are disabled", 4, GLASS_STATES as usize, |scene| {
        scene.lights = everything().lights.into_iter().map(without_shadow).collect();
        Ok(())
    }),
    ("they are enabled again", 4, 0, |scene| {
        scene.lights = everything().lights;
        Ok(())
    }),
    ("most glass is removed", 4, 0, |scene| make_opaque(scene, 2)),
    ("the last glass is removed", 5, 0, |scene| make_opaque(scene, 3)),
    ("most lights are removed", 6, 0, |scene| {
        scene.lights.retain(|light| matches!(light, Light::Directional { casts_shadow: false, .. }));
        Ok(())
    }),
    // The rest requires no more than an empty scene.
    ("all lights are removed", 6, 0, |scene| {
        scene.lights.clear();
        Ok(())
    }),
    ("everything is added again", 6, 0, |scene| {
        scene.lights = everything().lights;
        make_opaque(scene, 0)
    }),
];

/// The pipelines for objects in maps, for opaque objects and for glass, for seven classes of lights, and for tone mapping.
const EVERY_PIPELINE: usize = (OPAQUE_STATES_IN_MAPS + OPAQUE_STATES + GLASS_STATES) as usize + 7 + 1;

/// Makes this many of the glass materials opaque.
fn make_opaque(scene: &mut Scene, count: usize) -> Result<(), Failed> {
    let handles = scene.assets().iter::<Material>().map(|(handle, _)| handle);
    let originals = everything();
    let originals = originals.assets().iter::<Material>().map(|(_, material)| material.clone());
    let glasses = handles.zip(originals).filter(|(_, material)| material.blend != Blend::None);
    for (index, (glass, material)) in glasses.collect::<Vec<_>>().into_iter().enumerate() {
        let blend = if index < count { Blend::None } else { material.blend };
        scene.replace(glass, Material { blend, ..material })?;
    }
    Ok(())
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
    let mut fixture = Fixture::with(2, |builder| builder.deferred(deferred()))?;
    let mut meshes = vec![last[0]; last.len()];
    for object in 0..last.len() {
        meshes[object] = last[object];
        let changed = [object as u32];
        let changes = if object == 0 { Changes::Unknown } else { Changes::Objects(&changed) };
        let mut new = Fixture::with(2, |builder| builder.deferred(deferred()))?;
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

fn cached_plans() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.deferred(deferred()))?;
    let mut scene = everything();
    let mut pictures = Vec::new();
    let mut pipelines = 0;
    for (context, plans, new_pipelines, change) in STEPS {
        change(&mut scene)?;
        let picture = fixture.draw(&scene)?;
        if fixture.renderer.plan_count() != *plans {
            return Err(format!("{context}: {} plans should be {plans}", fixture.renderer.plan_count()).into());
        }
        let kept = fixture.renderer.backend().resources();
        pipelines += new_pipelines;
        if kept.pipelines != pipelines {
            return Err(format!("{context}: {} pipelines should be {pipelines}", kept.pipelines).into());
        }
        let (fresh, fresh_picture) = drawn(deferred(), &scene)?;
        if picture != fresh_picture {
            return Err(format!("{context}: a new renderer draws another picture").into());
        }
        // The backend keeps up to twice as many shadow maps as are drawn.
        let max_bytes = fresh.target_bytes + fresh.shadow_views * BYTES_OF_A_MAP;
        if kept.targets as i64 != fresh.targets
            || !(fresh.target_bytes..=max_bytes).contains(&(kept.target_bytes as i64))
        {
            return Err(format!("{context}: {kept:?}, where a new renderer has {fresh:?}").into());
        }
        pictures.push(picture);
    }
    let kept = |fixture: &Fixture| (fixture.renderer.plan_count(), fixture.renderer.backend().resources().pipelines);
    let before = kept(&fixture);
    for ((context, .., change), before) in STEPS.iter().zip(&pictures) {
        change(&mut scene)?;
        if fixture.draw(&scene)? != *before {
            return Err(format!("{context}: the second time, the picture differs").into());
        }
    }
    if kept(&fixture) == before { Ok(()) } else { Err(format!("{before:?} grows to {:?}", kept(&fixture)).into()) }
}
