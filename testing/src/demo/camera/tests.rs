use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Light, Material, Mesh, Projection, RenderObject, Scene, SceneRef, Topology, Vertex};

use super::{camera, camera_upright};
use crate::demo::frame_check::draw_whole;
use crate::demo::{UpAxis, lights};

/// The sides of a cube: the normal, and two directions along the side.
const SIDES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::Y, Vec3::Z],
    [Vec3::NEG_X, Vec3::Z, Vec3::Y],
    [Vec3::Y, Vec3::Z, Vec3::X],
    [Vec3::NEG_Y, Vec3::X, Vec3::Z],
    [Vec3::Z, Vec3::X, Vec3::Y],
    [Vec3::NEG_Z, Vec3::Y, Vec3::X],
];

/// A cube without the side whose normal is `without`. Its front faces are inside or outside.
fn cube(without: Vec3, inward: bool) -> Mesh {
    let mut vertices = Vec::new();
    for [normal, right, up] in SIDES.into_iter().filter(|side| side[0] != without) {
        for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let facing = if inward { -normal } else { normal };
            let position = normal + right * x + up * y;
            vertices.push(Vertex { position: position.into(), normal: facing.into(), uv: [0.0; 2] });
        }
    }
    if inward {
        vertices.chunks_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
    let indices = (0..vertices.len() as u32).collect();
    Mesh::new("cube", Topology::TriangleList, vertices, indices).unwrap()
}

/// Cubes at one position, each with a mesh and a scale.
fn scene_of(cubes: &[(Mesh, Vec3)], position: DVec3) -> Scene {
    let mut scene = Scene::new();
    let material = scene.add(Material::default()).unwrap();
    for (mesh, scale) in cubes {
        let mesh = scene.add(mesh.clone()).unwrap();
        let object = RenderObject { scale: *scale, ..RenderObject::new(mesh, material, position) };
        scene.add_object(object).unwrap();
    }
    scene
}

/// Draws nothing but a camera and lights, and panics if one of them is invalid.
fn draw(camera: &Camera, lights: &[Light]) {
    draw_whole(SceneRef { cameras: std::slice::from_ref(camera), lights, ..Scene::new().as_scene_ref() });
}

/// The camera for a scene of that size at that position, normalised to size 1 at the origin.
fn camera_of(meshes: &[(Mesh, Vec3)], size: f32, position: DVec3) -> Camera {
    let scaled: Vec<_> = meshes.iter().map(|(mesh, scale)| (mesh.clone(), *scale * size)).collect();
    let scene = scene_of(&scaled, position);
    let camera = camera(scene.as_scene_ref());
    draw(&camera, &lights(scene.as_scene_ref(), &camera));
    Camera { position: (camera.position - position) / f64::from(size), near: camera.near / size, ..camera }
}

fn forward(camera: &Camera) -> Vec3 {
    camera.orientation * Vec3::NEG_Z
}

/// Runs `check` for several sizes and positions of the scene.
fn for_sizes_and_positions(check: impl Fn(f32, DVec3)) {
    for (size, position) in [
        (1.0, DVec3::ZERO),
        (1e-6, DVec3::ZERO),
        (1e-6, DVec3::new(3.0, -5.0, 7.0)),
        (1e7, DVec3::new(-1e9, 1e8, 0.0)),
        (1.0, DVec3::new(1e9, -1e9, 1e9)),
    ] {
        check(size, position);
    }
}

#[test]
fn in_a_room_the_camera_stands_inside_and_looks_along_it() {
    let room = Vec3::new(3.0, 1.0, 1.0);
    for_sizes_and_positions(|size, position| {
        let camera = camera_of(&[(cube(Vec3::ZERO, true), room)], size, position);
        assert!(camera.position.abs().cmplt(room.as_dvec3()).all(), "{camera:?}");
        assert!(camera.position.y < 0.0, "above eye height: {camera:?}");
        let forward = forward(&camera);
        assert!(forward.x.abs() > 0.8, "not along the room: {forward}");
        assert!(camera.position.x * f64::from(forward.x) < 0.0, "away from the far end: {camera:?}");
        assert!(camera.near > 1e-4 && camera.near < 0.02, "{camera:?}");
    });
}

