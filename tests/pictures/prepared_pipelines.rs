//! Shaders that are compiled, and pipelines that are made, before the first frame.

use drawloom::RendererBuilder;
use drawloom::backend::WgpuBackend;
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::{Blend, LightKind, Material, Scene};
use drawloom::view::LightClass;
use drawloom_testing::scenes::everything::{class_of, everything, glasses};
use drawloom_testing::scenes::{cube, field};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("a_first_frame_makes_no_pipelines_that_were_prepared", first_frame),
    ("lights_and_glass_come_and_go_without_new_pipelines_once_these_are_prepared", requirements),
    ("pipelines_that_are_prepared_in_the_background_are_those_of_frames", in_the_background),
    ("preparing_pipelines_finds_what_is_wrong_with_a_shader", wrong_shader),
];

fn shipped(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.pipeline(Deferred::to_picture())
}

/// The materials of a field and a mask, without mirrored objects, whose pipelines are made when they are first drawn.
fn scene() -> Result<Scene, Failed> {
    let mut scene = field(0);
    let mesh = scene.add(cube())?;
    scene.add(Material { alpha_cutoff: Some(0.5), ..Material::default() })?;
    let materials: Vec<_> = scene.as_scene_ref().assets.iter::<Material>().map(|(handle, _)| handle).collect();
    for (index, material) in materials.into_iter().enumerate() {
        let position = drawloom::glam::DVec3::X * (index as f64 * 2.5 - 5.0);
        scene.add_object(drawloom::scene::RenderObject::new(mesh, material, position))?;
    }
    Ok(scene)
}

fn first_frame() -> Result<(), Failed> {
    let scene = scene()?;
    let count = |fixture: &Fixture| fixture.renderer.backend().resources().pipelines;
    let (mut prepared, mut usual) = (Fixture::with(2, shipped)?, Fixture::with(2, shipped)?);
    prepared.renderer.prepare_pipelines(scene.as_scene_ref())?;
    let before = count(&prepared);
    if prepared.draw(&scene)? != usual.draw(&scene)? {
        return Err("prepared pipelines draw another picture".into());
    }
    if before == 0 || count(&prepared) != before || count(&usual) > before {
        return Err(format!("{before} pipelines, {} after a frame, {} usually", count(&prepared), count(&usual)).into());
    }
    Ok(())
}

fn requirements() -> Result<(), Failed> {
    let mut scene = scene()?;
    scene.lights = everything().lights;
    let mut fixture = Fixture::with(2, shipped)?;
    fixture.renderer.prepare_pipelines(scene.as_scene_ref())?;
    let count = |fixture: &Fixture| fixture.renderer.backend().resources().pipelines;
    let (prepared, lights, glasses) = (count(&fixture), scene.lights.clone(), glasses(&scene));
    let without = |is_absent: fn(LightClass) -> bool| {
        let lights = lights.iter().copied().filter(move |light| !is_absent(class_of(light)));
        lights.collect::<Vec<_>>()
    };
    let hemispherical = without(|class| class.shadowed && class.kind == LightKind::Hemispherical);
    for lights in [lights.clone(), hemispherical, without(|class| class.shadowed), Vec::new()] {
        for has_glass in [true, false] {
            scene.lights.clone_from(&lights);
            for (handle, glass) in &glasses {
                let blend = if has_glass { glass.blend } else { Blend::None };
                scene.replace(*handle, Material { blend, ..glass.clone() })?;
            }
            fixture.draw(&scene)?;
            if count(&fixture) != prepared {
                let lights = lights.len();
                return Err(format!("{prepared} pipelines, {} with {lights} lights", count(&fixture)).into());
            }
        }
    }
    Ok(())
}

/// Frames of a bare scene go on while a job makes the pipelines of everything.
fn in_the_background() -> Result<(), Failed> {
    let (scene, bare) = (scene()?, field(0));
    let count = |fixture: &Fixture| fixture.renderer.backend().resources().pipelines;
    let mut fixture = Fixture::with(2, shipped)?;
    let before = fixture.draw(&bare)?;
    let of_bare = count(&fixture);
    let preparation = fixture.renderer.prepare_pipelines_in_background(scene.as_scene_ref())?;
    while !preparation.is_finished() {
        if fixture.draw(&bare)? != before {
            return Err("a frame differs while pipelines are prepared".into());
        }
    }
    preparation.wait()??;
    let prepared = count(&fixture);
    let picture = fixture.draw(&scene)?;
    if prepared <= of_bare || count(&fixture) != prepared {
        return Err(format!("{of_bare} pipelines, {prepared} prepared, {} after a frame", count(&fixture)).into());
    }
    if picture != Fixture::with(2, shipped)?.draw(&scene)? {
        return Err("prepared pipelines draw another picture".into());
    }
    Ok(())
}

/// A process that no frame has drawn yet, with a mistake in its second line.
struct Wrong;

impl RenderProcess for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("wrong", Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment\nfn fragment() -> @location(0) vec4<f32> { return missing; }";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn wrong_shader() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| shipped(builder).process(Wrong))?;
    let error = fixture.renderer.prepare_pipelines(scene()?.as_scene_ref()).err().ok_or("it is compiled")?;
    let in_background = fixture.renderer.prepare_pipelines_in_background(scene()?.as_scene_ref())?.wait()?;
    let in_background = in_background.err().ok_or("it is compiled in the background")?;
    let found = error.to_string();
    if in_background.to_string() != found {
        return Err(in_background.to_string().into());
    }
    let is_complete = ["\"wrong\"", "line 2", "missing"].iter().all(|part| found.contains(part));
    if is_complete { Ok(()) } else { Err(found.into()) }
}
