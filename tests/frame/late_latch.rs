//! Late latching: the camera of a recorded frame is replaced, and no object that the new one sees is missing.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{BackendError, NullBackend};
use drawloom::command::Batch;
use drawloom::glam::{DQuat, DVec3, Quat, Vec2, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{
    Camera, CameraMotion, Changes, ClipPlane, Light, Material, Piece, Projection, Redraw, RenderObject, Scene,
    SceneError, SceneRef, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Granularity, LatchError, Renderer};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{cube, sized};

use crate::renderer;

/// A cube of 2 m, scaled, turned and moved.
struct Cube {
    position: DVec3,
    orientation: DQuat,
    scale: DVec3,
}

impl Cube {
    /// A point of its surface.
    fn surface_point(&self, random: &mut Random) -> DVec3 {
        let mut local: [f64; 3] = std::array::from_fn(|_| match random.below(3) {
            0 => -1.0,
            1 => 1.0,
            _ => random.between(-1.0, 1.0),
        });
        local[random.below(3)] = if random.below(2) == 0 { -1.0 } else { 1.0 };
        self.position + self.orientation * (DVec3::from(local) * self.scale)
    }
}

/// Whether a point is in the picture of a camera, from the camera's definition.
fn sees(camera: &Camera, point: DVec3) -> bool {
    let local = camera.orientation.as_dquat().normalize().inverse() * (point - camera.position);
    let away = -local.z;
    let depth = match camera.projection {
        Projection::Perspective { .. } => away,
        _ => 1.0,
    };
    let half = match camera.projection {
        Projection::Perspective { field_of_view } => (f64::from(field_of_view) * 0.5).tan(),
        Projection::Orthographic { height } => f64::from(height) * 0.5,
        _ => panic!("{:?}", camera.projection),
    };
    let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
    let is_within = |aside: f64, half: f64, shift: f32| {
        let share = aside / (half * depth) - f64::from(shift);
        share.abs() <= 1.0
    };
    // An oblique near plane takes the place of the near plane.
    let begins = match camera.clip_plane {
        Some(plane) if plane.distance(camera.position) < 0.0 => away > 0.0 && plane.distance(point) > 0.0,
        _ => away >= f64::from(camera.near),
    };
    begins
        && away <= f64::from(camera.far)
        && is_within(local.x, half * aspect, camera.shift.x)
        && is_within(local.y, half, camera.shift.y)
}

fn any_camera(random: &mut Random) -> Camera {
    let (position, target) = (random.direction() * random.between(0.0, 4.0), random.direction());
    let mut camera = Camera::looking_at("main", position, position + target);
    camera.orientation = (camera.orientation * Quat::from_rotation_z(random.between(-3.0, 3.0) as f32)).normalize();
    camera.size = [random.below(900) as u32 + 50, random.below(900) as u32 + 50];
    camera.near = [0.05, 1.0, 3.0][random.below(3)];
    match random.below(4) {
        0 => {
            camera.projection = Projection::Orthographic { height: random.between(1.0, 20.0) as f32 };
            camera.far = 30.0;
        }
        1 => {
            camera.projection = Projection::Perspective { field_of_view: random.between(0.05, 3.0) as f32 };
            camera.shift = Vec2::new(random.between(-2.0, 2.0) as f32, random.between(-2.0, 2.0) as f32);
        }
        2 => {
            let normal = random.direction().as_vec3().normalize();
            camera.clip_plane = Some(ClipPlane { point: random.direction() * 5.0, normal });
        }
        _ => camera.far = if random.below(2) == 0 { f32::INFINITY } else { 25.0 },
    }
    camera
}

fn any_motion(random: &mut Random) -> CameraMotion {
    match random.below(4) {
        0 => CameraMotion::from_speeds(5.0, std::f32::consts::PI, Duration::from_millis(16)),
        1 => CameraMotion { distance: random.between(0.0, 3.0) as f32, angle: 0.0 },
        2 => CameraMotion { distance: 0.0, angle: random.between(0.0, 1.0) as f32 },
        _ => CameraMotion { distance: random.between(0.0, 10.0) as f32, angle: random.between(0.0, 3.5) as f32 },
    }
}

/// The camera, moved and turned by shares of a motion.
fn moved(camera: &Camera, motion: CameraMotion, random: &mut Random, [step, turn]: [f64; 2]) -> Camera {
    let axis = random.direction().as_vec3().normalize();
    let turn = Quat::from_axis_angle(axis, motion.angle * turn as f32);
    let position = camera.position + random.direction() * (f64::from(motion.distance) * step);
    Camera { position, orientation: (turn * camera.orientation).normalize(), ..camera.clone() }
}

fn any_share(random: &mut Random) -> f64 {
    if random.below(2) == 0 { 1.0 } else { random.between(0.0, 1.0) }
}

/// Small and large cubes around the origin, whose triangles are culled where they may be, and clusters of others, each a piece.
fn any_scene(random: &mut Random) -> (Scene, Vec<Cube>) {
    let mut scene = Scene::new();
    let meshes = [cube().with_triangle_culling(true), cube()].map(|mesh| scene.add(mesh).unwrap());
    let material = scene.add(Material::default()).unwrap();
    let mut cubes = Vec::new();
    let mut center = DVec3::ZERO;
    for index in 0..180 {
        let is_in_piece = index >= 120;
        if is_in_piece && index % 10 == 0 {
            center = random.direction() * random.between(1.0, 30.0);
            scene.pieces.push(Piece::new(format!("from {index}"), (index..index + 10).collect()));
        }
        let position = match is_in_piece {
            true => center + random.direction() * random.between(0.0, 3.0),
            false => random.direction() * random.between(1.0, 30.0),
        };
        let mesh = meshes[usize::from(is_in_piece)];
        let orientation =
            Quat::from_axis_angle(random.direction().as_vec3().normalize(), random.between(0.0, 3.0) as f32);
        // One in eight hides others.
        let scale = if index % 8 == 0 && !is_in_piece { Vec3::new(4.0, 4.0, 0.1) } else { random.vector(0.02, 0.8) };
        scene.add_object(RenderObject { orientation, scale, ..RenderObject::new(mesh, material, position) }).unwrap();
        cubes.push(Cube { position, orientation: orientation.as_dquat().normalize(), scale: scale.as_dvec3() });
    }
    (scene, cubes)
}

#[test]
fn no_object_that_an_allowed_camera_sees_is_missing() {
    let mut random = Random::new();
    let (mut seen, mut replaced_hidden, mut executed) = (0, 0, 0);
    let volumes = [CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox];
    // Without occlusion tests pieces are executed.
    for (volume, occlusion) in volumes.into_iter().flat_map(|volume| [(volume, Some(8)), (volume, None)]) {
        let quality = Quality { culling: volume, occlusion, ..Quality::balanced() };
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let builder = Renderer::builder(NullBackend).deferred(Deferred::to_picture()).quality(quality);
        let (mut renderer, submitter) = builder.build(scheduler).unwrap();
        for _ in 0..15 {
            let (mut scene, cubes) = any_scene(&mut random);
            // Later frames of a scene keep what did not change.
            for frame in 0..4 {
                let motion = any_motion(&mut random);
                let camera = Camera { late_latch: Some(motion), ..any_camera(&mut random) };
                scene.cameras = vec![camera.clone()];
                let changes = if frame == 0 { Changes::Unknown } else { Changes::Objects(&[]) };
                let mut recorded = renderer.record(SceneRef { changes, ..scene.as_scene_ref() }).unwrap();
                executed += recorded.statistics().views[0].objects_of_pieces;
                let drawn: BTreeSet<u32> = {
                    let list = renderer.draw_list("geometry buffer", 0).unwrap();
                    assert!(
                        (0..list.batches.len()).all(|batch| list.remaining(batch).is_none()),
                        "a triangle is missing"
                    );
                    let objects_of = |batch: &Batch| &list.objects[batch.first as usize..][..batch.count as usize];
                    list.batches.iter().flat_map(objects_of).copied().collect()
                };
                for _ in 0..5 {
                    let shares = [any_share(&mut random), any_share(&mut random)];
                    let newer = moved(&camera, motion, &mut random, shares);
                    recorded.replace_camera(0, &newer).unwrap();
                    assert_eq!(recorded.camera(0).map(|camera| camera.position), Some(newer.position));
                    for (object, cube) in (0..).zip(&cubes) {
                        let mut is_seen_by =
                            |camera: &Camera| (0..12).any(|_| sees(camera, cube.surface_point(&mut random)));
                        if is_seen_by(&newer) {
                            seen += 1;
                            assert!(drawn.contains(&object), "{newer:?} sees {object}, recorded by {camera:?}");
                            replaced_hidden += usize::from(!is_seen_by(&camera));
                        }
                    }
                }
                submitter.submit(recorded).unwrap();
            }
        }
    }
    assert!(
        seen > 10_000 && replaced_hidden > 2_000 && executed > 1_000,
        "{seen} seen, {replaced_hidden} of them not by the recorded camera; {executed} drawn as a piece"
    );
}

#[test]
fn a_light_that_reaches_what_an_allowed_camera_sees_reaches_the_view() {
    let (mut random, (mut renderer, _)) = (Random::stream(1), renderer(1, Granularity::default()));
    let mut count = 0;
    for _ in 0..3000 {
        let motion = any_motion(&mut random);
        let camera = Camera { clip_plane: None, late_latch: Some(motion), ..any_camera(&mut random) };
        let (position, range) = (random.direction() * random.between(0.0, 30.0), random.between(0.1, 2.0) as f32);
        let mut scene = Scene::new();
        scene.lights.push(Light::Point { position, range, intensity: Vec3::splat(100.0), casts_shadow: true });
        scene.cameras = vec![camera.clone()];
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let newer = moved(&camera, motion, &mut random, [1.0, 1.0]);
        let lit = position + random.direction() * (f64::from(range) * 0.99);
        if sees(&newer, lit) {
            count += 1;
            let statistics = recorded.statistics();
            // Its shadow maps are views too.
            assert_eq!((statistics.views[0].lights, statistics.views.len()), (1, 7), "{newer:?}");
        }
    }
    assert!(count > 100, "{count}");
}

#[test]
fn a_replacement_beyond_the_motion_is_refused_and_changes_nothing() {
    let (mut random, (mut renderer, submitter)) = (Random::stream(2), renderer(1, Granularity::default()));
    for _ in 0..200 {
        let motion = any_motion(&mut random);
        let camera = Camera { late_latch: Some(motion), ..any_camera(&mut random) };
        let mut scene = Scene::new();
        scene.cameras = vec![camera.clone()];
        let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let too_far = CameraMotion { distance: motion.distance + 1e-3, ..motion };
        let mut refused = vec![(moved(&camera, too_far, &mut random, [1.0, 0.0]), true)];
        if motion.angle < 3.0 {
            let too_wide = CameraMotion { angle: motion.angle + 1e-3, ..motion };
            refused.push((moved(&camera, too_wide, &mut random, [0.0, 1.0]), false));
        }
        for (newer, is_distance) in refused {
            let error = recorded.replace_camera(0, &newer).unwrap_err();
            let LatchError::BeyondMotion { view, distance, angle, allowed } = &error else { panic!("{error}") };
            assert_eq!((view.as_str(), *allowed), ("main", motion));
            assert_eq!(
                (*distance > f64::from(motion.distance), *angle > f64::from(motion.angle) + 5e-4),
                (is_distance, !is_distance)
            );
            assert_eq!(recorded.camera(0), Some(&camera));
        }
        recorded.replace_camera(0, &moved(&camera, motion, &mut random, [1.0, 1.0])).unwrap();
        submitter.submit(recorded).unwrap();
    }
}

#[test]
fn only_a_camera_that_differs_in_position_and_orientation_replaces_another() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    let motion = CameraMotion { distance: 1.0, angle: 1.0 };
    let latched = Camera { late_latch: Some(motion), ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let mut scene = Scene::new();
    scene.cameras = vec![latched.clone(), Camera::looking_at("second", DVec3::ZERO, DVec3::X)];
    let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let plane = ClipPlane { point: DVec3::ZERO, normal: Vec3::X };
    let different = [
        ("name", Camera { name: "other".to_owned(), ..latched.clone() }),
        ("projection", Camera { projection: Projection::Perspective { field_of_view: 1.0 }, ..latched.clone() }),
        ("shift", Camera { shift: Vec2::X, ..latched.clone() }),
        ("clip_plane", Camera { clip_plane: Some(plane), ..latched.clone() }),
        ("near", Camera { near: 1.0, ..latched.clone() }),
        ("far", Camera { far: 10.0, ..latched.clone() }),
        ("size", sized(latched.clone(), [10, 10])),
        ("samples_views", Camera { samples_views: false, ..latched.clone() }),
        ("kind", Camera { kind: ViewKind::Reflection, ..latched.clone() }),
        ("redraw", Camera { redraw: Redraw::OnCameraChange, ..latched.clone() }),
    ];
    for (expected, camera) in different {
        let error = recorded.replace_camera(0, &camera).unwrap_err();
        let LatchError::DifferentCamera { view, property } = &error else { panic!("{error}") };
        assert_eq!((view.as_str(), *property), ("main", expected));
        assert!(error.to_string().contains(expected), "{error}");
    }
    let invalid = Camera { position: DVec3::NAN, ..latched.clone() };
    assert!(matches!(recorded.replace_camera(0, &invalid), Err(LatchError::InvalidCamera(_))));
    let invalid = Camera { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0), ..latched.clone() };
    assert!(matches!(recorded.replace_camera(0, &invalid), Err(LatchError::InvalidCamera(_))));
    assert!(matches!(recorded.replace_camera(1, &scene.cameras[1]), Err(LatchError::NotAllowed { .. })));
    let unknown = recorded.replace_camera(2, &latched);
    assert!(matches!(unknown, Err(LatchError::UnknownView { view: 2, count: 2 })));
    // What the motion of the new camera is makes no difference.
    recorded.replace_camera(0, &Camera { late_latch: None, ..latched.clone() }).unwrap();
    assert_eq!(recorded.camera(1), Some(&scene.cameras[1]));
    assert_eq!(recorded.camera(2), None);
}

