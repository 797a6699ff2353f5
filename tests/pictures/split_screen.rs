//! What one main camera sees does not depend on which others there are, and all that draw parts of one picture have the
//! same shadows.

use std::collections::HashMap;
use std::sync::Arc;

use drawloom::backend::{Backend, Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::{DVec3, Vec2, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Projection, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, half_floats};
use crate::image_distance::assert_different;
use crate::rays::{Counts, Panel, PanelScene};
use crate::sampled_views::{MIRROR, PLANE, mirror_scene};
use crate::shadows::{MAPS, camera, expect, sun, with_context, without_shadow};

pub const CASES: &[Case] = &[
    ("a_player_sees_the_same_wherever_others_are", || apart(&mut on_device)),
    ("a_player_sees_the_same_in_software_wherever_others_are", || apart(&mut in_software)),
    ("a_player_sees_the_same_whatever_other_main_cameras_are", || other_kinds(&mut on_device)),
    ("a_player_sees_the_same_in_software_whatever_other_main_cameras_are", || other_kinds(&mut in_software)),
    ("main_cameras_that_come_and_go_change_no_picture", || coming_and_going(&mut on_device)),
    ("main_cameras_that_come_and_go_change_no_picture_in_software", || coming_and_going(&mut in_software)),
    ("shadows_continue_where_tiles_meet", || tiles(&mut on_device)),
    ("shadows_continue_in_software_where_tiles_meet", || tiles(&mut in_software)),
    ("jittered_cameras_share_maps", || jittered(&mut on_device)),
    ("a_mirror_has_the_shadows_of_the_camera_that_looks_into_it", mirror),
    ("the_43rd_shadowed_lamp_lights_without_a_shadow", || too_many_lamps(wgpu_of_256_layers()?)),
    ("the_43rd_shadowed_lamp_lights_without_a_shadow_in_software", || too_many_lamps(in_software(SMALL_MAPS)?)),
];

/// Draws a scene: the targets `radiance` and `picture` of each camera, and the number of shadow maps.
type Draw = Box<dyn FnMut(&Scene) -> Result<Drawn, Failed>>;

/// Makes a renderer with these maps.
type Make<'a> = &'a mut dyn FnMut(ShadowMaps) -> Result<Draw, Failed>;

struct Drawn {
    radiance: Vec<Picture>,
    pictures: Vec<Picture>,
    maps: usize,
}

fn on_device(maps: ShadowMaps) -> Result<Draw, Failed> {
    drawing(backend()?, Arc::new(Scheduler::new(2)?), maps, |submission, view, target| {
        Ok(submission.read(view, target)?)
    })
}

fn in_software(maps: ShadowMaps) -> Result<Draw, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let backend = SoftwareBackend::new(Arc::clone(&scheduler));
    drawing(backend, scheduler, maps, |submission, view, target| Ok(submission.read(view, target)?))
}

fn drawing<B: Backend>(
    backend: B,
    scheduler: Arc<Scheduler>,
    maps: ShadowMaps,
    read: impl Fn(&B::Submission, usize, &str) -> Result<Picture, Failed> + 'static,
) -> Result<Draw, Failed> {
    let deferred = Deferred::to_picture().shadow_maps(Some(maps));
    let (mut renderer, submitter) = Renderer::builder(backend).pipeline(deferred).build(scheduler)?;
    Ok(Box::new(move |scene| {
        let recorded = renderer.record(scene.as_scene_ref())?;
        let maps = recorded.statistics().views.iter().filter(|view| view.kind == ViewKind::Shadow).count();
        let submission = submitter.submit(recorded)?.submission;
        let read = |target| (0..scene.cameras.len()).map(|view| read(&submission, view, target)).collect();
        let [radiance, pictures]: [Result<Vec<_>, Failed>; 2] = ["radiance", "picture"].map(read);
        Ok(Drawn { radiance: radiance?, pictures: pictures?, maps })
    }))
}

