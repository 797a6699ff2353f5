//! Cameras: fields of view, aspects, near and far planes, sizes of pictures, and places to stand at.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Projection, SceneError};
use drawloom_testing::scenes::cube;
use libtest_mimic::Failed;

use crate::Case;
use crate::signs::{BLUE, GREEN, RED, Sign, Signs, camera, told};
use crate::stage::{Outcome, StageName, Studio};

pub const CASES: &[Case] = &[
    ("fields_of_view_from_a_tenth_of_a_degree_to_179", fields_of_view),
    ("aspects_from_a_hundredth_to_a_hundred", aspects),
    ("what_reaches_into_the_picture_from_outside_is_never_left_out", at_the_edges),
    ("near_planes_from_a_hundredth_of_a_millimetre_and_far_ones_to_infinity", near_and_far),
    ("near_planes_at_the_end_of_f32_are_right_or_refused", nearest),
    ("what_is_before_the_near_plane_is_not_seen", before_the_near_plane),
    ("planes_that_leave_nothing_between_them_are_refused", nothing_between),
    ("without_perspective_pictures_from_a_micrometre_to_ten_thousand_kilometres", orthographic),
    ("without_perspective_pictures_at_the_end_of_f32_are_right_or_refused", smallest_picture),
    ("pictures_without_pixels_are_refused", no_pixels),
    ("pictures_of_one_pixel_and_of_one_row", few_pixels),
    ("pictures_too_large_for_the_device_are_refused_by_the_limits_name", too_many_pixels),
    ("a_camera_inside_of_an_object_sees_its_inside_if_it_has_one", inside),
    ("a_camera_at_a_vertex_and_on_a_face", at_a_vertex),
];

const SIZE: [u32; 2] = [48, 32];

/// A small sign before a large one, both in the middle half of the picture: so far away, and so far before the other.
fn two_signs(camera: &Camera, distance: f64, factor: f64) -> [Sign; 2] {
    let high = |distance: f64| match camera.projection {
        Projection::Perspective { field_of_view } => 2.0 * distance * (f64::from(field_of_view) * 0.5).tan(),
        Projection::Orthographic { height } => f64::from(height),
        other => unreachable!("no main camera is {other:?}"),
    };
    // The narrower side of the picture counts.
    let narrow = (f64::from(camera.size[0]) / f64::from(camera.size[1])).min(1.0);
    let [near, far] = [high(distance) * narrow, high(distance * factor) * narrow];
    [
        Sign::before(camera, distance, near * 0.4).moved(camera, near * 0.15, near * 0.1),
        Sign::before(camera, distance * factor, far * 0.8).colored(RED),
    ]
}

fn fields_of_view(studio: &mut Studio) -> Result<(), Failed> {
    for degrees in [0.1_f32, 0.5, 3.0, 20.0, 60.0, 100.0, 150.0, 175.0, 179.0] {
        for distance in [0.2, 5.0, 1e4] {
            let camera =
                Camera { projection: Projection::Perspective { field_of_view: degrees.to_radians() }, ..camera(SIZE) };
            let signs = two_signs(&camera, distance, 3.0);
            Signs::new(camera, signs)?.expect(studio, &format!("{degrees}° at {distance} m"), 2)?;
        }
    }
    Ok(())
}

fn aspects(studio: &mut Studio) -> Result<(), Failed> {
    for size in [[12, 1200], [9, 90], [20, 19], [90, 9], [1200, 12]] {
        for degrees in [1.0_f32, 60.0, 150.0] {
            let projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            let camera = Camera { projection, ..camera(size) };
            let signs = two_signs(&camera, 5.0, 2.0);
            Signs::new(camera, signs)?.expect(studio, &format!("{size:?} at {degrees}°"), 2)?;
        }
    }
    Ok(())
}

fn at_the_edges(studio: &mut Studio) -> Result<(), Failed> {
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
        // Their middles are outside, and a quarter of each is in the picture.
        let outside = |half: f64| half + narrow * 0.1;
        let ways = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0], [-1.0, -1.0], [1.0, 1.0]];
        let signs = ways.map(|[x, y]| {
            let sign = Sign::before(&camera, 5.0, narrow * 0.8);
            sign.moved(&camera, x * outside(right), y * outside(up))
        });
        let what = format!("{:?}, {:?}", camera.projection, camera.size);
        Signs::new(camera, signs)?.expect(studio, &what, 6)?;
    }
    Ok(())
}

