//! Pipelines of an engine's own, and processes that come and go beside one.

#[path = "../../examples/forward/pipeline.rs"]
mod forward;

use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, FullScreen, InjectionPoint, LightTiles, RenderProcess,
    ToneMapping, lighting_shader, targets,
};
use drawloom::scene::{Blend, Camera, Light, Material, MaterialType, RenderObject, Scene, ViewKind};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, field, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::history::Accumulate;
use crate::image_distance::{Distance, as_image, assert_color, tone_mapped};
use forward::Forward;

pub const CASES: &[Case] = &[
    ("a_forward_pipeline_draws_what_the_deferred_one_draws", forward_and_deferred),
    ("surfaces_of_the_engines_own_have_the_light_and_shadows_of_shipped_ones", lit_surfaces),
    ("a_forward_pipeline_has_the_processes_that_its_lamps_require", forward_processes),
    ("a_target_of_reflections_is_sampled_with_and_without_a_mirror", own_reflection),
    ("a_process_that_comes_and_goes_leaves_histories_and_pipelines_of_others", comes_and_goes),
];

/// Boxes of stone and of glass, with this many lamps.
fn boxes(lamps: usize) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    let stone = Material { diffuse: Vec3::new(0.7, 0.6, 0.5), emission: Vec3::splat(0.05), ..Material::default() };
    let glass = Material { diffuse: Vec3::new(0.2, 0.5, 0.9), opacity: 0.5, blend: Blend::Alpha, ..stone.clone() };
    let (stone, glass) = (scene.add(stone)?, scene.add(glass)?);
    for index in 0..25 {
        let (x, z) = (f64::from(index % 5) - 2.0, f64::from(index / 5) - 2.0);
        let material = if index % 6 == 0 { glass } else { stone };
        let mut object = RenderObject::new(mesh, material, DVec3::new(x * 1.5, 0.0, z * 1.5));
        object.scale = Vec3::splat(0.6);
        scene.add_object(object)?;
    }
    scene.ambient = Vec3::splat(0.2);
    scene.background = Vec3::new(0.1, 0.15, 0.2);
    scene.cameras.push(sized(Camera::looking_at("main", DVec3::new(0.5, 4.0, 7.0), DVec3::ZERO), [96, 64]));
    scene.lights = (0..lamps).map(lamp).collect();
    Ok(scene)
}

fn lamp(index: usize) -> Light {
    let angle = index as f64 * 2.4;
    let position = DVec3::new(3.0 * angle.cos(), 1.5, 3.0 * angle.sin());
    Light::Point { position, intensity: Vec3::new(2.0, 1.5, 1.0), range: 6.0, casts_shadow: false }
}

fn forward_and_deferred() -> Result<(), Failed> {
    let mut forward = Fixture::with(2, |builder| builder.pipeline(Forward))?;
    let mut deferred = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()))?;
    let mut pictures = Vec::new();
    for lamps in [0, 3, 5, 17, 0] {
        let scene = boxes(lamps)?;
        let (one, other) = (as_image(&forward.draw(&scene)?)?, as_image(&deferred.draw(&scene)?)?);
        let distance = Distance::between(&one, &other)?;
        if !distance.is_within_bound() {
            return Err(format!("{lamps} lamps: {distance:?}").into());
        }
        pictures.push(one);
    }
    // The lamps are seen, and the first picture is that of a scene without them.
    assert!(!Distance::between(&pictures[0], &pictures[3])?.is_within_bound());
    assert!(pictures[0] == pictures[4]);
    Ok(())
}

/// Surfaces that a process of the engine's own lights in one pass.
const CLAY: MaterialType<[f32; 4]> = MaterialType::new("clay");

struct Clay {
    shader: String,
    has_tiles: bool,
}

impl Clay {
    fn new(maps: &ShadowMaps, has_tiles: bool) -> Self {
        let own = "
            @group(3) @binding(0) var<storage, read> clays: array<vec4<f32>>;

            struct Corner {
                @builtin(position) clip: vec4<f32>,
                @location(0) relative: vec3<f32>,
                @location(1) normal: vec3<f32>,
                @location(2) @interpolate(flat) material: u32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                let relative = relative_position(object, in.position);
                return Corner(clip_position(relative), relative, world_normal(object, in.normal), object.material);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                let illuminance = view.ambient * PI + ILLUMINANCE;
                return vec4<f32>(clays[in.material].rgb / PI * illuminance, 1.0);
            }
        ";
        let (lighting, illuminance) = match has_tiles {
            false => (lighting_shader(Some((1, maps))), "illuminance_at(in.relative, normalize(in.normal))"),
            true => (
                LightTiles::lighting_shader(1, Some((2, maps))),
                "illuminance_in_tile(vec2<u32>(in.clip.xy), in.relative, normalize(in.normal))",
            ),
        };
        Self { shader: [lighting, own.replace("ILLUMINANCE", illuminance)].concat(), has_tiles }
    }
}

