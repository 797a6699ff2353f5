//! Cameras around a position and of what impostors show. Each is drawn as a main camera.

use drawloom::glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use drawloom::scene::Camera;
use drawloom_testing::random::Random;
use libtest_mimic::Failed;

use crate::Case;
use crate::derived::{as_main, camera_at};
use crate::error_table::{EXTREMES, Extreme, TOUCHING, UNIT_ROUNDOFF, expect_within};
use crate::harness::{BackendName, Harness};
use crate::markers::{BLUE, GREEN, Marker, MarkerScene, RED};
use crate::oracle::View;
use crate::placement::expect_placed;

pub const CASES: &[Case] = &[
    ("the_faces_of_a_cube_map_show_what_webgpu_looks_up_in_them", cube_faces),
    ("impostors_show_what_they_stand_for", impostors),
    ("impostors_of_very_far_things_and_for_very_near_cameras_are_drawn", far_and_near_impostors),
    ("impostors_that_are_kept_show_every_point_near_its_place", kept_from_anywhere),
    ("impostors_that_are_kept_displace_no_more_than_was_allowed", kept_impostors),
];

/// For each face of a cube map, the direction of its middle, and those in which columns and rows follow each other, by
/// the table of WebGPU; of the world, whose Z is mirrored.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::NEG_X, DVec3::NEG_Z, DVec3::NEG_Y],
    [DVec3::Y, DVec3::X, DVec3::NEG_Z],
    [DVec3::NEG_Y, DVec3::X, DVec3::Z],
    [DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y],
    [DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y],
];

const SIDE: u32 = 32;

/// Markers in all directions around a position: in the middle of each face, and across the edges and corners between
/// them. They do not hide each other.
fn all_around(position: DVec3, scale: f64) -> Vec<Marker> {
    let mut markers = Vec::new();
    for (index, direction) in
        (0..27).map(|index| (index, [index % 3, index / 3 % 3, index / 9].map(|step| f64::from(step) - 1.0)))
    {
        let direction = DVec3::from(direction);
        if direction != DVec3::ZERO {
            let toward = direction.normalize();
            let orientation = Quat::from_rotation_arc(Vec3::Z, -toward.as_vec3());
            let (scale, color) = (Vec3::splat((0.5 * scale) as f32), [GREEN, RED, BLUE][index as usize % 3]);
            let position = position + toward * (2.0 * f64::from(scale.x) * 2.0);
            markers.push(Marker { position, orientation, scale, color, double_sided: true });
        }
    }
    markers
}

fn cube_faces(harness: &mut Harness) -> Result<(), Failed> {
    let touching = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
    for Extreme { name, position, scale } in EXTREMES.into_iter().chain([touching]) {
        // At the markers, but for what the shader rounds, or far before them.
        let near = if name == TOUCHING { 2.0 * (1.0 - 40.0 * UNIT_ROUNDOFF) } else { 0.01 * scale };
        for (index, face) in Camera::cube_faces("surroundings", position, SIDE, near as f32).into_iter().enumerate() {
            let [forward, right, down] = FACES[index];
            let mut markers = all_around(position, scale);
            if name == TOUCHING {
                // Those at the edges are across the near plane.
                markers.push(Marker { position: position + forward * 1.9, scale: Vec3::splat(9.0), ..markers[0] });
            }
            let mut scene = MarkerScene::new(as_main(face), markers)?;
            let pose = View { right, up: -down, forward, near, ..View::of(&scene.scene.cameras[0]) };
            scene.view = Some(pose);
            expect_placed(harness, ("cube face", name, &format!("face {index}")), &scene, 1)?;
        }
    }
    Ok(())
}

/// What a camera at `eye` sees through the square of an impostor whose picture is `impostor`.
fn through_square(impostor: &Camera, eye: DVec3, center: DVec3) -> View {
    let axes = DMat3::from_quat(impostor.orientation.as_dquat().normalize());
    let half = impostor.impostor_half_width(center);
    // Along the axis of the square.
    let distance = -axes.z_axis.dot(center - eye);
    let [right, up] = [axes.x_axis, axes.y_axis].map(|axis| axis * (half / distance));
    let view = View { reference: eye, right, up, forward: (center - eye) / distance, ..View::of(impostor) };
    View { near: 0.0, ..view }
}