/// A floor and a square above it, around x.
fn site(x: f64) -> [Panel; 2] {
    let mut square = Panel::facing(DVec3::new(x, 1.2, 0.0), DVec3::Y, 0.7).double_sided();
    (square.right, square.up) = (square.right + square.up * 0.3, square.up - square.right * 0.3);
    [Panel::facing(DVec3::X * x, DVec3::Y, 8.0), square]
}

fn world(places: &[f64], maps: ShadowMaps) -> PanelScene {
    let panels = places.iter().copied().flat_map(site).collect();
    PanelScene { panels, lights: vec![sun(DVec3::new(0.3, -0.9, 0.2).normalize())], maps }
}

/// A player at x.
fn player(name: &str, x: f64) -> Camera {
    Camera { name: name.to_owned(), ..camera(DVec3::new(x + 2.0, 3.0, 4.0), DVec3::X * x, 50.0) }
}

/// A camera that sees the place at x from above, like a map.
fn plan(name: &str, x: f64) -> Camera {
    let above = Camera::looking_at(name, DVec3::new(x, 9.0, 0.0), DVec3::X * x);
    sized(Camera { projection: Projection::Orthographic { height: 7.0 }, far: 20.0, ..above }, [48, 32])
}

/// The cameras together see what each of them sees alone, byte for byte, and that is what rays find.
fn same_as_alone(draw: &mut Draw, world: &PanelScene, cameras: &[Camera]) -> Result<Vec<Counts>, Failed> {
    let together = draw(&world.scene(cameras)?)?;
    let mut counts = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        let alone = draw(&world.scene(std::slice::from_ref(camera))?)?;
        if alone.pictures[0] != together.pictures[index] || alone.radiance[0] != together.radiance[index] {
            let pixels = alone.pictures[0].bytes.iter().zip(&together.pictures[index].bytes);
            let different = pixels.filter(|(one, other)| one != other).count();
            return Err(format!("{different} bytes of camera {index} differ from its picture alone").into());
        }
        counts.push(world.compare_with(camera, &half_floats(&together.radiance[index]))?);
    }
    Ok(counts)
}

fn apart(make: Make<'_>) -> Result<(), Failed> {
    for cascades in [1, 4] {
        let maps = ShadowMaps { cascades, ..MAPS };
        let mut draw = make(maps)?;
        for distance in [0.0, 0.001, 100.0, 500.0, 2_000.0, 1e6] {
            let places = [0.0, distance];
            let world = world(if distance < 1.0 { &places[..1] } else { &places }, maps);
            let cameras = [player("first", 0.0), player("second", distance)];
            let counts = same_as_alone(&mut draw, &world, &cameras)
                .map_err(|failed| with_context(failed, format!("{cascades} cascades, {distance} m")))?;
            counts.into_iter().try_for_each(|counts| expect(counts, 0.4, 0.02))?;
        }
    }
    Ok(())
}

fn other_kinds(make: Make<'_>) -> Result<(), Failed> {
    let maps = ShadowMaps { cascades: 2, ..MAPS };
    let mut draw = make(maps)?;
    let wide = Projection::Perspective { field_of_view: 1.9 };
    let looking_away = Camera::looking_at("away", DVec3::new(2.0, 3.0, 4.0), DVec3::new(4.0, 3.0, 40.0));
    let others: [(&str, Vec<Camera>); 9] = [
        ("three players", vec![player("second", 500.0), player("third", -90.0)]),
        ("four players", vec![player("second", 500.0), player("third", -90.0), player("fourth", 0.4)]),
        ("another of the same name", vec![player("main", 500.0)]),
        ("one in the same place with a wider view", vec![Camera { projection: wide, ..player("wide", 0.0) }]),
        ("one in the same place with another size", vec![sized(player("large", 0.0), [90, 50])]),
        ("one in the same place that looks elsewhere", vec![sized(looking_away, [64, 64])]),
        ("one in the same place whose near plane is farther", vec![Camera { near: 2.0, ..player("near", 0.0) }]),
        ("plans from above", vec![plan("plan", 0.0), plan("other plan", 500.0)]),
        ("one far off centre", vec![Camera { shift: Vec2::new(3.0, -1.0), ..player("shifted", 0.0) }]),
    ];
    let world = world(&[0.0, -90.0, 500.0], maps);
    for (what, others) in others {
        for position in [0, others.len()] {
            let mut cameras = others.clone();
            cameras.insert(position, player("main", 0.0));
            let counts = same_as_alone(&mut draw, &world, &cameras).map_err(|failed| with_context(failed, what))?;
            expect(counts[position], 0.4, 0.02)?;
        }
    }
    Ok(())
}