#[test]
fn the_camera_looks_in_through_a_missing_wall() {
    for side in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        for_sizes_and_positions(|size, position| {
            let camera = camera_of(&[(cube(side, true), Vec3::ONE)], size, position);
            assert!(forward(&camera).abs_diff_eq(-side, 1e-3), "{side} {camera:?}");
            let outside = camera.position.dot(side.as_dvec3());
            assert!((2.0..5.0).contains(&outside), "{side} {camera:?}");
            assert_fits(&camera, Vec3::ONE);
        });
    }
}

#[test]
fn a_courtyard_is_a_room() {
    let camera = camera_of(&[(cube(Vec3::Y, true), Vec3::new(1.0, 1.0, 3.0))], 1.0, DVec3::ZERO);
    assert!(camera.position.abs().cmplt(DVec3::new(1.0, 1.0, 3.0)).all(), "{camera:?}");
    assert!(forward(&camera).z.abs() > 0.8, "{camera:?}");
}

#[test]
fn an_object_is_shown_whole_from_outside_and_above() {
    for half_size in [Vec3::ONE, Vec3::new(0.1, 4.0, 0.1), Vec3::new(5.0, 0.2, 1.0)] {
        for_sizes_and_positions(|size, position| {
            let camera = camera_of(&[(cube(Vec3::ZERO, false), half_size)], size, position);
            let outside = camera.position.abs() / half_size.as_dvec3();
            assert!(outside.max_element() > 1.0 && camera.position.y > 0.0, "{camera:?}");
            assert_fits(&camera, half_size);
        });
    }
}

#[test]
fn a_hollow_object_is_no_room() {
    let walls = [(cube(Vec3::ZERO, true), Vec3::splat(0.8)), (cube(Vec3::ZERO, false), Vec3::ONE)];
    let camera = camera_of(&walls, 1.0, DVec3::ZERO);
    assert!(camera.position.length() > 2.0, "{camera:?}");
}

#[test]
fn a_single_face_is_seen_from_its_front() {
    let face = cube(Vec3::ZERO, false);
    let of_side = |vertex: &&Vertex| Vec3::from(vertex.normal) == Vec3::NEG_Z;
    let vertices: Vec<_> = face.vertices().iter().filter(of_side).copied().collect();
    assert_eq!(vertices.len(), 6);
    let mesh = Mesh::new("face", Topology::TriangleList, vertices, (0..6).collect()).unwrap();
    let camera = camera_of(&[(mesh, Vec3::ONE)], 1.0, DVec3::ZERO);
    assert!(camera.position.z < -1.0, "{camera:?}");
}

/// A square of `divisions`² pairs of triangles, of size 2 around the origin, whose front is towards +Z.
fn square(divisions: usize) -> Mesh {
    let step = 2.0 / divisions as f32;
    let vertices = (0..divisions * divisions).flat_map(|cell| {
        let corner =
            Vec3::new((cell % divisions) as f32, (cell / divisions) as f32, 0.0) * step - Vec3::new(1.0, 1.0, 0.0);
        let positions = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]
            .map(|[x, y]| corner + Vec3::new(x as f32, y as f32, 0.0) * step);
        positions.map(|position| Vertex { position: position.into(), normal: Vec3::Z.into(), uv: [0.0; 2] })
    });
    let vertices: Vec<_> = vertices.collect();
    let indices = (0..vertices.len() as u32).collect();
    Mesh::new("square", Topology::TriangleList, vertices, indices).unwrap()
}

fn scaled(mesh: Mesh, factor: f32) -> Mesh {
    let scale = |vertex: &Vertex| Vertex { position: vertex.position.map(|value| value * factor), ..*vertex };
    let vertices = mesh.vertices().iter().map(scale).collect();
    Mesh::new("scaled", mesh.topology(), vertices, mesh.indices().to_vec()).unwrap()
}