/// Markers within a sphere, as its picture's camera sees them: a small one before a large one.
fn within_sphere(camera: &Camera, (center, radius): (DVec3, f64)) -> Vec<Marker> {
    let marker = |along: f64, side: f64| {
        let marker = Marker::before(camera, 1.0, side * radius);
        let turn = camera.orientation.as_dquat().normalize();
        Marker { position: center - turn * DVec3::NEG_Z * (along * radius), ..marker }
    };
    vec![
        marker(0.5, 0.5).moved(camera, 0.2 * radius, 0.2 * radius),
        marker(-0.3, 1.0).moved(camera, -0.1 * radius, -0.2 * radius).colored(RED),
    ]
}

fn impostor(camera: &Camera, sphere: (DVec3, f64), before: Option<&Camera>) -> Result<Camera, Failed> {
    let made = camera.impostor("tree", sphere, SIDE, before, MAX_ANGLE);
    made.ok_or_else(|| format!("no impostor of {sphere:?} from {}", camera.position).into())
}

const MAX_ANGLE: f64 = 0.05;

/// A sphere before a camera, a little aside of its axis.
fn sphere_before(camera: &Camera, distance: f64, radius: f64) -> (DVec3, f64) {
    let direction = camera.orientation.as_dquat().normalize() * DVec3::new(0.3, -0.2, -0.9).normalize();
    (camera.position + direction * distance, radius)
}

fn impostors(harness: &mut Harness) -> Result<(), Failed> {
    for extreme in EXTREMES {
        let camera = camera_at(&extreme);
        for distance in [1.5, 5.0, 40.0] {
            let sphere = sphere_before(&camera, distance * extreme.scale, extreme.scale);
            let picture = as_main(impostor(&camera, sphere, None)?);
            let mut scene = MarkerScene::new(picture.clone(), within_sphere(&picture, sphere))?;
            scene.view = Some(through_square(&picture, camera.position, sphere.0));
            let context = format!("{distance} radii away");
            expect_placed(harness, ("impostor", extreme.name, &context), &scene, 2)?;
        }
    }
    Ok(())
}

fn far_and_near_impostors(harness: &mut Harness) -> Result<(), Failed> {
    // Objects of a millimetre to a hundred metres, a metre to 10⁹ m away: the picture of a very far one shows more than
    // its sphere.
    for distance in [1.0, 1e3, 1e6, 1e9] {
        for radius in [1e-3, 1.0, 100.0] {
            if distance <= radius {
                continue;
            }
            let camera = Camera { near: 1e-4, ..camera_at(&Extreme { name: "", position: DVec3::ZERO, scale: 1.0 }) };
            let sphere = sphere_before(&camera, distance, radius);
            let picture = impostor(&camera, sphere, None)?;
            let scene = MarkerScene::new(as_main(picture.clone()), within_sphere(&picture, sphere))?;
            scene.draw(harness)?;
            let half_width = picture.impostor_half_width(sphere.0);
            if half_width < radius * (1.0 - 4.0 * UNIT_ROUNDOFF) {
                return Err(format!("{distance} m: half of the picture is {half_width} m wide, of {radius} m").into());
            }
            if impostor(&camera, sphere, Some(&picture))? != picture {
                return Err(
                    format!("{distance} m: the picture of {radius} m is drawn again for the same camera").into()
                );
            }
        }
    }
    // From the sphere on, there is an impostor.
    for radius in [1e-6, 1.0, 1e6] {
        for above in [4e-16, 1e-12, 1e-9, 1e-6, 1e-3] {
            let camera = camera_at(&Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 });
            let sphere = sphere_before(&camera, radius * (1.0 + above), radius);
            let Some(picture) = camera.impostor("tree", sphere, SIDE, None, MAX_ANGLE) else {
                // The distance was rounded to the radius.
                continue;
            };
            let picture = as_main(picture);
            let mut scene = MarkerScene::new(picture.clone(), within_sphere(&picture, sphere))?;
            scene.view = Some(through_square(&picture, camera.position, sphere.0));
            expect_placed(harness, ("impostor", TOUCHING, &format!("{above:e} above {radius} m")), &scene, 0)?;
        }
        for inside in [0.0, 0.5, 1.0 - 1e-15] {
            let camera = camera_at(&Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 });
            let sphere = sphere_before(&camera, radius * inside, radius);
            if camera.impostor("tree", sphere, SIDE, None, MAX_ANGLE).is_some() {
                return Err(format!("an impostor from {inside} of {radius} m").into());
            }
        }
    }
    Ok(())
}