/// In frames of one renderer.
fn coming_and_going(make: Make<'_>) -> Result<(), Failed> {
    let maps = ShadowMaps { cascades: 3, ..MAPS };
    let [first, second, third] = [player("first", 0.0), player("second", 500.0), plan("third", -90.0)];
    let world = world(&[0.0, -90.0, 500.0], maps);
    let mut alone = HashMap::new();
    for camera in [&first, &second, &third] {
        let drawn = make(maps)?(&world.scene(std::slice::from_ref(camera))?)?;
        alone.insert(camera.name.clone(), drawn.pictures);
    }
    let mut draw = make(maps)?;
    let frames = [
        vec![&first],
        vec![&first, &second],
        vec![&first, &second, &third],
        vec![&second, &first],
        vec![&second],
        vec![&third, &second, &first],
        vec![&first],
    ];
    for (index, cameras) in frames.into_iter().enumerate() {
        let cameras: Vec<_> = cameras.into_iter().cloned().collect();
        let drawn = draw(&world.scene(&cameras)?)?;
        for (camera, found) in cameras.iter().zip(&drawn.pictures) {
            if *found != alone[&camera.name][0] {
                return Err(format!("the {} player's picture differs in frame {index}", camera.name).into());
            }
        }
        if drawn.maps != 3 * cameras.len() {
            return Err(format!("{} maps for {} main cameras", drawn.maps, cameras.len()).into());
        }
    }
    Ok(())
}

fn mirror() -> Result<(), Failed> {
    let mut scene = mirror_scene()?;
    // A cube casts its shadow on a side of another one that only the mirror shows.
    let direction = Vec3::new(0.1, -0.9, 0.4).normalize();
    let handles: Vec<_> = scene.objects().collect();
    let mut caster = scene.object(handles[1])?;
    (caster.position, caster.scale) = (caster.position - direction.as_dvec3() * 1.2, Vec3::splat(0.25));
    scene.add_object(caster)?;
    let main = scene.cameras.remove(0);
    let far_away = Camera { position: main.position + DVec3::X * 700.0, ..main.clone() };
    let with_mirror = |camera: &Camera| [camera.clone(), camera.reflected("mirror", PLANE)];
    let second = Camera { name: "second".to_owned(), ..far_away };
    let mut draw = |cameras: &[Camera], lights: &[Light]| -> Result<Picture, Failed> {
        scene.cameras = cameras.to_vec();
        scene.lights = lights.to_vec();
        let deferred = Deferred::to_picture().shadow_maps(Some(MAPS));
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred).process(MIRROR))?;
        let recorded = fixture.record(&scene)?;
        let view = cameras.iter().position(|camera| camera.name == "main").ok_or("there is no main camera")?;
        Ok(fixture.submit(recorded)?.read(view, "picture")?)
    };
    let sun = [Light::Directional { direction, illuminance: Vec3::splat(3.0), casts_shadow: true }];
    let alone = draw(&with_mirror(&main), &sun)?;
    let [main_view, mirror_view] = with_mirror(&main);
    let together = [
        [with_mirror(&main), with_mirror(&second)].concat(),
        [with_mirror(&second), with_mirror(&main)].concat(),
        vec![second.clone(), mirror_view, main_view],
    ];
    for (index, cameras) in together.iter().enumerate() {
        if draw(cameras, &sun)? != alone {
            return Err(format!("another main camera changes the picture: case {index}").into());
        }
    }
    assert_different(&alone, &draw(&with_mirror(&main), &sun.map(without_shadow))?)
}

const SMALL_MAPS: ShadowMaps = ShadowMaps { side: 48, ..MAPS };

