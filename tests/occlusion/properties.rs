//! Random scenes against what their pictures show.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::Quality;
use drawloom::scene::{Blend, Camera, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex};
use drawloom_testing::samples::Samples;
use drawloom_testing::scenes::{cube, square};
use proptest::prelude::*;

use crate::occlusion;

/// Its mesh, its material, where it is, how large and how it is turned.
type Thing = (usize, usize, [f64; 3], [f32; 3], [f32; 4]);

/// A wedge, sharp at one end, turned by what was worked into its vertices; and a tray: a box without its lid.
fn others() -> [Mesh; 2] {
    let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_z(0.3);
    let vertex = |place: Vec3| Vertex { position: (turn * place).to_array(), ..Vertex::default() };
    let at = |x: f32, y: f32, z: f32| vertex(Vec3::new(x, y, z));
    let places = vec![
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
    [Mesh::new("wedge", Topology::TriangleList, places, faces).unwrap(), tray.unwrap()]
}

fn scene_of(things: &[Thing], camera: Camera) -> Scene {
    let mut scene = Scene::new();
    let [wedge, tray] = others();
    let meshes = [cube(), square(Topology::TriangleStrip), wedge, tray].map(|mesh| scene.add(mesh).unwrap());
    let materials = [(Blend::None, false), (Blend::None, true), (Blend::Alpha, false)].map(|(blend, double_sided)| {
        scene.add(Material { blend, double_sided, opacity: 0.5, ..Material::default() }).unwrap()
    });
    for &(mesh, material, position, scale, turn) in things {
        let position = camera.position + DVec3::from(position);
        let object = RenderObject::new(meshes[mesh], materials[material], position);
        let orientation = Quat::from_array(turn).normalize();
        scene.add_object(RenderObject { scale: Vec3::from(scale), orientation, ..object }).unwrap();
    }
    scene.cameras = vec![camera];
    scene
}

prop_compose! {
    fn thing(far: f64, large: f32)(
        mesh in 0_usize..4,
        material in prop::sample::select(vec![0_usize, 0, 0, 1, 1, 2]),
        position in prop::array::uniform3(-far..far),
        scale in prop::array::uniform3(-large..large),
        exponent in -2.0..0.0_f32,
        turn in prop::array::uniform4(-1.0..1.0_f32),
        is_upright in prop::bool::ANY,
    ) -> Thing {
        let turn = if is_upright || turn.iter().all(|part| part.abs() < 0.1) { [0.0, 0.0, 0.0, 1.0] } else { turn };
        (mesh, material, position, scale.map(|side| side * 10_f32.powf(exponent)), turn)
    }
}

prop_compose! {
    fn any_camera()(
        place in prop::array::uniform3(-1.0..1.0_f64),
        exponent in 0.0..6.0_f64,
        towards in prop::array::uniform3(-1.0..1.0_f64),
        degrees in 20.0..140.0_f32,
        size in prop::array::uniform2(17_u32..90),
        near in -2.0..0.5_f32,
        is_flat in prop::bool::weighted(0.2),
    ) -> Camera {
        let position = DVec3::from(place) * 10_f64.powf(exponent);
        let mut camera = Camera::looking_at("any", position, position + DVec3::from(towards));
        camera.size = size;
        camera.near = 10_f32.powf(near);
        camera.projection = Projection::Perspective { field_of_view: degrees.to_radians() };
        if is_flat {
            camera.projection = Projection::Orthographic { height: degrees * 0.3 };
            camera.far = 60.0;
        }
        camera
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Things of all sizes all around the camera: some cross the near plane, many cut into each other.
    #[test]
    fn nothing_that_shows_is_left_out(
        things in prop::collection::vec(thing(30.0, 40.0), 1..40),
        camera in any_camera(),
    ) {
        let scene = scene_of(&things, camera);
        let scene = scene.as_scene_ref();
        let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
        for side in Quality::OCCLUSION_TILE_SIZES {
            let (_, hidden) = occlusion(&scene, side);
            for object in 0..things.len() {
                prop_assert!(!(hidden[object] && samples.shown[object]), "{object} at {side}: {:?}", things[object]);
            }
        }
    }

    /// Behind a wall that covers the picture but for one side, small things before and behind all around its rim.
    #[test]
    fn nothing_that_shows_past_a_rim_is_left_out(
        wall in (0.5..6.0_f32, 0.5..6.0_f32, 0.001..2.0_f32, prop::array::uniform4(-1.0..1.0_f32)),
        things in prop::collection::vec((-1.2..1.2_f64, -1.2..1.2_f64, 0.0..30.0_f64, 0.01..0.5_f32), 30..60),
        camera in any_camera(),
    ) {
        let (width, height, depth, turn) = wall;
        let (forward, right) = (camera.orientation.as_dquat() * DVec3::NEG_Z, camera.orientation.as_dquat() * DVec3::X);
        let up = right.cross(forward);
        let distance = 8.0;
        let turn = (Quat::from_array(turn) + Quat::IDENTITY * 2.1).normalize();
        let orientation = (camera.orientation * Quat::IDENTITY.slerp(turn, 0.3)).to_array();
        let mut all = vec![(0, 0, (forward * distance).to_array(), [width, height, depth], orientation)];
        for (x, y, behind, size) in things {
            let aside = right * (x * f64::from(width)) + up * (y * f64::from(height));
            let place = (aside + forward * distance) * (1.0 + behind / distance);
            all.push((0, 0, place.to_array(), [size; 3], orientation));
        }
        let scene = scene_of(&all, camera);
        let scene = scene.as_scene_ref();
        let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
        for side in Quality::OCCLUSION_TILE_SIZES {
            let (_, hidden) = occlusion(&scene, side);
            for object in 0..all.len() {
                prop_assert!(!(hidden[object] && samples.shown[object]), "{object} at {side}: {:?}", all[object]);
            }
        }
    }
}

/// Whether the properties test anything: of the things behind a wall in many such scenes, most are found.
#[test]
fn most_of_what_a_wall_hides_is_found() {
    let camera = Camera { size: [160, 120], ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let mut things = vec![(0, 0, [0.0, 0.0, -10.0], [3.0, 3.0, 0.5], [0.0, 0.0, 0.0, 1.0])];
    for place in 0..400 {
        let (x, y) = (f64::from(place % 20) - 9.5, f64::from(place / 20) - 9.5);
        things.push((0, 0, [x, y, -20.0], [0.2; 3], [0.0, 0.0, 0.0, 1.0]));
    }
    let scene = scene_of(&things, camera);
    let scene = scene.as_scene_ref();
    let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
    for (side, least) in [(1, 0.98), (2, 0.9), (4, 0.8), (8, 0.6)] {
        let (seen, hidden) = occlusion(&scene, side);
        let truly = (0..things.len()).filter(|&object| seen[object] && samples.alone[object] && !samples.shown[object]);
        let (count, found) =
            truly.fold((0, 0), |(count, found), object| (count + 1, found + u32::from(hidden[object])));
        assert!(count > 100 && f64::from(found) >= least * f64::from(count), "{found} of {count} at {side}");
    }
}