/// A camera that moved sees through the square what the picture shows, but for what was allowed.
fn kept_impostors(harness: &mut Harness) -> Result<(), Failed> {
    for extreme in EXTREMES {
        let Extreme { name, position, scale } = extreme;
        let camera = camera_at(&extreme);
        let sphere = sphere_before(&camera, 8.0 * scale, scale);
        let before = impostor(&camera, sphere, None)?;
        let around = |axis: DVec3, angle: f64, factor: f64| {
            let turn = DQuat::from_axis_angle(axis, angle);
            Camera { position: sphere.0 + turn * (position - sphere.0) * factor, ..camera.clone() }
        };
        for moved in [around(DVec3::Y, 0.045, 1.0), around(DVec3::X, -0.02, 1.2), around(DVec3::Z, 0.01, 0.9)] {
            if impostor(&moved, sphere, Some(&before))? != before {
                return Err(format!("{name}: the picture is not kept from {}", moved.position).into());
            }
            let picture = as_main(before.clone());
            let mut scene = MarkerScene::new(picture.clone(), within_sphere(&picture, sphere))?;
            scene.view = Some(through_square(&picture, moved.position, sphere.0));
            // `radius · MAX_ANGLE` metres on the square, and a pixel, whose centre decides.
            let pixel = 2.0 * picture.impostor_half_width(sphere.0) / f64::from(SIDE);
            scene.margin = sphere.1 * MAX_ANGLE / pixel + 1.0;
            scene.expect(harness, &format!("{name}, from {}", moved.position), 1)?;
        }
    }
    Ok(())
}

/// From wherever a picture is kept, each point within the sphere is near the ray on which the square shows it.
fn kept_from_anywhere(harness: &mut Harness) -> Result<(), Failed> {
    // It draws nothing, so one backend will do.
    if harness.name() != BackendName::Null {
        return Ok(());
    }
    let mut random = Random::new();
    for extreme in EXTREMES {
        let (radius, mut kept) = (extreme.scale, 0);
        for _ in 0..1000 {
            // From very close to the sphere to far from it.
            let distance = radius * (1.0 + random.between(0.01_f64.ln(), 50_f64.ln()).exp());
            let (camera, max_angle) = (camera_at(&extreme), random.between(0.01, 0.5));
            let sphere = (camera.position + random.direction() * distance, radius);
            let made = camera.impostor("tree", sphere, SIDE, None, max_angle);
            let picture = made.ok_or("there is no impostor outside of the radius")?;
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 1.1 * max_angle));
            let from_center = turn * (camera.position - sphere.0) * (1.0 + random.between(-0.6, 0.6));
            let moved = Camera { position: sphere.0 + from_center, ..camera.clone() };
            if moved.impostor("tree", sphere, SIDE, Some(&picture), max_angle).as_ref() != Some(&picture) {
                continue;
            }
            kept += 1;
            // Relative to the centre of the sphere and of the square.
            let [here, there] = [&moved, &camera].map(|camera| camera.position - sphere.0);
            let normal = picture.orientation.as_dquat().normalize() * DVec3::Z;
            for _ in 0..20 {
                let point = random.direction() * radius * random.between(0.0, 1.0).cbrt();
                let ray = point - there;
                let on_square = there - ray * (normal.dot(there) / normal.dot(ray));
                let displaced = (point - here).cross((on_square - here).normalize()).length() / radius;
                let context = format!("{:?} for {distance} m", here / radius);
                let of_feature = ("impostor that is kept", extreme.name, "of the error allowed");
                expect_within(of_feature, &context, [displaced / max_angle, 1.0])?;
            }
        }
        if kept < 300 {
            return Err(format!("{}: only {kept} pictures are kept", extreme.name).into());
        }
    }
    Ok(())
}