fn wgpu_of_256_layers() -> Result<Draw, Failed> {
    let (device, queue) = adapter::device_with_limits(wgpu::Limits::default())?;
    drawing(WgpuBackend::new(device, queue)?, Arc::new(Scheduler::new(2)?), SMALL_MAPS, |submission, view, target| {
        Ok(submission.read(view, target)?)
    })
}

/// The square casts a shadow in the light of whichever lamp has a map. The first 42 have one.
fn too_many_lamps(mut draw: Draw) -> Result<(), Failed> {
    let faint = Light::Point {
        position: DVec3::new(0.5, 3.0, -0.4),
        intensity: Vec3::splat(0.05),
        range: 30.0,
        casts_shadow: true,
    };
    let bright = Light::Point {
        position: DVec3::new(-0.3, 2.4, 0.2),
        intensity: Vec3::new(50.0, 40.0, 30.0),
        range: 30.0,
        casts_shadow: true,
    };
    for bright_index in [42, 41] {
        let mut lights = vec![faint; 43];
        lights[bright_index] = bright;
        let mut world = PanelScene { panels: site(0.0).to_vec(), lights, maps: SMALL_MAPS };
        let camera = player("main", 0.0);
        let drawn = draw(&world.scene(std::slice::from_ref(&camera))?)?;
        if drawn.maps != 252 {
            return Err(format!("{} maps", drawn.maps).into());
        }
        // What rays find if the last lamp casts no shadow.
        world.lights[42] = without_shadow(world.lights[42]);
        let counts = world
            .compare_with(&camera, &half_floats(&drawn.radiance[0]))
            .map_err(|failed| with_context(failed, bright_index))?;
        if counts.lit + counts.fading < 2000 {
            return Err(format!("too few pixels to compare: {counts:?}").into());
        }
    }
    Ok(())
}

/// The tiles of a picture have the same maps, whether one frame draws them all or each is drawn in its own.
fn tiles(make: Make<'_>) -> Result<(), Failed> {
    let maps = ShadowMaps { cascades: 2, ..MAPS };
    let world = world(&[0.0], maps);
    let off_centre = Camera { shift: Vec2::new(0.4, -0.2), ..player("shifted", 0.0) };
    for (whole, count) in [(player("main", 0.0), 2), (player("main", 0.0), 3), (off_centre, 3), (plan("plan", 0.0), 3)]
    {
        let whole = sized(whole, [40, 40]);
        let context = format!("{} by {count} tiles of {}", count, whole.name);
        let cameras: Vec<_> = (0..count * count).map(|tile| whole.tile([tile % count, tile / count], count)).collect();
        let mut draw = make(maps)?;
        let counts = same_as_alone(&mut draw, &world, &cameras).map_err(|failed| with_context(failed, &context))?;
        if counts.iter().map(|counts| counts.dark).sum::<usize>() < 20 {
            return Err(format!("{context}: too few pixels to compare: {counts:?}").into());
        }
        let maps = draw(&world.scene(&cameras)?)?.maps;
        if maps != 2 {
            return Err(format!("{context} have {maps} maps").into());
        }
    }
    Ok(())
}

fn jittered(make: Make<'_>) -> Result<(), Failed> {
    let maps = ShadowMaps { cascades: 2, ..MAPS };
    let world = world(&[0.0], maps);
    let off_centre = Camera { shift: Vec2::new(0.4, -0.2), ..player("main", 0.0) };
    for camera in [player("main", 0.0), off_centre, sized(plan("plan", 0.0), [64, 64])] {
        let offsets = [[-0.25, 0.125], [0.375, 0.25], [0.0, -0.5], [0.45, 0.3]];
        let cameras: Vec<_> = offsets.into_iter().map(|offset| camera.jittered(offset.into())).collect();
        let mut draw = make(maps)?;
        same_as_alone(&mut draw, &world, &cameras)?;
        let maps = draw(&world.scene(&cameras)?)?.maps;
        if maps != 2 {
            return Err(format!("four jittered cameras like {camera:?} have {maps} maps").into());
        }
    }
    Ok(())
}
