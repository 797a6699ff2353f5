//! Many small contributions of light add up.

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec2, Vec3};
use drawloom::process::{
    Declare, Deferred, Deformation, Draws, GeometryFormats, InjectionPoint, LightVolumes, RenderProcess,
};
use drawloom::quality::{DiffuseFormat, NormalFormat, Quality, RadianceSum};
use drawloom::scene::{
    Blend, Camera, LayerMask, Light, LightKind, Material, Projection, RenderObject, Scene, SceneRef, Topology, ViewKind,
};
use drawloom::view::IssueReason;
use drawloom::view::LightClass;
use drawloom_testing::adapter;
use drawloom_testing::light_sums::{SUMS, SumScene, blended_scenes, light_scenes, quality};
use drawloom_testing::scenes::everything::{class_of, everything};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};

pub const CASES: &[Case] = &[
    ("lights_add_up_within_the_bounds_of_their_sum", lights),
    ("blended_objects_add_up_within_the_bounds_of_their_sum", blended_objects),
    ("exact_keeps_a_thousandth_of_every_sum_of_lights", exact),
    ("devices_that_do_not_blend_floats_lose_no_light_and_are_named", without_float_blending),
    ("transparency_of_the_engines_own_lacks_no_float_blending", own_without_float_blending),
    ("a_sum_has_the_lights_of_every_class_and_camera", every_class),
    ("a_shader_sums_the_lights_of_every_tile_of_pictures_of_any_size", tiles),
    ("a_process_of_lights_that_is_replaced_adds_to_the_sum_of_the_others", replaced),
    ("a_process_of_lights_that_is_left_out_is_not_in_the_sum", left_out),
    ("a_sum_that_is_kept_changes_nothing", kept),
    ("what_a_mirror_shows_is_summed_too", mirrored),
    ("deformed_panes_are_in_the_sum_of_the_others", deformed),
];

fn fixture(sum: RadianceSum, deferred: Deferred) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.pipeline(deferred).quality(quality(sum)))
}

fn drawn(fixture: &mut Fixture, scene: &Scene, view: usize) -> Result<Vec<[f64; 3]>, Failed> {
    let recorded = fixture.record(scene)?;
    radiance(&fixture.submit(recorded)?, view)
}

fn expect_below(bound: f64, error: f64, context: &str) -> Result<(), Failed> {
    if error <= bound { Ok(()) } else { Err(format!("{context}: an error of {error}, not {bound} at most").into()) }
}

fn expect_sums(scenes: &[SumScene]) -> Result<(), Failed> {
    for sum in SUMS {
        let mut fixture = fixture(sum, Deferred::new())?;
        for scene in scenes {
            let error = scene.error(&drawn(&mut fixture, &scene.scene, 0)?);
            expect_below(scene.bound(sum), error, &format!("{} | {sum:?}", scene.name))?;
            if sum == RadianceSum::Shader {
                expect_below(1e-3, error, &format!("{}, as exact promises", scene.name))?;
            }
        }
    }
    Ok(())
}

fn lights() -> Result<(), Failed> {
    expect_sums(&light_scenes())
}

fn blended_objects() -> Result<(), Failed> {
    expect_sums(&blended_scenes())
}

fn exact() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(Deferred::new()).quality(Quality::exact()))?;
    for scene in light_scenes().iter().filter(|scene| !scene.name.contains("shadowed") && scene.lights >= 100) {
        let error = scene.error(&drawn(&mut fixture, &scene.scene, 0)?);
        expect_below(1e-3, error, &scene.name)?;
    }
    Ok(())
}

fn without_float_blending() -> Result<(), Failed> {
    for sum in [RadianceSum::Float, RadianceSum::Shader] {
        let device = adapter::device_without(WgpuBackend::BLENDING_FEATURES).map_err(|error| error.to_string())?;
        let mut fixture = Fixture::on(device, 2, |builder| builder.pipeline(Deferred::new()).quality(quality(sum)))?;
        for scene in
            light_scenes().iter().chain(&blended_scenes()).filter(|scene| scene.lights.max(scene.objects) <= 100)
        {
            let recorded = fixture.record(&scene.scene)?;
            let reported = recorded.statistics().scene_issues.iter().map(|issue| issue.reason);
            let reported: Vec<_> = reported.collect();
            let expected = if scene.objects == 0 { &[][..] } else { &[IssueReason::HalfFloatBlending] };
            if reported != expected {
                return Err(format!("{sum:?}: {}: {reported:?}", scene.name).into());
            }
            // Of a pane that lights shine on, the shader sums these one by one.
            let in_half_floats = RadianceSum::HalfFloat.max_blended_error(scene.objects);
            let bound = scene.bound(RadianceSum::Shader) + in_half_floats;
            let error = scene.error(&radiance(&fixture.submit(recorded)?, 0)?);
            expect_below(bound, error, &format!("{sum:?} without the feature: {}", scene.name))?;
        }
    }
    Ok(())
}

