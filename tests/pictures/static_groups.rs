//! Pictures of scenes with static groups, against those of the same scenes without them.

use std::f32::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{
    Backend, BackendError, EncodingStrategy, Picture, RecordingStrategy, SoftwareBackend, StreamingBudget, WgpuBackend,
};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::{CommandDraws, CpuShader, Declare, Deferred, Draws, Format, GeometryFormats, RenderProcess};
use drawloom::quality::{CullingVolume, Quality, ShadowQuality, VertexFormat};
use drawloom::scene::{
    Camera, Changes, Light, Projection, RenderObject, Scene, SceneRef, StaticGroup, Topology, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, RendererBuilder, SubmittedFrame, Submitter};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::everything::everything_with_mirror;
use drawloom_testing::scenes::{cube, field, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::backend;
use crate::sampled_views::{MIRROR, SURFACE};
use crate::strategies::{expect, many_batches};
use crate::streaming::disc;

pub const CASES: &[Case] = &[
    ("static_groups_of_a_changing_world_do_not_change_its_pictures", || changing_world(|| on_the_device(Ok))),
    ("static_groups_of_a_changing_world_do_not_change_its_pictures_in_software", || {
        changing_world(|| in_software_with(|builder| builder))
    }),
    ("static_groups_change_no_shadow_mirror_or_light", || {
        everything(|| on_the_device_with(Ok, |builder| builder.process(OpaqueMirror)))
    }),
    ("static_groups_change_no_shadow_mirror_or_light_in_software", || {
        everything(|| in_software_with(|builder| builder.process(OpaqueMirror)))
    }),
    ("no_strategy_changes_the_picture_of_static_groups", strategies),
    ("static_groups_follow_another_quality_plan_backend_and_instancing", other_renderers),
    ("static_groups_whose_meshes_are_evicted_and_come_again_are_drawn_as_they_come", streamed),
    ("what_lies_beyond_the_far_plane_or_before_a_map_is_drawn_as_without_static_groups", far_planes),
];

/// The mirror as an opaque object that needs no order.
struct OpaqueMirror;

impl RenderProcess for OpaqueMirror {
    fn name(&self) -> &str {
        MIRROR.name()
    }

    fn declare(&self, declare: &mut Declare) {
        MIRROR.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        match MIRROR.draws() {
            Draws::Commands(draws) => {
                Draws::Commands(CommandDraws { selection: Selection::OPAQUE.in_layers(SURFACE), ..draws })
            }
            _ => unreachable!("the mirror draws objects"),
        }
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        MIRROR.cpu_shader()
    }
}

/// A renderer, and how the picture of a view is read.
struct Painter<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    read: fn(&SubmittedFrame<B>, usize) -> Result<Picture, Failed>,
}

impl<B: Backend> Painter<B> {
    /// The pictures of all cameras, and how many static groups all views executed.
    fn draw(&mut self, scene: SceneRef<'_>) -> Result<(Vec<Picture>, usize), Failed> {
        let submitted = self.submitter.submit(self.renderer.record(scene)?)?;
        let main = scene.cameras.iter().enumerate().filter(|(_, camera)| camera.kind == ViewKind::Main);
        let pictures = main.map(|(view, _)| (self.read)(&submitted, view));
        let executed = submitted.statistics.views.iter().map(|view| view.static_groups).sum();
        Ok((pictures.collect::<Result<_, _>>()?, executed))
    }

    /// Draws a scene with static groups, and compares its pictures with those of another renderer, which is told of no
    /// static groups and of no changes.
    fn compare(&mut self, plain: &mut Self, scene: SceneRef<'_>, name: &str) -> Result<usize, Failed> {
        let (found, executed) = self.draw(scene)?;
        let (expected, none) = plain.draw(SceneRef { static_groups: &[], changes: Changes::Unknown, ..scene })?;
        expect(none == 0, || format!("{name}: static groups of a scene without"))?;
        for (view, (found, expected)) in found.iter().zip(&expected).enumerate() {
            expect(found == expected, || format!("{name}: another picture of view {view}"))?;
        }
        Ok(executed)
    }
}

/// The shipped processes with small shadow maps.
fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(ShadowMaps { side: 48, ..ShadowMaps::default() }))
}

fn on_the_device(
    with: impl FnOnce(WgpuBackend) -> Result<WgpuBackend, BackendError>,
) -> Result<Painter<WgpuBackend>, Failed> {
    on_the_device_with(with, |builder| builder)
}