fn near_and_far(studio: &mut Studio) -> Result<(), Failed> {
    for near in [1e-5_f32, 1e-3, 0.05, 10.0, 1e5] {
        for far in [1e9, f32::MAX, f32::INFINITY] {
            for distance in [2.0, 100.0, 1e3] {
                for factor in [1.01, 2.0, 1e4] {
                    let distance = f64::from(near) * distance;
                    // As far as that, an object is left out as a whole.
                    if distance * factor > 0.9e9 {
                        continue;
                    }
                    let camera = Camera { near, far, ..camera(SIZE) };
                    let signs = two_signs(&camera, distance, factor);
                    let what = format!("near {near:e}, far {far:e}, at {distance:e} m and {factor} times that");
                    Signs::new(camera, signs)?.expect(studio, &what, 2)?;
                }
            }
        }
    }
    Ok(())
}

fn nearest(studio: &mut Studio) -> Result<(), Failed> {
    for near in [1e-9_f32, 1e-15, 1e-20, 1e-24, 1e-27, 1e-30, 1e-37, f32::MIN_POSITIVE, 1e-42, f32::from_bits(1)] {
        for distance in [5.0, 1e6] {
            let camera = Camera { near, ..camera(SIZE) };
            let signs = two_signs(&camera, distance, 2.0);
            let signs = Signs::new(camera, signs)?;
            right_or_refused(studio, &signs, &format!("near {near:e}, at {distance} m"))?;
        }
    }
    Ok(())
}

/// Fails unless a picture is right, or refused because of its camera.
fn right_or_refused(studio: &mut Studio, signs: &Signs, what: &str) -> Result<(), Failed> {
    match studio.outcome(&signs.scene.as_scene_ref())? {
        Outcome::Drawn(drawn) => signs.compare(&drawn, 2).map_err(|failed| told(what, failed)),
        Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { .. })) => Ok(()),
        Outcome::Refused(error) => Err(format!("{what}: {error}").into()),
        Outcome::NotSubmitted(error) => Err(format!("{what}: {error}").into()),
    }
}

fn before_the_near_plane(studio: &mut Studio) -> Result<(), Failed> {
    for near in [1e-5_f32, 0.05, 1e5] {
        let camera = Camera { near, ..camera(SIZE) };
        let [small, large] = two_signs(&camera, f64::from(near) * 0.9, 4.0);
        Signs::new(camera.clone(), [small, large])?.expect(studio, &format!("before {near:e}"), 1)?;
        // Tilted, so that the plane cuts it.
        let tilted = Sign { orientation: camera.orientation * Quat::from_rotation_y(1.2), double_sided: true, ..large };
        let across = Sign { position: camera.position + (large.position - camera.position) * 0.3, ..tilted };
        Signs::new(camera, [across])?.expect(studio, &format!("across {near:e}"), 1)?;
    }
    Ok(())
}

fn nothing_between(studio: &mut Studio) -> Result<(), Failed> {
    let whole = Signs::new(camera(SIZE), two_signs(&camera(SIZE), 5.0, 2.0))?;
    for [near, far] in [[1.0, 1.0], [2.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-2.0, -1.0], [f32::INFINITY, f32::INFINITY]] {
        for projection in [camera(SIZE).projection, Projection::Orthographic { height: 5.0 }] {
            let signs = Signs::new(Camera { near, far, projection, ..camera(SIZE) }, [])?;
            match studio.refusal(&signs.scene.as_scene_ref())? {
                FrameError::Scene(SceneError::InvalidCamera { camera, .. }) if camera == "main" => {}
                other => return Err(format!("near {near}, far {far}: {other}").into()),
            }
            whole.expect(studio, "the frame after", 2)?;
        }
    }
    Ok(())
}

fn orthographic(studio: &mut Studio) -> Result<(), Failed> {
    for height in [1e-6_f32, 1e-3, 1.0, 1e3, 1e7] {
        for size in [SIZE, [12, 600], [600, 12]] {
            let projection = Projection::Orthographic { height };
            let [near, far] = [height * 0.1, height * 100.0];
            let camera = Camera { projection, near, far, ..camera(size) };
            let signs = two_signs(&camera, f64::from(height) * 2.0, 1.5);
            Signs::new(camera, signs)?.expect(studio, &format!("{height:e} m high, {size:?}"), 2)?;
        }
    }
    Ok(())
}