impl RenderProcess for Clay {
    fn name(&self) -> &str {
        "clay"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        if self.has_tiles {
            declare.samples(LightTiles::TARGET);
        }
        declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        declare.draws_over(targets::RADIANCE);
        declare.draws_depth(targets::DEPTH);
        declare.reads_materials(CLAY);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: Selection::OPAQUE.of_material_type(CLAY),
            ..CommandDraws::default()
        })
    }
}

fn lit_surfaces() -> Result<(), Failed> {
    let (position, casts_shadow, range) = (DVec3::new(1.0, 3.0, 1.5), true, 20.0);
    let (direction, intensity) = (Vec3::new(-0.4, -1.0, -0.3).normalize(), Vec3::splat(12.0));
    let lights = [
        Light::Point { position, intensity, range, casts_shadow },
        Light::Spot { position, direction, intensity, range, inner_angle: 0.4, outer_angle: 0.6, casts_shadow },
        Light::Directional { direction, illuminance: Vec3::ONE, casts_shadow },
        Light::Hemispherical { position, direction, intensity, range, casts_shadow },
    ];
    let maps = ShadowMaps { side: 512, cascades: 3, max_distance: 20.0, ..ShadowMaps::default() };
    let deferred = || Deferred::to_picture().shadow_maps(Some(maps));
    // One of each kind, all of them, and none.
    let mut scenes: Vec<Vec<Light>> = lights.iter().map(|light| vec![*light]).collect();
    scenes.extend([lights.to_vec(), Vec::new()]);
    // Small ones too, each of which reaches some tiles.
    let small = |index: i32| {
        let position = DVec3::new(f64::from(index % 20) * 0.4 - 4.0, -0.8, f64::from(index / 20) * 0.8 - 4.0);
        let intensity = Vec3::new(0.1, 0.02 * (index % 5) as f32, 0.02);
        Light::Point { position, intensity, range: 0.7, casts_shadow: false }
    };
    scenes.push(lights.iter().cloned().chain((0..200).map(small)).collect());
    for lights in scenes {
        let mut scene = boxes(0)?;
        let floor = scene.add(Material { diffuse: Vec3::splat(0.6), ..Material::default() })?;
        let mesh = scene.assets().iter::<drawloom::scene::Mesh>().map(|(handle, _)| handle).next();
        let mesh = mesh.ok_or("there is no mesh")?;
        let object = RenderObject::new(mesh, floor, DVec3::NEG_Y * 1.5);
        scene.add_object(RenderObject { scale: Vec3::new(20.0, 0.5, 20.0), ..object })?;
        scene.lights = lights.clone();
        let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, one)| (handle, one.clone())).collect();
        for (handle, material) in &materials {
            scene.replace(*handle, Material { blend: Blend::None, emission: Vec3::ZERO, ..material.clone() })?;
        }
        let mut shipped = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
        let expected = as_image(&shipped.draw(&scene)?)?;
        for (handle, material) in materials {
            let values = Some(CLAY.values(material.diffuse.extend(1.0).to_array()));
            scene.replace(handle, Material { blend: Blend::None, values, ..material })?;
        }
        let clay = |has_tiles| Clay::new(&maps, has_tiles);
        let mut own = Fixture::with(2, |builder| builder.pipeline(deferred()).process(clay(false)))?;
        let found = own.draw(&scene)?;
        let distance = Distance::between(&as_image(&found)?, &expected)?;
        if !distance.is_within_bound() {
            return Err(format!("{lights:?}: {distance:?}").into());
        }
        // A tile leaves out lights that add nothing.
        let mut tiled =
            Fixture::with(2, |builder| builder.pipeline(deferred()).process(LightTiles).process(clay(true)))?;
        if tiled.draw(&scene)? != found {
            return Err(format!("{lights:?} in tiles").into());
        }
    }
    Ok(())
}

fn forward_processes() -> Result<(), Failed> {
    let mut fixture = Fixture::with(1, |builder| builder.pipeline(Forward))?;
    let (lit, blended) = ("opaque surfaces", "blended surfaces");
    for (lamps, expected) in [
        (0, &[lit, blended, "tone mapping"][..]),
        (4, &[lit, blended, "tone mapping"]),
        (5, &["depth pre-pass", lit, blended, "tone mapping"]),
        (40, &["depth pre-pass", lit, blended, "tone mapping"]),
    ] {
        drop(fixture.record(&boxes(lamps)?)?);
        let plan = fixture.renderer.plan();
        let found: Vec<_> = plan.processes().iter().map(|planned| planned.name.as_str()).collect();
        assert_eq!(found, expected, "{lamps} lamps");
    }
    // One for each step; none and four lamps have plans of their own, with equal processes.
    let plans = fixture.renderer.plan_count();
    for lamps in 0..60 {
        drop(fixture.record(&boxes(lamps)?)?);
    }
    assert_eq!(fixture.renderer.plan_count(), forward::STEPS.len() + 1, "{plans} before");
    Ok(())
}

