//! Random scenes compared with their pictures.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::Quality;
use drawloom::scene::{Blend, Camera, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex};
use drawloom_testing::samples::Samples;
use drawloom_testing::scenes::{cube, square};
use proptest::prelude::*;

use crate::occlusion;

/// An object's mesh, material, position, scale and orientation.
type ObjectSpec = (usize, usize, [f64; 3], [f32; 3], [f32; 4]);

/// A wedge with a sharp end, whose vertices are rotated, and a tray: a box without its lid.
fn wedge_and_tray() -> [Mesh; 2] {
    let rotation = Quat::from_rotation_y(0.7) * Quat::from_rotation_z(0.3);
    let vertex = |point: Vec3| Vertex { position: (rotation * point).to_array(), ..Vertex::default() };
    let at = |x: f32, y: f32, z: f32| vertex(Vec3::new(x, y, z));
    let vertices = vec![
        at(-1.0, -1.0, -0.1),
        at(-1.0, 1.0, -0.1),
        at(-1.0, -1.0, 0.1),
        at(-1.0, 1.0, 0.1),
        at(1.0, -1.0, 0.0),
        at(1.0, 1.0, 0.0),
    ];
    let faces = vec![0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4, 2, 4, 5, 2, 5, 3, 0, 4, 2, 1, 3, 5];
    let whole = cube();
    let tray = Mesh::new("tray", Topology::TriangleList, whole.vertices().to_vec(), whole.indices()[6..].to_vec());
    [Mesh::new("wedge", Topology::TriangleList, vertices, faces).unwrap(), tray.unwrap()]
}

fn scene_of(specs: &[ObjectSpec], camera: Camera) -> Scene {
    let mut scene = Scene::new();
    let [wedge, tray] = wedge_and_tray();
    let meshes = [cube(), square(Topology::TriangleStrip), wedge, tray].map(|mesh| scene.add(mesh).unwrap());
    let materials = [(Blend::None, false), (Blend::None, true), (Blend::Alpha, false)].map(|(blend, double_sided)| {
        scene.add(Material { blend, double_sided, opacity: 0.5, ..Material::default() }).unwrap()
    });
    for &(mesh, material, position, scale, turn) in specs {
        let position = camera.position + DVec3::from(position);
        let object = RenderObject::new(meshes[mesh], materials[material], position);
        let orientation = Quat::from_array(turn).normalize();
        scene.add_object(RenderObject { scale: Vec3::from(scale), orientation, ..object }).unwrap();
    }
    scene.cameras = vec![camera];
    scene
}

prop_compose! {
    fn object_spec(far: f64, large: f32)(
        mesh in 0_usize..4,
        material in prop::sample::select(vec![0_usize, 0, 0, 1, 1, 2]),
        position in prop::array::uniform3(-far..far),
        scale in prop::array::uniform3(-large..large),
        exponent in -2.0..0.0_f32,
        turn in prop::array::uniform4(-1.0..1.0_f32),
        is_upright in prop::bool::ANY,
    ) -> ObjectSpec {
        let turn = if is_upright || turn.iter().all(|part| part.abs() < 0.1) { [0.0, 0.0, 0.0, 1.0] } else { turn };
        (mesh, material, position, scale.map(|side| side * 10_f32.powf(exponent)), turn)
    }
}