/// Adds an object that is turned around the vertical.
fn add(scene: &mut Scene, mesh: Mesh, position: DVec3, turn: f32) {
    let mesh = scene.add(mesh).unwrap();
    let material = scene.add(Material::default()).unwrap();
    let orientation = Quat::from_rotation_y(turn);
    scene.add_object(RenderObject { orientation, ..RenderObject::new(mesh, material, position) }).unwrap();
}

#[test]
fn an_object_is_shown_from_before_its_backdrop() {
    for number in 0..8 {
        let turn = number as f32 / 8.0 * std::f32::consts::TAU;
        let front = Quat::from_rotation_y(turn) * Vec3::Z;
        let mut scene = Scene::new();
        let small = scaled(cube(Vec3::ZERO, false), 0.3);
        add(&mut scene, small, (front * 0.5).as_dvec3(), turn);
        add(&mut scene, square(1), DVec3::ZERO, turn);
        let camera = camera(scene.as_scene_ref());
        let before = camera.position.normalize().dot(front.as_dvec3());
        assert!(before > 0.3, "{turn}: {camera:?}");
    }
}

#[test]
fn a_model_is_shown_from_the_side_with_the_detail() {
    for number in 0..4 {
        let turn = number as f32 / 4.0 * std::f32::consts::TAU;
        let front = Quat::from_rotation_y(turn) * Vec3::Z;
        let mut scene = Scene::new();
        add(&mut scene, cube(Vec3::Z, false), DVec3::ZERO, turn);
        add(&mut scene, square(20), front.as_dvec3(), turn);
        let camera = camera(scene.as_scene_ref());
        assert!(camera.position.normalize().dot(front.as_dvec3()) > 0.5, "{turn}: {camera:?}");
    }
}

#[test]
fn a_scene_with_z_up_is_shown_as_the_same_scene_with_y_up() {
    let to_z_up = |vector: DVec3| DVec3::new(vector.x, -vector.z, vector.y);
    let rotation = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let bodies = [(DVec3::new(0.0, 0.5, 0.0), Vec3::new(2.0, 0.5, 1.0)), (DVec3::new(1.5, 2.0, 3.0), Vec3::splat(0.6))];
    let scene = |is_z_up: bool| {
        let mut scene = Scene::new();
        let (mesh, material) = (scene.add(cube(Vec3::ZERO, false)).unwrap(), scene.add(Material::default()).unwrap());
        for (position, scale) in bodies {
            let object = RenderObject { scale, ..RenderObject::new(mesh, material, position) };
            let turned = RenderObject { position: to_z_up(position), orientation: rotation, ..object };
            scene.add_object(if is_z_up { turned } else { object }).unwrap();
        }
        scene
    };
    let upright = camera(scene(false).as_scene_ref());
    let turned = camera_upright(scene(true).as_scene_ref(), UpAxis::Z);
    assert!(to_z_up(upright.position).abs_diff_eq(turned.position, 1e-4), "{upright:?} {turned:?}");
    let up = turned.orientation * Vec3::Y;
    assert!(up.abs_diff_eq(rotation * (upright.orientation * Vec3::Y), 1e-4) && up.z > 0.8, "{turned:?}");
    // And it is not what the scene gets if nobody says so.
    assert!(!camera(scene(true).as_scene_ref()).position.abs_diff_eq(turned.position, 0.1));
    let nothing = camera_upright(Scene::new().as_scene_ref(), UpAxis::Z);
    assert!((nothing.orientation * Vec3::Y).z > 0.8 && nothing.position.z > 0.0, "{nothing:?}");
}

