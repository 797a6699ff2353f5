//! Cameras: fields of view, aspects, near and far planes, sizes of pictures, and positions within the scene.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Projection, SceneError};
use drawloom_testing::scenes::cube;
use libtest_mimic::Failed;

use crate::Case;
use crate::harness::{BackendName, Harness, Outcome};
use crate::markers::{BLUE, GREEN, Marker, MarkerScene, RED, camera, with_context};

pub const CASES: &[Case] = &[
    ("fields_of_view_from_a_tenth_of_a_degree_to_179", fields_of_view),
    ("aspects_from_a_hundredth_to_a_hundred", aspects),
    ("objects_across_the_edge_of_the_picture_are_drawn", at_the_edges),
    ("near_planes_from_a_hundredth_of_a_millimetre_and_far_ones_to_infinity", near_and_far),
    ("near_planes_at_the_limits_of_f32_are_correct_or_refused", nearest),
    ("objects_in_front_of_the_near_plane_are_not_drawn", in_front_of_the_near_plane),
    ("an_empty_range_of_near_and_far_plane_is_refused", empty_range),
    ("orthographic_pictures_from_a_micrometre_to_ten_thousand_kilometres", orthographic),
    ("orthographic_pictures_at_the_limits_of_f32_are_correct_or_refused", smallest_picture),
    ("pictures_without_pixels_are_refused", no_pixels),
    ("pictures_of_one_pixel_and_of_one_row", few_pixels),
    ("pictures_too_large_for_the_device_are_refused", too_many_pixels),
    ("a_camera_inside_an_object_sees_its_back_faces_if_it_is_double_sided", inside),
    ("a_camera_at_a_vertex_and_on_a_face", at_a_vertex),
];

const SIZE: [u32; 2] = [48, 32];

/// A small marker at `distance` and a large one `factor` times as far away, both in the middle half of the picture.
fn two_markers(camera: &Camera, distance: f64, factor: f64) -> [Marker; 2] {
    let high = |distance: f64| match camera.projection {
        Projection::Perspective { field_of_view } => 2.0 * distance * (f64::from(field_of_view) * 0.5).tan(),
        Projection::Orthographic { height } => f64::from(height),
        other => unreachable!("no main camera is {other:?}"),
    };
    // The shorter side of the picture determines the size.
    let narrow = (f64::from(camera.size[0]) / f64::from(camera.size[1])).min(1.0);
    let [near, far] = [high(distance) * narrow, high(distance * factor) * narrow];
    [
        Marker::before(camera, distance, near * 0.4).moved(camera, near * 0.15, near * 0.1),
        Marker::before(camera, distance * factor, far * 0.8).colored(RED),
    ]
}

fn fields_of_view(harness: &mut Harness) -> Result<(), Failed> {
    for degrees in [0.1_f32, 0.5, 3.0, 20.0, 60.0, 100.0, 150.0, 175.0, 179.0] {
        for distance in [0.2, 5.0, 1e4] {
            let camera =
                Camera { projection: Projection::Perspective { field_of_view: degrees.to_radians() }, ..camera(SIZE) };
            let markers = two_markers(&camera, distance, 3.0);
            MarkerScene::new(camera, markers)?.expect(harness, &format!("{degrees}° at {distance} m"), 2)?;
        }
    }
    Ok(())
}

fn aspects(harness: &mut Harness) -> Result<(), Failed> {
    for size in [[12, 1200], [9, 90], [20, 19], [90, 9], [1200, 12]] {
        for degrees in [1.0_f32, 60.0, 150.0] {
            let projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            let camera = Camera { projection, ..camera(size) };
            let markers = two_markers(&camera, 5.0, 2.0);
            MarkerScene::new(camera, markers)?.expect(harness, &format!("{size:?} at {degrees}°"), 2)?;
        }
    }
    Ok(())
}

fn at_the_edges(harness: &mut Harness) -> Result<(), Failed> {
    let mut cameras = Vec::new();
    for size in [SIZE, [32, 48], [24, 240], [240, 24]] {
        for degrees in [0.1_f32, 5.0, 60.0, 120.0, 160.0] {
            let projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            cameras.push((Camera { projection, ..camera(size) }, f64::from(degrees.to_radians() * 0.5).tan() * 5.0));
        }
        let projection = Projection::Orthographic { height: 8.0 };
        cameras.push((Camera { projection, far: 100.0, ..camera(size) }, 4.0));
    }
    for (camera, up) in cameras {
        let right = up * f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let narrow = up.min(right);
        // The centres are outside the picture, and a quarter of each marker is inside.
        let outside = |half: f64| half + narrow * 0.1;
        let directions = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0], [-1.0, -1.0], [1.0, 1.0]];
        let markers = directions.map(|[x, y]| {
            let marker = Marker::before(&camera, 5.0, narrow * 0.8);
            marker.moved(&camera, x * outside(right), y * outside(up))
        });
        let context = format!("{:?}, {:?}", camera.projection, camera.size);
        MarkerScene::new(camera, markers)?.expect(harness, &context, 6)?;
    }
    Ok(())
}