prop_compose! {
    fn any_camera()(
        position in prop::array::uniform3(-1.0..1.0_f64),
        exponent in 0.0..6.0_f64,
        towards in prop::array::uniform3(-1.0..1.0_f64),
        degrees in 20.0..140.0_f32,
        size in prop::array::uniform2(17_u32..90),
        near in -2.0..0.5_f32,
        is_orthographic in prop::bool::weighted(0.2),
    ) -> Camera {
        let position = DVec3::from(position) * 10_f64.powf(exponent);
        let mut camera = Camera::looking_at("any", position, position + DVec3::from(towards));
        camera.size = size;
        camera.near = 10_f32.powf(near);
        camera.projection = Projection::Perspective { field_of_view: degrees.to_radians() };
        if is_orthographic {
            camera.projection = Projection::Orthographic { height: degrees * 0.3 };
            camera.far = 60.0;
        }
        camera
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Objects of all sizes around the camera: some cross the near plane, many intersect each other.
    #[test]
    fn no_visible_object_is_culled(
        specs in prop::collection::vec(object_spec(30.0, 40.0), 1..40),
        camera in any_camera(),
    ) {
        let scene = scene_of(&specs, camera);
        let scene = scene.as_scene_ref();
        let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
        for tile_size in Quality::OCCLUSION_TILE_SIZES {
            let (_, hidden) = occlusion(&scene, tile_size);
            for object in 0..specs.len() {
                prop_assert!(!(hidden[object] && samples.shown[object]), "{object} at {tile_size}: {:?}", specs[object]);
            }
        }
    }

    /// A wall, and small objects in front of it and behind it, all around its outline.
    #[test]
    fn no_object_visible_past_an_outline_is_culled(
        wall in (0.5..6.0_f32, 0.5..6.0_f32, 0.001..2.0_f32, prop::array::uniform4(-1.0..1.0_f32)),
        specs in prop::collection::vec((-1.2..1.2_f64, -1.2..1.2_f64, 0.0..30.0_f64, 0.01..0.5_f32), 30..60),
        camera in any_camera(),
    ) {
        let (width, height, depth, turn) = wall;
        let (forward, right) = (camera.orientation.as_dquat() * DVec3::NEG_Z, camera.orientation.as_dquat() * DVec3::X);
        let up = right.cross(forward);
        let distance = 8.0;
        let turn = (Quat::from_array(turn) + Quat::IDENTITY * 2.1).normalize();
        let orientation = (camera.orientation * Quat::IDENTITY.slerp(turn, 0.3)).to_array();
        let mut all = vec![(0, 0, (forward * distance).to_array(), [width, height, depth], orientation)];
        for (x, y, behind, size) in specs {
            let offset = right * (x * f64::from(width)) + up * (y * f64::from(height));
            let position = (offset + forward * distance) * (1.0 + behind / distance);
            all.push((0, 0, position.to_array(), [size; 3], orientation));
        }
        let scene = scene_of(&all, camera);
        let scene = scene.as_scene_ref();
        let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
        for tile_size in Quality::OCCLUSION_TILE_SIZES {
            let (_, hidden) = occlusion(&scene, tile_size);
            for object in 0..all.len() {
                prop_assert!(!(hidden[object] && samples.shown[object]), "{object} at {tile_size}: {:?}", all[object]);
            }
        }
    }
}

/// Shows that the properties are not vacuous: most objects behind a wall are found to be hidden.
#[test]
fn most_objects_behind_a_wall_are_culled() {
    let camera = Camera { size: [160, 120], ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let mut specs = vec![(0, 0, [0.0, 0.0, -10.0], [3.0, 3.0, 0.5], [0.0, 0.0, 0.0, 1.0])];
    for index in 0..400 {
        let (x, y) = (f64::from(index % 20) - 9.5, f64::from(index / 20) - 9.5);
        specs.push((0, 0, [x, y, -20.0], [0.2; 3], [0.0, 0.0, 0.0, 1.0]));
    }
    let scene = scene_of(&specs, camera);
    let scene = scene.as_scene_ref();
    let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
    for (tile_size, min_share) in [(1, 0.98), (2, 0.9), (4, 0.8), (8, 0.6)] {
        let (in_frustum, hidden) = occlusion(&scene, tile_size);
        let truly_hidden =
            (0..specs.len()).filter(|&object| in_frustum[object] && samples.alone[object] && !samples.shown[object]);
        let (count, found) =
            truly_hidden.fold((0, 0), |(count, found), object| (count + 1, found + u32::from(hidden[object])));
        assert!(count > 100 && f64::from(found) >= min_share * f64::from(count), "{found} of {count} at {tile_size}");
    }
}
