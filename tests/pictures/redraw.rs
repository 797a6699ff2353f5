//! Views that are drawn once every few frames, and others that show what they drew last.

use std::sync::Arc;

use drawloom::backend::{Backend, Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::{Camera, LayerMask, Light, Material, Redraw, RenderObject, Scene, Topology};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_testing::scenes::{cube, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, device};
use crate::image_distance::assert_different;
use crate::imported_targets::{USAGE, texture};
use crate::sampled_views::{MIRROR, PLANE};
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("a_mirror_shows_the_scene_of_its_latest_redraw_and_the_rest_is_up_to_date", mirror),
    ("a_cached_mirror_shows_the_same_in_software", mirror_in_software),
    ("a_cached_picture_is_read_back_and_its_history_is_that_of_its_redraw", history),
    ("views_that_are_drawn_into_the_engines_textures_are_never_cached", imported),
];

const SIZE: [u32; 2] = [96, 64];
/// Of what only the mirror shows, of what only the camera sees, and of the mirror.
const MIRRORED: LayerMask = LayerMask::layer(1);
const DIRECT: LayerMask = LayerMask::layer(2);
const SURFACE: LayerMask = LayerMask::layer(7);

/// A red cube that only the mirror shows, and a yellow one that only the camera sees, both moved to the right, in
/// metres.
fn scene(mirrored: f64, direct: f64, redraw: Redraw) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    let cubes = [
        (Vec3::X, DVec3::new(-0.9 + mirrored, 0.3, -1.5), MIRRORED),
        (Vec3::new(1.0, 0.8, 0.1), DVec3::new(0.2 + direct, -0.5, -2.6), DIRECT),
    ];
    for (color, position, layers) in cubes {
        let material = scene.add(Material { diffuse: color, ..Material::default() })?;
        let mut object = RenderObject::new(mesh, material, position);
        (object.scale, object.layers) = (Vec3::splat(0.4), layers);
        scene.add_object(object)?;
    }
    let mesh = scene.add(square(Topology::TriangleList))?;
    let material = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() })?;
    let mut object = RenderObject::new(mesh, material, PLANE.point);
    (object.layers, object.scale) = (SURFACE, Vec3::splat(1.2));
    scene.add_object(object)?;
    let direction = Vec3::new(0.6, -0.8, 0.0);
    scene.lights.push(Light::Directional { direction, illuminance: Vec3::splat(3.0), casts_shadow: false });
    scene.ambient = Vec3::splat(0.2);
    scene.background = Vec3::new(0.1, 0.2, 0.4);
    let layers = LayerMask(DIRECT.0 | SURFACE.0);
    let camera = Camera::looking_at("main", DVec3::new(0.5, 0.4, 2.0), DVec3::new(0.0, 0.0, -4.0));
    let camera = Camera { layers, ..sized(camera, SIZE) };
    let mirror = Camera { layers: MIRRORED, redraw, ..camera.reflected("mirror", PLANE) };
    scene.cameras = vec![camera, mirror];
    Ok(scene)
}

fn with_mirror<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    builder.pipeline(Deferred::to_picture()).process(MIRROR)
}

fn offset(frame: u32) -> f64 {
    0.2 * f64::from(frame)
}

/// Draws frames with a mirror of this interval, and compares each with a new renderer's picture of the same state.
fn check_mirror(
    interval: u32,
    mut draw: impl FnMut(&Scene) -> Result<Picture, Failed>,
    expected: impl Fn(&Scene) -> Result<Picture, Failed>,
) -> Result<(), Failed> {
    let mut pictures = Vec::new();
    for frame in 0..3 * interval {
        let found = draw(&scene(offset(frame), offset(frame), Redraw::Interval(interval))?)?;
        let redrawn = frame / interval * interval;
        let expected = expected(&scene(offset(redrawn), offset(frame), Redraw::EveryFrame)?)?;
        expect(found == expected, || format!("frame {frame} of interval {interval}"))?;
        pictures.push(expected);
    }
    // The pictures show both cubes move.
    let still = expected(&scene(offset(interval), offset(0), Redraw::EveryFrame)?)?;
    assert_different(&still, &pictures[0])?;
    assert_different(&still, &pictures[interval as usize])
}