fn near_and_far(harness: &mut Harness) -> Result<(), Failed> {
    for near in [1e-5_f32, 1e-3, 0.05, 10.0, 1e5] {
        for far in [1e9, f32::MAX, f32::INFINITY] {
            for distance in [2.0, 100.0, 1e3] {
                for factor in [1.01, 2.0, 1e4] {
                    let distance = f64::from(near) * distance;
                    // An object that is entirely beyond the far plane is culled.
                    if distance * factor > 0.9e9 {
                        continue;
                    }
                    let camera = Camera { near, far, ..camera(SIZE) };
                    let markers = two_markers(&camera, distance, factor);
                    let context = format!("near {near:e}, far {far:e}, at {distance:e} m and {factor} times that");
                    MarkerScene::new(camera, markers)?.expect(harness, &context, 2)?;
                }
            }
        }
    }
    Ok(())
}

fn nearest(harness: &mut Harness) -> Result<(), Failed> {
    for near in [1e-9_f32, 1e-15, 1e-20, 1e-24, 1e-27, 1e-30, 1e-37, f32::MIN_POSITIVE, 1e-42, f32::from_bits(1)] {
        for distance in [5.0, 1e6] {
            let camera = Camera { near, ..camera(SIZE) };
            let markers = two_markers(&camera, distance, 2.0);
            let markers = MarkerScene::new(camera, markers)?;
            correct_or_refused(harness, &markers, &format!("near {near:e}, at {distance} m"))?;
        }
    }
    Ok(())
}

/// Fails unless the picture is correct, or the camera is refused.
fn correct_or_refused(harness: &mut Harness, markers: &MarkerScene, context: &str) -> Result<(), Failed> {
    match harness.outcome(&markers.scene.as_scene_ref())? {
        Outcome::Drawn(drawn) => markers.compare(&drawn, 2).map_err(|failed| with_context(context, failed)),
        Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { .. })) => Ok(()),
        Outcome::Refused(error) => Err(format!("{context}: {error}").into()),
        Outcome::NotSubmitted(error) => Err(format!("{context}: {error}").into()),
    }
}

fn in_front_of_the_near_plane(harness: &mut Harness) -> Result<(), Failed> {
    for near in [1e-5_f32, 0.05, 1e5] {
        let camera = Camera { near, ..camera(SIZE) };
        let [small, large] = two_markers(&camera, f64::from(near) * 0.9, 4.0);
        MarkerScene::new(camera.clone(), [small, large])?.expect(harness, &format!("before {near:e}"), 1)?;
        // Tilted, so that the near plane intersects it.
        let tilted =
            Marker { orientation: camera.orientation * Quat::from_rotation_y(1.2), double_sided: true, ..large };
        let across = Marker { position: camera.position + (large.position - camera.position) * 0.3, ..tilted };
        MarkerScene::new(camera, [across])?.expect(harness, &format!("across {near:e}"), 1)?;
    }
    Ok(())
}

fn empty_range(harness: &mut Harness) -> Result<(), Failed> {
    let whole = MarkerScene::new(camera(SIZE), two_markers(&camera(SIZE), 5.0, 2.0))?;
    for [near, far] in [[1.0, 1.0], [2.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-2.0, -1.0], [f32::INFINITY, f32::INFINITY]] {
        for projection in [camera(SIZE).projection, Projection::Orthographic { height: 5.0 }] {
            let markers = MarkerScene::new(Camera { near, far, projection, ..camera(SIZE) }, [])?;
            match harness.refusal(&markers.scene.as_scene_ref())? {
                FrameError::Scene(SceneError::InvalidCamera { camera, .. }) if camera == "main" => {}
                other => return Err(format!("near {near}, far {far}: {other}").into()),
            }
            whole.expect(harness, "the frame after", 2)?;
        }
    }
    Ok(())
}

fn orthographic(harness: &mut Harness) -> Result<(), Failed> {
    for height in [1e-6_f32, 1e-3, 1.0, 1e3, 1e7] {
        for size in [SIZE, [12, 600], [600, 12]] {
            let projection = Projection::Orthographic { height };
            let [near, far] = [height * 0.1, height * 100.0];
            let camera = Camera { projection, near, far, ..camera(size) };
            let markers = two_markers(&camera, f64::from(height) * 2.0, 1.5);
            MarkerScene::new(camera, markers)?.expect(harness, &format!("{height:e} m high, {size:?}"), 2)?;
        }
    }
    Ok(())
}