/// Draws numbers in reflections, in a format that no other target has.
struct Numbers;

impl RenderProcess for Numbers {
    fn name(&self) -> &str {
        "numbers"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Reflection);
        declare.clears_color("numbers", Format::R32Uint, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<u32> {
                return vec4<u32>(128u, 0u, 0u, 0u);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// Shows the numbers of the view `mirror` in green.
struct Screen {
    target: &'static str,
}

impl RenderProcess for Screen {
    fn name(&self) -> &str {
        "screen"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.after("numbers");
        declare.samples_view(ViewKind::Reflection, "mirror", "numbers");
        if self.target == "radiance" {
            declare.at(InjectionPoint::AfterLighting);
            declare.draws_over(self.target);
        } else {
            declare.clears_color(self.target, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var numbers: texture_2d<u32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let last = textureDimensions(numbers) - vec2<u32>(1u);
                let number = textureLoad(numbers, min(vec2<u32>(in.position.xy), last), 0).r;
                return vec4<f32>(0.0, f32(number) / 256.0, 0.0, 1.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn own_reflection() -> Result<(), Failed> {
    let without = boxes(0)?;
    let mut with = boxes(0)?;
    let mirror = Camera { kind: ViewKind::Reflection, ..with.cameras[0].clone() };
    with.cameras.push(Camera { name: "mirror".into(), ..mirror });
    let beside = Fixture::with(2, |builder| {
        builder.pipeline(Deferred::to_picture()).process(Numbers).process(Screen { target: "radiance" })
    })?;
    let alone = Fixture::with(2, |builder| {
        let tone_mapping = drawloom::process::PostStep::process(&ToneMapping::default(), "own", "picture");
        builder.process(Numbers).process(Screen { target: "own" }).process(tone_mapping).output("picture")
    })?;
    for mut fixture in [beside, alone] {
        for _ in 0..2 {
            assert_color(pixel(&fixture.draw(&without)?, 40, 30), tone_mapped([0.0; 3]))?;
            assert_color(pixel(&fixture.draw(&with)?, 40, 30), tone_mapped([0.0, 0.5, 0.0]))?;
        }
        fixture.renderer.prepare_pipelines(without.as_scene_ref())?;
    }
    Ok(())
}

/// Darkens the picture.
struct Shade;

impl RenderProcess for Shade {
    fn name(&self) -> &str {
        "shade"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(0.0, 0.0, 0.0, 0.5);
            }
        ";
        Draws::FullScreen(FullScreen { shader, blend: Blend::Alpha, ..FullScreen::default() })
    }
}

fn comes_and_goes() -> Result<(), Failed> {
    let mut scene = field(10);
    scene.cameras.truncate(1);
    let mut fixture =
        Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).process(Accumulate).output("sum"))?;
    let (mut pictures, mut pipelines) = (Vec::new(), Vec::new());
    let mut sum = |fixture: &mut Fixture, frames: u8| -> Result<(), Failed> {
        let recorded = fixture.record(&scene)?;
        let submission = fixture.submit(recorded)?;
        pipelines.push(fixture.renderer.backend().resources().pipelines);
        pictures.push(submission.read(0, "picture")?.bytes);
        assert_color(pixel(&submission.read(0, "sum")?, 5, 5), [32 * frames, if frames > 1 { 255 } else { 0 }, 0])
    };
    sum(&mut fixture, 1)?;
    fixture.renderer.add_process(Shade)?;
    sum(&mut fixture, 2)?;
    fixture.renderer.set_process_enabled("shade", false)?;
    sum(&mut fixture, 3)?;
    fixture.renderer.set_process_enabled("shade", true)?;
    sum(&mut fixture, 4)?;
    fixture.renderer.remove_process("shade")?;
    sum(&mut fixture, 5)?;
    let same_as_first: Vec<_> = pictures.iter().map(|picture| *picture == pictures[0]).collect();
    assert_eq!(same_as_first, [true, false, true, false, true]);
    assert!(pictures[1] == pictures[3]);
    assert_eq!(pipelines, [0, 1, 0, 1, 0].map(|of_shade| pipelines[0] + of_shade));
    Ok(())
}