fn on_the_device_with(
    with: impl FnOnce(WgpuBackend) -> Result<WgpuBackend, BackendError>,
    build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
) -> Result<Painter<WgpuBackend>, Failed> {
    let builder = Renderer::builder(with(backend()?)?).pipeline(deferred());
    let (renderer, submitter) = build(builder).build(Arc::new(Scheduler::new(2)?))?;
    Ok(Painter { renderer, submitter, read: |submitted, view| Ok(submitted.submission.read(view, "picture")?) })
}

fn in_software_with(
    build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>,
) -> Result<Painter<SoftwareBackend>, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(deferred());
    let (renderer, submitter) = build(builder).build(scheduler)?;
    Ok(Painter { renderer, submitter, read: |submitted, view| Ok(submitted.submission.read(view, "picture")?) })
}

/// Static groups of up to `most` consecutive objects, with some left out.
fn static_groups_of(objects: Range<usize>, most: usize, random: &mut Random) -> Vec<StaticGroup> {
    let (mut static_groups, mut first) = (Vec::new(), objects.start);
    while first < objects.end {
        let end = first + 1 + random.below(most);
        if random.below(5) > 0 {
            static_groups.push(StaticGroup::new(format!("from {first}"), (first as u32..end as u32).collect()));
        }
        first = end;
    }
    static_groups
}

/// Objects, assets and static groups come, change and go; cameras move.
fn changing_world<B: Backend>(new: fn() -> Result<Painter<B>, Failed>) -> Result<(), Failed> {
    let (mut with, mut plain) = (new()?, new()?);
    let mut executed = 0;
    for seed in 0..3 {
        let (mut world, mut random) = (ChangingWorld::new(seed, 500), Random::stream(seed));
        let mut static_groups = static_groups_of(0..500, 100, &mut random);
        world.scene.cameras.iter_mut().for_each(|camera| camera.size = [80, 60]);
        let mut changed = String::new();
        for step in 0..24 {
            let name = format!("step {step} of {seed}, after {changed}");
            executed +=
                with.compare(&mut plain, SceneRef { static_groups: &static_groups, ..world.as_scene_ref() }, &name)?;
            if step % 10 == 9 {
                static_groups = static_groups_of(0..500, 100, &mut random);
            }
            world.scene.cameras[step % 2].position += random.direction() * 0.7;
            // Nothing changes in every third frame.
            changed = if step % 3 > 0 { world.step()? } else { "nothing".to_owned() };
            if step % 3 == 0 {
                let still = SceneRef { static_groups: &static_groups, changes: Changes::NONE, ..world.as_scene_ref() };
                executed += with.compare(&mut plain, still, &name)?;
            }
        }
    }
    expect(executed > 100, || format!("only {executed} static groups were executed"))
}

/// Lights of all kinds with shadow maps, a mirror, and blended objects.
fn everything<B: Backend>(new: fn() -> Result<Painter<B>, Failed>) -> Result<(), Failed> {
    let (mut with, mut plain) = (new()?, new()?);
    let mut scene = everything_with_mirror(SURFACE);
    scene.cameras.iter_mut().for_each(|camera| camera.size = [48, 32]);
    let objects = scene.as_scene_ref().object_count();
    scene.static_groups = (0..objects as u32)
        .step_by(3)
        .map(|first| {
            StaticGroup::new(
                format!("from {first}"),
                (first..first + 3).take_while(|object| (*object as usize) < objects).collect(),
            )
        })
        .collect();
    let mut executed = 0;
    for frame in 0..10 {
        let moved = [frame as u32];
        let changes = match frame {
            0 => Changes::Unknown,
            4 | 7 => Changes::Objects(&moved),
            _ => Changes::NONE,
        };
        if matches!(frame, 4 | 7) {
            let object = scene.objects().nth(frame).ok_or("an object")?;
            let before = scene.object(object)?;
            scene.replace_object(object, RenderObject { position: before.position + DVec3::X * 0.3, ..before })?;
        }
        scene.cameras[0].position.x += 0.05;
        executed +=
            with.compare(&mut plain, SceneRef { changes, ..scene.as_scene_ref() }, &format!("frame {frame}"))?;
    }
    // More than shadow maps alone would execute.
    expect(executed > 150, || format!("only {executed} static groups were executed"))
}

fn many_static_groups() -> Scene {
    let mut scene = many_batches();
    let mut random = Random::stream(5);
    scene.static_groups = static_groups_of(0..scene.as_scene_ref().object_count(), 900, &mut random);
    scene
}