#[test]
fn an_outlier_changes_neither_the_view_nor_the_lights() {
    let box_size = Vec3::new(1.0, 2.0, 1.0);
    let alone = camera_of(&[(cube(Vec3::ZERO, false), box_size)], 1.0, DVec3::ZERO);
    for distance in [1e5, -1e9, 1e30] {
        let mut scene = scene_of(&[(cube(Vec3::ZERO, false), box_size)], DVec3::ZERO);
        add(&mut scene, square(1), DVec3::new(distance, 0.0, 0.0), 0.0);
        let camera = camera(scene.as_scene_ref());
        assert_eq!((camera.position, camera.near), (alone.position, alone.near), "{distance}");
        let [_, _, Light::Point { position, .. }] = lights(scene.as_scene_ref(), &camera) else {
            panic!("no point light")
        };
        assert!(position.length() < 10.0, "{distance}: {position}");
    }
    // What is as large as it is far is no outlier.
    let mut scene = scene_of(&[(cube(Vec3::ZERO, false), Vec3::ONE)], DVec3::ZERO);
    add(&mut scene, scaled(square(1), 1e4), DVec3::new(0.0, 0.0, -1.0), 0.0);
    assert!(camera(scene.as_scene_ref()).position.length() > 1e4);
}

/// Fails unless every corner of the box is in the picture, and the box fills at least half of its width or height.
fn assert_fits(camera: &Camera, half_size: Vec3) {
    let Projection::Perspective { field_of_view } = camera.projection else { panic!("{camera:?}") };
    let slope = (field_of_view / 2.0).tan();
    let mut max = Vec3::ZERO;
    for corner in 0..8 {
        let sign = |bit: u32| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
        let point = Vec3::new(sign(0), sign(1), sign(2)) * half_size;
        let seen = camera.orientation.inverse() * (point.as_dvec3() - camera.position).as_vec3();
        assert!(-seen.z > camera.near, "behind the camera");
        let projected = Vec3::new(seen.x / camera.aspect(), seen.y, 0.0) / (-seen.z * slope);
        max = max.max(projected.abs());
    }
    assert!(max.max_element() <= 1.0, "outside the picture: {max}");
    assert!(max.max_element() > 0.5, "small in the picture: {max}");
}

#[test]
fn the_point_light_reaches_the_scene_at_every_size() {
    for_sizes_and_positions(|size, position| {
        let scene = scene_of(&[(cube(Vec3::ZERO, false), Vec3::splat(size))], position);
        let camera = camera(scene.as_scene_ref());
        let [_, _, Light::Point { position: light, intensity, range, .. }] = lights(scene.as_scene_ref(), &camera)
        else {
            panic!("no point light");
        };
        let distance = light.distance(position);
        assert!(distance < f64::from(range) / 2.0, "{distance} {range}");
        let illuminance = f64::from(intensity.x) / (distance * distance);
        assert!((0.05..5.0).contains(&illuminance), "{illuminance}");
    });
}

#[test]
fn a_scene_with_nothing_to_draw_gets_a_camera() {
    let empty = Scene::new();
    draw(&camera(empty.as_scene_ref()), &[]);
    lights(empty.as_scene_ref(), &camera(empty.as_scene_ref()));

    let mut flat = scene_of(&[(cube(Vec3::ZERO, false), Vec3::ZERO)], DVec3::ZERO);
    draw(&camera(flat.as_scene_ref()), &[]);
    let mesh = flat.object(flat.objects().next().unwrap()).unwrap().mesh;
    flat.remove(mesh).unwrap();
    draw(&camera(flat.as_scene_ref()), &[]);

    let scene = scene_of(&[(cube(Vec3::ZERO, false), Vec3::ONE)], DVec3::ZERO);
    let broken = SceneRef { positions: &[DVec3::NAN], ..scene.as_scene_ref() };
    draw(&camera(broken), &[]);
    let unequal = SceneRef { meshes: &[], ..scene.as_scene_ref() };
    draw(&camera(unequal), &[]);
    let turned = SceneRef { orientations: &[Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)], ..scene.as_scene_ref() };
    draw(&camera(turned), &[]);
}
