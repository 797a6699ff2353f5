//! Cameras of parts of a picture, and cameras that draw what is in front of a plane only.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec2, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, ClipPlane, Light, Material, RenderObject, Scene};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, sized};
use image::RgbImage;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{self, Fixture};
use crate::image_distance::{Distance, as_image, assert_alike, assert_different};
use crate::references::small_colonnade;

pub const CASES: &[Case] = &[
    ("tiles_put_together_are_the_whole_picture", tiles),
    ("tiles_of_a_parallel_projection_are_the_whole_picture", parallel_tiles),
    ("tiles_are_the_same_in_software", tiles_in_software),
    ("a_jitter_of_whole_pixels_moves_the_picture", jitter),
    ("a_clip_plane_in_empty_space_changes_nothing", clip_plane_in_empty_space),
    ("what_is_behind_a_clip_plane_is_not_drawn", clipped),
    ("a_clip_plane_clips_in_software_as_it_does_on_a_device", clipped_in_software),
];

const SIZE: [u32; 2] = [96, 54];

fn colonnade() -> Result<(Scene, Camera), Failed> {
    let mut scene = small_colonnade()?;
    let camera = sized(scene.cameras.remove(0), SIZE);
    Ok((scene, camera))
}

/// The pictures of the tiles of a camera, put together.
fn drawn_in_tiles(scene: &mut Scene, camera: &Camera, count: u32) -> Result<RgbImage, Failed> {
    let mut fixture = Fixture::new()?;
    let tiles: Vec<_> = (0..count * count).map(|tile| [tile % count, tile / count]).collect();
    scene.cameras = tiles.iter().map(|tile| camera.tile(*tile, count)).collect();
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    let mut whole = RgbImage::new(camera.size[0] * count, camera.size[1] * count);
    for (view, [column, row]) in tiles.into_iter().enumerate() {
        let picture = as_image(&submission.read(view, "picture")?)?;
        let [x, y] = [column * camera.size[0], row * camera.size[1]].map(i64::from);
        image::imageops::replace(&mut whole, &picture, x, y);
    }
    Ok(whole)
}

fn assert_tiles_are_the_whole(mut scene: Scene, camera: &Camera) -> Result<(), Failed> {
    for count in [2, 3] {
        let tiled = drawn_in_tiles(&mut scene, camera, count)?;
        scene.cameras = vec![sized(camera.clone(), camera.size.map(|side| side * count))];
        let whole = as_image(&fixture::draw(&scene)?)?;
        let distance = Distance::between(&whole, &tiled)?;
        if !distance.is_within_bound() {
            return Err(format!("{count} by {count} tiles differ from the whole: {distance:?}").into());
        }
    }
    Ok(())
}

fn tiles() -> Result<(), Failed> {
    let (scene, camera) = colonnade()?;
    assert_tiles_are_the_whole(scene, &camera)
}

fn parallel_tiles() -> Result<(), Failed> {
    let (scene, camera) = colonnade()?;
    let projection = drawloom::scene::Projection::Orthographic { height: 6.0 };
    assert_tiles_are_the_whole(scene, &Camera { projection, far: 60.0, ..camera })
}

/// A camera's picture by the software backend, which computes in f64.
fn drawn_in_software(scene: &Scene) -> Result<Picture, Failed> {
    let scheduler = Arc::new(Scheduler::new(1)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
    Ok(submission.read(0, "picture")?)
}

fn tiles_in_software() -> Result<(), Failed> {
    let mut scene = two_cubes()?;
    let camera = scene.cameras.remove(0);
    for tile in [[0, 0], [1, 0], [1, 1]] {
        scene.cameras = vec![camera.tile(tile, 2)];
        assert_alike(&fixture::draw(&scene)?, &drawn_in_software(&scene)?)?;
    }
    Ok(())
}

fn jitter() -> Result<(), Failed> {
    let (mut scene, camera) = colonnade()?;
    scene.cameras = vec![camera.clone()];
    let still = as_image(&fixture::draw(&scene)?)?;
    scene.cameras = vec![camera.jittered(Vec2::new(5.0, 3.0))];
    let moved = as_image(&fixture::draw(&scene)?)?;
    // What was 5 pixels to the right and 3 above is in the middle now.
    let [width, height] = [SIZE[0] - 5, SIZE[1] - 3];
    let of_still = image::imageops::crop_imm(&still, 5, 0, width, height).to_image();
    let of_moved = image::imageops::crop_imm(&moved, 0, 3, width, height).to_image();
    let distance = Distance::between(&of_still, &of_moved)?;
    if distance.is_within_bound() { Ok(()) } else { Err(format!("the picture moved otherwise: {distance:?}").into()) }
}

/// A red cube 4 m in front of the camera and a green one 12 m away, lit from the camera's side.
fn two_cubes() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    for (color, position) in [(Vec3::X, DVec3::new(-0.7, 0.0, -4.0)), (Vec3::Y, DVec3::new(0.9, 0.3, -12.0))] {
        let material = scene.add(Material { diffuse: color, ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, position))?;
    }
    let position = DVec3::new(1.0, 2.0, 1.0);
    scene.lights.push(Light::Point { position, range: 40.0, intensity: Vec3::splat(120.0), casts_shadow: false });
    scene.ambient = Vec3::splat(0.1);
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), SIZE)];
    Ok(scene)
}

fn with_clip_plane(mut scene: Scene, clip_plane: ClipPlane) -> Scene {
    scene.cameras[0].clip_plane = Some(clip_plane);
    scene
}

/// Between the camera and the cubes: their positions are found from another depth.
fn in_empty_space() -> ClipPlane {
    ClipPlane { point: DVec3::NEG_Z, normal: Vec3::new(0.28, 0.0, -0.96) }
}

/// Between the cubes.
fn between_the_cubes() -> ClipPlane {
    ClipPlane { point: DVec3::NEG_Z * 8.0, normal: Vec3::new(-0.28, 0.0, -0.96) }
}

fn clip_plane_in_empty_space() -> Result<(), Failed> {
    let plain = fixture::draw(&two_cubes()?)?;
    assert_alike(&plain, &fixture::draw(&with_clip_plane(two_cubes()?, in_empty_space()))?)
}

fn clipped() -> Result<(), Failed> {
    let scene = with_clip_plane(two_cubes()?, between_the_cubes());
    let found = fixture::draw(&scene)?;
    assert_different(&found, &fixture::draw(&two_cubes()?)?)?;
    let mut without_the_near_cube = two_cubes()?;
    let near = without_the_near_cube.objects().next().ok_or("the scene has no object")?;
    without_the_near_cube.remove_object(near)?;
    assert_alike(&found, &fixture::draw(&without_the_near_cube)?)
}

fn clipped_in_software() -> Result<(), Failed> {
    for plane in [in_empty_space(), between_the_cubes()] {
        let scene = with_clip_plane(two_cubes()?, plane);
        assert_alike(&fixture::draw(&scene)?, &drawn_in_software(&scene)?)?;
    }
    Ok(())
}