fn smallest_picture(studio: &mut Studio) -> Result<(), Failed> {
    for height in [1e-4_f32, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12, 1e-20, 1e-30, f32::MIN_POSITIVE, f32::from_bits(1)] {
        let projection = Projection::Orthographic { height };
        let camera = Camera { projection, near: 0.1, far: 100.0, ..camera(SIZE) };
        // The picture lies within the small one, and nothing of the large one is seen.
        let signs = Signs::new(
            camera.clone(),
            [
                Sign::before(&camera, 5.0, 2.0),
                Sign::before(&camera, 6.0, 4.0).colored(RED),
                Sign::before(&camera, 4.0, 4.0).moved(&camera, 3.0, 0.0).colored(BLUE),
            ],
        )?;
        match studio.outcome(&signs.scene.as_scene_ref())? {
            Outcome::Drawn(drawn) => {
                signs.compare(&drawn, 1).map_err(|failed| told(&format!("{height:e} m high"), failed))?;
            }
            Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { .. })) => {}
            _ => return Err(format!("{height:e} m high").into()),
        }
    }
    Ok(())
}

fn no_pixels(studio: &mut Studio) -> Result<(), Failed> {
    for size in [[0, 0], [0, 7], [7, 0], [0, u32::MAX]] {
        let signs = Signs::new(camera(size), [])?;
        match studio.refusal(&signs.scene.as_scene_ref())? {
            FrameError::EmptyTarget { width, height, .. } if [width, height] == size => {}
            other => return Err(format!("{size:?}: {other}").into()),
        }
    }
    Ok(())
}

fn few_pixels(studio: &mut Studio) -> Result<(), Failed> {
    for size in [[1, 1], [2, 1], [1, 3], [4096, 1], [1, 4096], [8192, 1], [1, 8192]] {
        // All that is seen, so that not only what is far from an edge is sure.
        let camera = camera(size);
        let sign = Sign { scale: Vec3::splat(20.0), ..Sign::before(&camera, 5.0, 1.0) };
        Signs::new(camera, [sign])?.expect(studio, &format!("{size:?}"), 1)?;
    }
    Ok(())
}

fn too_many_pixels(studio: &mut Studio) -> Result<(), Failed> {
    for size in [[16_384, 1], [1, 16_384], [65_536, 1], [1, u32::MAX], [u32::MAX, u32::MAX]] {
        let camera = camera(size);
        let sign = Sign { scale: Vec3::splat(20.0), ..Sign::before(&camera, 5.0, 1.0) };
        let signs = Signs::new(camera, [sign])?;
        let is_small = size[0] <= 16_384 && size[1] <= 16_384;
        match studio.outcome(&signs.scene.as_scene_ref())? {
            Outcome::Drawn(drawn) if is_small => signs.compare(&drawn, 1)?,
            // Nothing is drawn there, and nothing can be too large.
            Outcome::Drawn(_) if studio.name() == StageName::Null => {}
            Outcome::Refused(FrameError::Backend(BackendError::Limit { .. })) => {}
            Outcome::Refused(error) => return Err(format!("{size:?}: {error}").into()),
            Outcome::Drawn(_) => return Err(format!("{size:?}: it was drawn").into()),
            Outcome::NotSubmitted(error) => return Err(format!("{size:?}: {error}").into()),
        }
    }
    let signs = Signs::new(camera(SIZE), two_signs(&camera(SIZE), 5.0, 2.0))?;
    signs.expect(studio, "the frame after", 2)
}

fn inside(studio: &mut Studio) -> Result<(), Failed> {
    for (double_sided, seen) in [(false, 0), (true, 1)] {
        for scale in [1e-3_f32, 1.0, 1e6] {
            let camera = Camera { near: scale * 0.1, ..camera(SIZE) };
            let around = Sign {
                position: camera.position + DVec3::new(0.3, 0.2, 0.1) * f64::from(scale),
                orientation: Quat::from_rotation_x(0.4),
                scale: Vec3::splat(scale),
                color: BLUE,
                double_sided,
            };
            let what = format!("in a box of {scale} m, double-sided {double_sided}");
            Signs::of(cube(), camera, [around])?.expect(studio, &what, seen)?;
        }
    }
    Ok(())
}

fn at_a_vertex(studio: &mut Studio) -> Result<(), Failed> {
    let camera = Camera { near: 0.01, ..camera(SIZE) };
    let turn = camera.orientation.as_dquat();
    for corner in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::Z, DVec3::new(0.0, 1.0, 1.0)] {
        for double_sided in [false, true] {
            let touched = Sign {
                position: camera.position - turn * corner,
                orientation: camera.orientation,
                scale: Vec3::ONE,
                color: GREEN,
                double_sided,
            };
            let far = Sign { scale: Vec3::splat(0.3), ..Sign::before(&camera, 5.0, 1.0) }.colored(RED);
            Signs::of(cube(), camera.clone(), [touched, far])?.expect(studio, &format!("at {corner}"), 1)?;
        }
    }
    Ok(())
}