#[test]
fn a_camera_that_leaves_the_world_is_refused() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    let position = DVec3::X * (drawloom::view::FixedPosition::MAX_COORDINATE - 1.0);
    let motion = CameraMotion { distance: 10.0, angle: 0.0 };
    let camera = Camera { late_latch: Some(motion), ..Camera::looking_at("main", position, DVec3::ZERO) };
    let mut scene = Scene::new();
    scene.cameras = vec![camera.clone()];
    let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let outside = Camera { position: position + DVec3::X * 5.0, ..camera.clone() };
    let refused = recorded.replace_camera(0, &outside);
    assert!(matches!(refused, Err(LatchError::Backend(BackendError::ViewOutOfReach { .. }))));
    assert_eq!(recorded.camera(0), Some(&camera));
}

#[test]
fn derived_cameras_follow_one_that_moves_within_its_bounds() {
    let (mut random, (mut renderer, _)) = (Random::stream(3), renderer(1, Granularity::default()));
    for _ in 0..100 {
        let motion = any_motion(&mut random);
        let mut camera = Camera { late_latch: Some(motion), ..any_camera(&mut random) };
        camera.clip_plane = None;
        let plane = ClipPlane { point: random.direction(), normal: random.direction().as_vec3().normalize() };
        let portal = |random: &mut Random| (random.direction(), Quat::from_rotation_y(random.between(0.0, 3.0) as f32));
        let (entry, exit) = (portal(&mut random), portal(&mut random));
        let derived = |camera: &Camera| {
            let mut cameras = vec![camera.tile([1, 0], 2), camera.jittered(Vec2::new(0.3, -0.2))];
            cameras.push(camera.reflected("mirror", plane));
            cameras.push(camera.through_portal("portal", entry, exit));
            cameras.iter_mut().for_each(|camera| camera.kind = ViewKind::Main);
            cameras
        };
        let mut scene = Scene::new();
        scene.cameras = derived(&camera);
        let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let newer = moved(&camera, motion, &mut random, [1.0, 1.0]);
        for (view, camera) in derived(&newer).iter().enumerate() {
            recorded.replace_camera(view, camera).unwrap();
        }
    }
}

#[test]
fn a_motion_that_no_view_can_have_is_refused() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    let camera = Camera { far: 10.0, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let with = |distance, angle| Camera { late_latch: Some(CameraMotion { distance, angle }), ..camera.clone() };
    let invalid = [
        (with(-1.0, 0.0), "distance"),
        (with(f32::NAN, 0.0), "distance"),
        (with(2e6, 0.0), "distance"),
        (with(0.0, -0.1), "angle"),
        (with(0.0, f32::INFINITY), "angle"),
        (Camera { kind: ViewKind::Shadow, ..with(0.0, 0.0) }, "shadow"),
        (Camera { redraw: Redraw::OnCameraChange, ..with(0.0, 0.0) }, "redrawn"),
    ];
    for (camera, expected) in invalid {
        let mut scene = Scene::new();
        scene.cameras = vec![camera];
        let Err(FrameError::Scene(SceneError::InvalidCamera { reason, .. })) = renderer.record(scene.as_scene_ref())
        else {
            panic!("{expected}")
        };
        assert!(reason.contains(expected), "{reason}");
    }
}