fn mirror() -> Result<(), Failed> {
    let fresh = |scene: &Scene| Fixture::with(1, with_mirror)?.draw(scene);
    for (workers, interval) in [(1, 3), (2, 2), (4, 3)] {
        for is_transient in [false, true] {
            let mut fixture = if is_transient {
                Fixture::with_transient_targets(workers, with_mirror)
            } else {
                Fixture::with(workers, with_mirror)
            }?;
            check_mirror(interval, |scene| fixture.draw(scene), fresh)
                .map_err(|error| format!("{workers} workers, transient: {is_transient}: {error:?}"))?;
        }
    }
    Ok(())
}

fn mirror_in_software() -> Result<(), Failed> {
    let renderer = |workers| {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        Ok::<_, Failed>(with_mirror(builder).build(scheduler)?)
    };
    let draw = |renderer: &mut Renderer<SoftwareBackend>, submitter: &Submitter<_>, scene: &Scene| {
        let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
        Ok(submission.read(0, "picture")?)
    };
    let (mut drawing, submitter) = renderer(2)?;
    let fresh = |scene: &Scene| {
        let (mut renderer, submitter) = renderer(1)?;
        draw(&mut renderer, &submitter, scene)
    };
    check_mirror(3, |scene| draw(&mut drawing, &submitter, scene), fresh)
}

/// The mean of the picture and of what it drew in the frame before.
struct Trail;

impl RenderProcess for Trail {
    fn name(&self) -> &str {
        "trail"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("picture");
        declare.samples_previous("trail");
        declare.clears_color("trail", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var picture: texture_2d<f32>;
            @group(2) @binding(2) var before: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let pixel = vec2<i32>(in.position.xy);
                return 0.5 * (textureLoad(picture, pixel, 0) + textureLoad(before, pixel, 0));
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn history() -> Result<(), Failed> {
    let build = || Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).process(Trail).output("trail"));
    let main_alone = |frame: u32, redraw: Redraw| {
        let mut scene = scene(0.0, offset(frame), redraw)?;
        scene.cameras.truncate(1);
        scene.cameras[0].redraw = redraw;
        Ok::<_, Failed>(scene)
    };
    let read = |fixture: &mut Fixture, scene: &Scene| {
        let recorded = fixture.record(scene)?;
        Ok::<_, Failed>(fixture.submit(recorded)?.read(0, "trail")?)
    };
    // The expected one draws only the frames that the other redraws.
    let [mut fixture, mut expected] = [build()?, build()?];
    let mut latest = None;
    for frame in 0..7 {
        let found = read(&mut fixture, &main_alone(frame, Redraw::Interval(3))?)?;
        if frame % 3 == 0 {
            latest = Some(read(&mut expected, &main_alone(frame, Redraw::EveryFrame)?)?);
        }
        expect(Some(&found) == latest.as_ref(), || format!("frame {frame}"))?;
    }
    Ok(())
}

fn imported() -> Result<(), Failed> {
    let (device, _) = device()?;
    let mut fixture = Fixture::with(2, with_mirror)?;
    for (frame, is_imported) in [(0, false), (1, true), (2, true), (3, false), (4, false)] {
        let scene = scene(offset(frame), 0.0, Redraw::Interval(100))?;
        if is_imported {
            let radiance = texture(&device, SIZE, wgpu::TextureFormat::Rgba16Float, USAGE);
            fixture.renderer.backend().import_target("main/mirror", "radiance", radiance);
        }
        let recorded = fixture.record(&scene)?;
        let age = recorded.statistics().views[1].age;
        let found = fixture.submit(recorded)?.read(0, "picture")?;
        // The frame after an import has to draw into the view's own target.
        let redrawn = frame.min(3);
        expect(age == frame - redrawn, || format!("frame {frame}: drawn {age} frames ago"))?;
        let scene = self::scene(offset(redrawn), 0.0, Redraw::EveryFrame)?;
        let expected = Fixture::with(1, with_mirror)?.draw(&scene)?;
        expect(found == expected, || format!("frame {frame}"))?;
    }
    Ok(())
}