fn smallest_picture(harness: &mut Harness) -> Result<(), Failed> {
    for height in [1e-4_f32, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12, 1e-20, 1e-30, f32::MIN_POSITIVE, f32::from_bits(1)] {
        let projection = Projection::Orthographic { height };
        let camera = Camera { projection, near: 0.1, far: 100.0, ..camera(SIZE) };
        // The small marker fills the picture and hides the large one.
        let markers = MarkerScene::new(
            camera.clone(),
            [
                Marker::before(&camera, 5.0, 2.0),
                Marker::before(&camera, 6.0, 4.0).colored(RED),
                Marker::before(&camera, 4.0, 4.0).moved(&camera, 3.0, 0.0).colored(BLUE),
            ],
        )?;
        match harness.outcome(&markers.scene.as_scene_ref())? {
            Outcome::Drawn(drawn) => {
                markers.compare(&drawn, 1).map_err(|failed| with_context(&format!("{height:e} m high"), failed))?;
            }
            Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { .. })) => {}
            _ => return Err(format!("{height:e} m high").into()),
        }
    }
    Ok(())
}

fn no_pixels(harness: &mut Harness) -> Result<(), Failed> {
    for size in [[0, 0], [0, 7], [7, 0], [0, u32::MAX]] {
        let markers = MarkerScene::new(camera(size), [])?;
        match harness.refusal(&markers.scene.as_scene_ref())? {
            FrameError::EmptyTarget { width, height, .. } if [width, height] == size => {}
            other => return Err(format!("{size:?}: {other}").into()),
        }
    }
    Ok(())
}

fn few_pixels(harness: &mut Harness) -> Result<(), Failed> {
    for size in [[1, 1], [2, 1], [1, 3], [4096, 1], [1, 4096], [8192, 1], [1, 8192]] {
        // The marker fills the picture, so the oracle is sure of every pixel.
        let camera = camera(size);
        let marker = Marker { scale: Vec3::splat(20.0), ..Marker::before(&camera, 5.0, 1.0) };
        MarkerScene::new(camera, [marker])?.expect(harness, &format!("{size:?}"), 1)?;
    }
    Ok(())
}

fn too_many_pixels(harness: &mut Harness) -> Result<(), Failed> {
    for size in [[16_384, 1], [1, 16_384], [65_536, 1], [1, u32::MAX], [u32::MAX, u32::MAX]] {
        let camera = camera(size);
        let marker = Marker { scale: Vec3::splat(20.0), ..Marker::before(&camera, 5.0, 1.0) };
        let markers = MarkerScene::new(camera, [marker])?;
        let is_small = size[0] <= 16_384 && size[1] <= 16_384;
        match harness.outcome(&markers.scene.as_scene_ref())? {
            Outcome::Drawn(drawn) if is_small => markers.compare(&drawn, 1)?,
            // This backend draws nothing, so no picture is too large for it.
            Outcome::Drawn(_) if harness.name() == BackendName::Null => {}
            Outcome::Refused(FrameError::Backend(BackendError::TargetTooLarge { width, height, .. }))
                if [width, height] == size => {}
            Outcome::Refused(error) => return Err(format!("{size:?}: {error}").into()),
            Outcome::Drawn(_) => return Err(format!("{size:?}: it was drawn").into()),
            Outcome::NotSubmitted(error) => return Err(format!("{size:?}: {error}").into()),
        }
    }
    let markers = MarkerScene::new(camera(SIZE), two_markers(&camera(SIZE), 5.0, 2.0))?;
    markers.expect(harness, "the frame after", 2)
}

fn inside(harness: &mut Harness) -> Result<(), Failed> {
    for (double_sided, min_visible) in [(false, 0), (true, 1)] {
        for scale in [1e-3_f32, 1.0, 1e6] {
            let camera = Camera { near: scale * 0.1, ..camera(SIZE) };
            let around = Marker {
                position: camera.position + DVec3::new(0.3, 0.2, 0.1) * f64::from(scale),
                orientation: Quat::from_rotation_x(0.4),
                scale: Vec3::splat(scale),
                color: BLUE,
                double_sided,
            };
            let context = format!("in a box of {scale} m, double-sided {double_sided}");
            MarkerScene::of(cube(), camera, [around])?.expect(harness, &context, min_visible)?;
        }
    }
    Ok(())
}

fn at_a_vertex(harness: &mut Harness) -> Result<(), Failed> {
    let camera = Camera { near: 0.01, ..camera(SIZE) };
    let turn = camera.orientation.as_dquat();
    for corner in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::Z, DVec3::new(0.0, 1.0, 1.0)] {
        for double_sided in [false, true] {
            let touched = Marker {
                position: camera.position - turn * corner,
                orientation: camera.orientation,
                scale: Vec3::ONE,
                color: GREEN,
                double_sided,
            };
            let far = Marker { scale: Vec3::splat(0.3), ..Marker::before(&camera, 5.0, 1.0) }.colored(RED);
            MarkerScene::of(cube(), camera.clone(), [touched, far])?.expect(harness, &format!("at {corner}"), 1)?;
        }
    }
    Ok(())
}