fn strategies() -> Result<(), Failed> {
    use EncodingStrategy::{OnSubmit, PerPass, Split};
    use RecordingStrategy::{Bundles, CachedBundles, Direct};
    let mut scene = many_static_groups();
    let camera = scene.cameras[0].clone();
    for recording in [Direct, Bundles, CachedBundles] {
        for encoding in [PerPass, Split, OnSubmit] {
            let mut with = on_the_device(|wgpu| Ok(wgpu.recording_strategy(recording).encoding_strategy(encoding)))?;
            let mut plain = on_the_device(Ok)?;
            let mut executed = 0;
            for frame in 0..5 {
                scene.cameras[0].position = camera.position + DVec3::X * (4.0 * f64::from(frame));
                let scene = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
                executed += with.compare(&mut plain, scene, &format!("{recording:?}, {encoding:?}, frame {frame}"))?;
            }
            expect(executed > 5, || format!("only {executed} static groups were executed"))?;
        }
    }
    Ok(())
}

/// A grid of cubes of two meshes, opaque and blended ones, in which every five objects are a static group.
fn grid(side: usize) -> Result<Scene, Failed> {
    let mut scene = field(0);
    let meshes = [scene.add(cube())?, scene.add(square(Topology::TriangleStrip))?];
    let materials: Vec<_> = scene.assets().iter().map(|(handle, _)| handle).collect();
    for index in 0..side * side {
        let [x, z] = [index % side, index / side].map(|place| (place as f64 - side as f64 / 2.0) * 3.0);
        let object = RenderObject::new(meshes[index % 2], materials[index % materials.len()], DVec3::new(x, 0.0, z));
        scene.add_object(RenderObject { scale: Vec3::splat(0.6 + 0.1 * (index % 7) as f32), ..object })?;
    }
    let static_groups = (0..(side * side) as u32).step_by(5);
    scene.static_groups =
        static_groups.map(|first| StaticGroup::new(format!("from {first}"), (first..first + 5).collect())).collect();
    scene.cameras.iter_mut().for_each(|camera| camera.size = [64, 48]);
    Ok(scene)
}

/// Draws some frames in which cameras move and nothing changes. Returns how many static groups were executed.
fn steady<B: Backend>(
    with: &mut Painter<B>,
    plain: &mut Painter<B>,
    scene: &mut Scene,
    name: &str,
) -> Result<usize, Failed> {
    let mut executed = 0;
    for frame in 0..4 {
        scene.cameras.iter_mut().for_each(|camera| camera.position.x += 0.21);
        let still = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
        executed += with.compare(plain, still, &format!("{name}, frame {frame}"))?;
    }
    Ok(executed)
}

/// What a renderer may change between frames.
fn other_renderers() -> Result<(), Failed> {
    let mut scene = grid(15)?;
    let lights = std::mem::take(&mut scene.lights);
    let (mut with, mut plain) = (on_the_device(Ok)?, on_the_device(Ok)?);
    let mut executed = vec![("at first", steady(&mut with, &mut plain, &mut scene, "at first")?)];
    let balanced = Quality::balanced();
    let shadows = ShadowQuality { side: 64, ..balanced.shadows };
    for (name, quality) in [
        ("exact, ordered by depth", Quality { shadows, occlusion: None, ..Quality::exact() }),
        ("fast", Quality { shadows, occlusion: Some(16), ..Quality::fast() }),
        ("packed vertices", Quality { shadows, vertices: VertexFormat::Packed, ..balanced }),
        ("occlusion tests", Quality { shadows, occlusion: Some(8), ..balanced }),
        ("boxes", Quality { shadows, culling: CullingVolume::OrientedBox, occlusion: None, ..balanced }),
        ("no culling", Quality { shadows, culling: CullingVolume::None, occlusion: None, ..balanced }),
        ("a pre-pass", Quality { shadows, depth_pre_pass: true, occlusion: None, ..balanced }),
    ] {
        with.renderer.set_quality(quality)?;
        plain.renderer.set_quality(quality)?;
        executed.push((name, steady(&mut with, &mut plain, &mut scene, name)?));
    }
    scene.lights = lights;
    executed.push(("lights", steady(&mut with, &mut plain, &mut scene, "lights")?));
    scene.lights.push(Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true });
    executed.push(("a shadow", steady(&mut with, &mut plain, &mut scene, "a shadow")?));
    let formats = GeometryFormats { normal: Format::Rgba32Float, ..GeometryFormats::default() };
    for deferred in [deferred().formats(formats), deferred()] {
        with.renderer.set_pipeline(deferred.clone())?;
        plain.renderer.set_pipeline(deferred)?;
        executed.push(("formats", steady(&mut with, &mut plain, &mut scene, "formats")?));
    }
    with.submitter = with.renderer.replace_backend(backend()?);
    executed.push(("another backend", steady(&mut with, &mut plain, &mut scene, "another backend")?));
    with.renderer.forget_previous_frames();
    executed.push(("forgotten", steady(&mut with, &mut plain, &mut scene, "forgotten")?));
    // Where objects are ordered by depth, or tested for occlusion, all are drawn one by one.
    for (name, count) in executed {
        let tests_each = ["exact, ordered by depth", "fast", "occlusion tests"].contains(&name);
        expect((count == 0) == tests_each, || format!("{name}: {count} static groups are executed"))?;
    }
    let mut singly = on_the_device_with(Ok, |builder| builder.instancing(false))?;
    let count = steady(&mut singly, &mut plain, &mut scene, "without instancing")?;
    expect(count > 0, || "no static group is executed without instancing".to_owned())
}