/// No device would sum what the engine draws itself or leaves out.
fn own_without_float_blending() -> Result<(), Failed> {
    let scenes = blended_scenes();
    let scene = scenes.iter().find(|scene| scene.objects > 0).ok_or("no scene has blended objects")?;
    let own = || drawloom::process::Transparency::new(None);
    for (name, deferred, is_counted) in [
        ("shipped", Deferred::new(), true),
        ("replaced", Deferred::new().replace("transparency", own()), false),
        ("deformed and replaced", Deferred::new().deformation(Still).replace("transparency", own()), false),
        ("left out", Deferred::new().leave_out("transparency"), false),
    ] {
        let device = adapter::device_without(WgpuBackend::BLENDING_FEATURES).map_err(|error| error.to_string())?;
        let build = |builder: drawloom::RendererBuilder<WgpuBackend>| {
            builder.pipeline(deferred).quality(quality(RadianceSum::Float))
        };
        let recorded = Fixture::on(device, 2, build)?.record(&scene.scene)?;
        let mut scene_issues = recorded.statistics().scene_issues.iter();
        if scene_issues.any(|issue| issue.reason == IssueReason::HalfFloatBlending) != is_counted {
            return Err(format!("{name}: {:?}", recorded.statistics().scene_issues).into());
        }
    }
    Ok(())
}

/// In a scene with all kinds of lights, with and without shadows, and all kinds of panes. What all these would add is a
/// bound of what each of them adds.
fn every_class() -> Result<(), Failed> {
    let [mut scene, mut all_added] = [(); 2].map(|()| everything());
    let camera = scene.cameras[0].clone();
    scene.cameras.push(Camera { projection: Projection::Orthographic { height: 9.0 }, far: 50.0, ..camera });
    all_added.cameras.clone_from(&scene.cameras);
    let materials: Vec<_> = all_added.assets().iter::<Material>().map(|(handle, one)| (handle, one.clone())).collect();
    for (handle, material) in materials.into_iter().filter(|(_, material)| material.blend != Blend::None) {
        all_added.replace(handle, Material { blend: Blend::Additive, ..material })?;
    }
    let (lights, panes) = (scene.lights.len() as u32, 3);
    let draw = |sum, scene: &Scene| -> Result<Vec<Vec<[f64; 3]>>, Failed> {
        let mut fixture = fixture(sum, Deferred::new())?;
        let recorded = fixture.record(scene)?;
        let submission = fixture.submit(recorded)?;
        (0..2).map(|view| radiance(&submission, view)).collect()
    };
    let (magnitudes, expected) = (draw(RadianceSum::HalfFloat, &all_added)?, draw(RadianceSum::HalfFloat, &scene)?);
    for sum in [RadianceSum::Float, RadianceSum::Shader] {
        let found = draw(sum, &scene)?;
        let error_of = |sum: RadianceSum| sum.max_light_error(lights) + sum.max_blended_error(panes);
        let bound = error_of(sum) + error_of(RadianceSum::HalfFloat);
        for view in 0..2 {
            let [found, expected, magnitude] = [&found, &expected, &magnitudes].map(|drawn| drawn[view].as_flattened());
            let pixels = found.iter().zip(expected).zip(magnitude);
            // The magnitude has the error of half floats itself.
            let errors =
                pixels.map(|((found, expected), magnitude)| (found - expected).abs() / (magnitude * 1.1 + 1e-9));
            expect_below(bound, errors.fold(0.0, f64::max), &format!("{sum:?}, view {view}"))?;
            if found.iter().all(|channel| *channel < 0.05) {
                return Err("it is dark".into());
            }
        }
    }
    Ok(())
}

