//! Derived cameras that cannot be: an error names them, and the next frame is right.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, ClipPlane, Projection, SceneError};
use libtest_mimic::Failed;

use crate::Case;
use crate::derived::as_main;
use crate::harness::{Harness, Outcome};
use crate::markers::{Marker, MarkerScene, camera, with_context};

pub const CASES: &[Case] = &[
    ("cameras_derived_from_what_is_no_number_are_refused_by_name", refused),
    ("a_camera_that_looks_almost_straight_up_sees_what_it_looks_at", almost_vertical),
];

const SIZE: [u32; 2] = [48, 32];

/// Numbers that no position has.
const NO_POSITIONS: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e11];

fn refused(harness: &mut Harness) -> Result<(), Failed> {
    let main = camera(SIZE);
    let whole = MarkerScene::new(main.clone(), [Marker::before(&main, 5.0, 2.0)])?;
    for camera in wrong_cameras(&main) {
        let context = format!("{}: {:?} {:?}", camera.name, camera.position, camera.clip_plane);
        let scene = MarkerScene::new(as_main(camera.clone()), [Marker::before(&main, 5.0, 2.0)])?;
        match harness.outcome(&scene.scene.as_scene_ref())? {
            Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { camera: named, .. }))
                if named == camera.name => {}
            Outcome::Refused(FrameError::Backend(BackendError::ViewOutOfReach { view })) if view == camera.name => {}
            Outcome::Refused(FrameError::EmptyTarget { .. }) if camera.size.contains(&0) => {}
            Outcome::Refused(other) => return Err(format!("{context}: {other}").into()),
            Outcome::NotSubmitted(other) => return Err(format!("{context}: {other}").into()),
            Outcome::Drawn(_) => return Err(format!("{context}: it was drawn").into()),
        }
        whole.expect(harness, "the frame after", 1).map_err(|failed| with_context(&context, failed))?;
    }
    Ok(())
}

fn wrong_cameras(main: &Camera) -> Vec<Camera> {
    let mut cameras = Vec::new();
    let normals = [Vec3::ZERO, Vec3::NAN, Vec3::X * 1e-20, Vec3::X * 2.0, Vec3::splat(f32::MAX), Vec3::INFINITY];
    let mut planes: Vec<_> = normals.map(|normal| ClipPlane { point: DVec3::NEG_Z, normal }).into();
    planes.extend(NO_POSITIONS.map(|x| ClipPlane { point: DVec3::new(x, 0.0, -1.0), normal: Vec3::X }));
    for plane in planes {
        cameras.push(main.reflected("mirror", plane));
    }
    let parallel = Camera { projection: Projection::Orthographic { height: 5.0 }, far: 100.0, ..main.clone() };
    cameras.push(parallel.reflected("mirror", ClipPlane { point: DVec3::NEG_Z, normal: Vec3::NAN }));
    cameras.push(parallel.reflected("mirror", ClipPlane { point: DVec3::NEG_Z, normal: Vec3::ZERO }));
    let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let (usual, nowhere) = ((DVec3::NEG_Z, Quat::IDENTITY), NO_POSITIONS.map(|x| (DVec3::Y * x, Quat::IDENTITY)));
    let turned = [zero, Quat::NAN, Quat::IDENTITY * f32::INFINITY].map(|orientation| (DVec3::NEG_Z, orientation));
    for wrong in turned.into_iter().chain(nowhere) {
        cameras.extend([main.through_portal("window", wrong, usual), main.through_portal("window", usual, wrong)]);
    }
    for x in NO_POSITIONS {
        cameras.push(Camera::cube_faces("surroundings", DVec3::Z * x, 32, 0.05)[2].clone());
    }
    for near in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE] {
        cameras.push(Camera::cube_faces("surroundings", DVec3::ZERO, 32, near)[5].clone());
    }
    cameras.push(Camera::cube_faces("surroundings", DVec3::ZERO, 0, 0.05)[0].clone());
    for count in [1 << 24, u32::MAX] {
        cameras.extend([main.tile([0, 0], count), parallel.tile([count / 2, count - 1], count)]);
    }
    for radius in [f64::NAN, -1.0, f64::NEG_INFINITY] {
        cameras.extend(main.impostor("tree", (main.position + DVec3::Z * 9.0, radius), 32, None, 0.05));
    }
    cameras
}

/// The smaller the angle, the smaller the products that its right vector is made of.
fn almost_vertical(harness: &mut Harness) -> Result<(), Failed> {
    for up in [1.0, -1.0, 1e9, 1e-9, 1e200, -1e-200] {
        for aside in
            [0.0, 1e-300, 1e-170, 1e-30, 1e-23, 1e-22, 3e-22, 1e-21, 1e-20, 1e-18, 1e-16, 3e-16, 1e-15, 1e-8, 1e-3]
        {
            for direction in [DVec3::new(aside, 1.0, 0.0), DVec3::new(-aside, 1.0, aside), DVec3::new(0.0, 1.0, -aside)]
            {
                let camera = Camera { size: SIZE, ..Camera::looking_at("main", DVec3::ZERO, direction * up) };
                let turn = camera.orientation.as_dquat().normalize();
                let direction = direction.normalize() * f64::signum(up);
                // The quaternion was rounded to f32.
                let off = (turn * DVec3::NEG_Z).distance(direction);
                if off.is_nan() || off > 4.0 * crate::error_table::UNIT_ROUNDOFF {
                    return Err(format!("{direction:?} times {up:e}: it looks past it by {off:e}").into());
                }
                if (turn * DVec3::X).y.abs() > 4.0 * crate::error_table::UNIT_ROUNDOFF {
                    return Err(format!("{direction:?} times {up:e}: its right vector is {}", turn * DVec3::X).into());
                }
            }
        }
        let camera =
            Camera { size: SIZE, ..Camera::looking_at("main", DVec3::ZERO, DVec3::new(1e-22, 1.0, 3e-23) * up) };
        let ahead = Marker { position: DVec3::Y * (5.0 * up.signum()), ..Marker::before(&camera, 5.0, 2.0) };
        MarkerScene::new(camera, [ahead])?.expect(harness, &format!("up {up:e}"), 1)?;
    }
    Ok(())
}