/// A budget in which not all meshes have room. A static group is executed all the time, and draws what is there.
fn streamed() -> Result<(), Failed> {
    let mut scene = grid(10)?;
    scene.cameras.truncate(1);
    let meshes: Vec<_> = (0..40).map(|index| scene.add(disc(200 + 50 * index, 0.9))).collect::<Result<_, _>>()?;
    for (index, handle) in scene.objects().collect::<Vec<_>>().into_iter().enumerate() {
        let object = scene.object(handle)?;
        scene.replace_object(handle, RenderObject { mesh: meshes[index % meshes.len()], ..object })?;
    }
    let budget = StreamingBudget { upload_bytes_per_frame: 1 << 18, ..StreamingBudget::default() };
    let mut with = on_the_device(|wgpu| wgpu.stream_resources(budget))?;
    let mut plain = on_the_device(Ok)?;
    let camera = scene.cameras[0].clone();
    for (round, &changed) in meshes[..3].iter().enumerate() {
        // Looks away, and back.
        scene.cameras[0].orientation = Quat::from_rotation_y(PI) * camera.orientation;
        for _ in 0..3 {
            with.draw(SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() })?;
        }
        scene.cameras[0].orientation = camera.orientation;
        let mut is_complete = false;
        for _ in 0..300 {
            let recorded = with.renderer.record(SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() })?;
            is_complete = recorded.statistics().scene_issues.is_empty();
            with.submitter.submit(recorded)?;
            if is_complete {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        expect(is_complete, || format!("round {round}: the scene never is on the device"))?;
        let executed = steady(&mut with, &mut plain, &mut scene, &format!("round {round}"))?;
        expect(executed > 0, || "no static group is executed".to_owned())?;
        scene.replace(changed, disc(90, 0.5))?;
    }
    Ok(())
}

/// Static groups that reach through the far planes of all kinds of views, and before the near plane of a shadow map.
fn far_planes() -> Result<(), Failed> {
    let mut scene = grid(25)?;
    let towers = scene.as_scene_ref().meshes[0];
    let material = scene.as_scene_ref().materials[0];
    let first = scene.as_scene_ref().object_count() as u32;
    // A static group from deep below the ground to high above it.
    for height in -40..40 {
        scene.add_object(RenderObject::new(towers, material, DVec3::new(1.5, f64::from(height) * 4.0, 0.0)))?;
    }
    scene.static_groups.push(StaticGroup::new("tower", (first..first + 80).collect()));
    scene.lights = vec![
        Light::Directional {
            direction: Vec3::new(0.3, -0.8, -0.5).normalize(),
            illuminance: Vec3::ONE,
            casts_shadow: true,
        },
        Light::Point { position: DVec3::Y * 4.0, intensity: Vec3::splat(40.0), range: 9.0, casts_shadow: true },
        Light::Spot {
            position: DVec3::new(-6.0, 8.0, 4.0),
            direction: Vec3::new(0.4, -0.8, -0.2).normalize(),
            intensity: Vec3::splat(60.0),
            range: 14.0,
            inner_angle: 0.3,
            outer_angle: 0.7,
            casts_shadow: true,
        },
        Light::Hemispherical {
            position: DVec3::new(5.0, 3.0, -6.0),
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(20.0),
            range: 10.0,
            casts_shadow: true,
        },
    ];
    scene.cameras.truncate(1);
    let camera = scene.cameras[0].clone();
    let (mut with, mut plain) = (on_the_device(Ok)?, on_the_device(Ok)?);
    let orthographic = Projection::Orthographic { height: 20.0 };
    let mut all = 0;
    for (name, camera) in [
        ("infinite", camera.clone()),
        ("perspective", Camera { far: 30.0, ..camera.clone() }),
        ("near", Camera { far: 12.0, ..camera.clone() }),
        ("orthographic", Camera { far: 30.0, projection: orthographic, ..camera.clone() }),
    ] {
        scene.cameras[0] = camera;
        all += steady(&mut with, &mut plain, &mut scene, name)?;
    }
    expect(all > 100, || format!("only {all} static groups were executed"))
}