/// Small lights all over a floor, more than a tile has bits. A sum that misses one differs from the one that draws each
/// in its volume by a whole light.
fn tiles() -> Result<(), Failed> {
    let (columns, rows) = (130_u32, 60_u32);
    let mut scene = Scene::new();
    let mesh = scene.add(square(Topology::TriangleList))?;
    let material = scene.add(Material { diffuse: Vec3::ONE, ..Material::default() })?;
    scene.add_object(RenderObject { scale: Vec3::splat(80.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
    for light in 0..columns * rows {
        let [x, y] = [light % columns, light / columns].map(|cell| f64::from(cell) * 0.5);
        let position = DVec3::new(x - 32.0, y - 15.0, 0.5);
        scene.lights.push(Light::Point { position, intensity: Vec3::ONE, range: 1.5, casts_shadow: false });
    }
    let across = Camera::looking_at("main", DVec3::new(3.0, -20.0, 9.0), DVec3::new(0.0, -5.0, 0.0));
    let flat = Projection::Orthographic { height: 30.0 };
    let above = Camera { projection: flat, far: 90.0, ..Camera::looking_at("main", DVec3::Z * 40.0, DVec3::ZERO) };
    let shifted = Camera { shift: Vec2::new(0.4, -0.7), ..across.clone() };
    let mut one_by_one = fixture(RadianceSum::Float, Deferred::new())?;
    let mut in_shader = fixture(RadianceSum::Shader, Deferred::new())?;
    for size in [[1, 1], [2, 31], [33, 3], [64, 64], [131, 70]] {
        for camera in [&across, &above, &shifted] {
            scene.cameras = vec![sized(camera.clone(), size)];
            let (expected, found) = (drawn(&mut one_by_one, &scene, 0)?, drawn(&mut in_shader, &scene, 0)?);
            // No pixel has more than 49 lights: those of a square of 3 m.
            let bound = RadianceSum::Float.max_light_error(49) + RadianceSum::Shader.max_light_error(49);
            let pairs = found.as_flattened().iter().zip(expected.as_flattened());
            // A half float has steps of 2⁻²⁴ at least.
            let errors =
                pairs.map(|(found, expected)| ((found - expected).abs() - 2_f64.powi(-23)) / expected.max(1e-9));
            expect_below(bound, errors.fold(0.0, f64::max), &format!("{size:?}, {:?}", camera.projection))?;
            if expected.iter().all(|pixel| pixel[0] == 0.0) {
                return Err(format!("{size:?} is dark").into());
            }
        }
    }
    Ok(())
}

/// Lights of every class, and their sum.
fn lights_of_every_class() -> Result<SumScene, Failed> {
    light_scenes().into_iter().find(|scene| scene.name == "lights of every class").ok_or("there is none".into())
}

fn replaced() -> Result<(), Failed> {
    let scene = lights_of_every_class()?;
    let (normal, diffuse) = (NormalFormat::Octahedral16.into(), DiffuseFormat::HalfFloat.into());
    let formats = GeometryFormats { normal, diffuse, ..GeometryFormats::default() };
    for sum in SUMS {
        let own = LightVolumes::new(LightKind::Point, formats);
        let mut fixture = fixture(sum, Deferred::new().replace("point lights", own))?;
        let error = scene.error(&drawn(&mut fixture, &scene.scene, 0)?);
        // Eight lights are added one by one, and then the sum of the others.
        let bound = scene.bound(sum) + RadianceSum::HalfFloat.max_light_error(9);
        expect_below(bound, error, &format!("{sum:?} beside a process of the engine's"))?;
    }
    Ok(())
}

fn left_out() -> Result<(), Failed> {
    let [scene, mut without] = [lights_of_every_class()?.scene, lights_of_every_class()?.scene];
    for sum in SUMS {
        let mut whole = fixture(sum, Deferred::new())?;
        for (kind, shadowed) in [(LightKind::Point, false), (LightKind::Spot, true), (LightKind::Directional, false)] {
            let class = LightClass { kind, shadowed };
            without.lights.clone_from(&scene.lights);
            without.lights.retain(|light| class_of(light) != class);
            let name = LightVolumes::name_of(class);
            let found = drawn(&mut fixture(sum, Deferred::new().leave_out(&name))?, &scene, 0)?;
            if found != drawn(&mut whole, &without, 0)? {
                return Err(format!("{sum:?} without {name}").into());
            }
        }
    }
    Ok(())
}

fn kept() -> Result<(), Failed> {
    let mut scene = everything();
    scene.lights.retain(|light| matches!(light, Light::Spot { .. }));
    for sum in [RadianceSum::Float, RadianceSum::Shader] {
        let kept = Deferred::new().keep("sum of lights").keep("sum of blended objects");
        let (mut kept, mut plain) = (fixture(sum, kept)?, fixture(sum, Deferred::new())?);
        if drawn(&mut kept, &scene, 0)? != drawn(&mut plain, &scene, 0)? {
            return Err(format!("{sum:?}: it changes").into());
        }
        let mut dark = Scene::new();
        dark.cameras = scene.cameras.clone();
        if drawn(&mut kept, &dark, 0)? != drawn(&mut plain, &dark, 0)? {
            return Err(format!("{sum:?}: the dark changes").into());
        }
        let names = |fixture: &Fixture| {
            let processes = fixture.renderer.plan().processes().iter().map(|planned| planned.name.clone());
            processes.filter(|name| name.starts_with("sum of")).collect::<Vec<_>>()
        };
        if names(&kept) != ["sum of lights", "sum of blended objects"] || !names(&plain).is_empty() {
            return Err(format!("{sum:?}: {:?} {:?}", names(&kept), names(&plain)).into());
        }
    }
    Ok(())
}

/// Shows what a mirror's view shows.
struct Shown;

impl RenderProcess for Shown {
    fn name(&self) -> &str {
        "shown"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples_view(ViewKind::Reflection, "mirror", "radiance");
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(drawloom::process::FullScreen {
            shader: "
                @group(2) @binding(1) var mirror: texture_2d<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    return textureLoad(mirror, vec2<i32>(in.position.xy), 0);
                }
            ",
            ..Default::default()
        })
    }
}

fn mirrored() -> Result<(), Failed> {
    for mut scene in light_scenes().into_iter().filter(|scene| scene.lights == 100) {
        let camera = scene.scene.cameras[0].clone();
        let aside = Camera::looking_at("main", DVec3::Z * 2.0, DVec3::Z * 4.0);
        let size = camera.size;
        let mirror = Camera { kind: ViewKind::Reflection, name: "mirror".into(), ..camera };
        scene.scene.cameras = vec![Camera { size, ..aside }, mirror];
        for sum in SUMS {
            let build = |builder: drawloom::RendererBuilder<WgpuBackend>| {
                builder.pipeline(Deferred::new()).quality(quality(sum)).process(Shown)
            };
            let mut fixture = Fixture::with(2, build)?;
            let error = scene.error(&drawn(&mut fixture, &scene.scene, 0)?);
            expect_below(scene.bound(sum), error, &format!("{} in a mirror, {sum:?}", scene.name))?;
        }
    }
    Ok(())
}

/// Does not change its objects.
struct Still;

const STILL: LayerMask = LayerMask::layer(3);

impl Deformation for Still {
    fn name(&self) -> &str {
        "still"
    }

    fn layers(&self) -> LayerMask {
        STILL
    }

    fn declare(&self, _: &mut Declare) {}

    fn shader(&self) -> &str {
        "fn deform(in: VertexInput, object: Object) -> VertexInput { return in; }"
    }
}

fn deformed() -> Result<(), Failed> {
    let scenes = blended_scenes().into_iter().filter(|scene| scene.objects == 100 && !scene.name.contains("Alpha"));
    for scene in scenes {
        let count = scene.scene.as_scene_ref().object_count();
        let layers: Vec<_> =
            (0..count).map(|object| if object % 3 == 1 { STILL } else { LayerMask::layer(1) }).collect();
        let draw = |sum, deferred: Deferred| -> Result<f64, Failed> {
            let mut fixture = fixture(sum, deferred.deformation(Still))?;
            let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.scene.as_scene_ref() })?;
            Ok(scene.error(&radiance(&fixture.submit(recorded)?, 0)?))
        };
        for sum in SUMS {
            let error = draw(sum, Deferred::new())?;
            expect_below(scene.bound(sum), error, &format!("{}, some deformed, {sum:?}", scene.name))?;
            // An engine's transparency draws over radiance, and so do the others then.
            let own = drawloom::process::Transparency::new(None);
            let error = draw(sum, Deferred::new().replace("transparency", own))?;
            let bound = scene.bound(RadianceSum::HalfFloat);
            expect_below(bound, error, &format!("{}, some replaced, {sum:?}", scene.name))?;
        }
    }
    Ok(())
}
