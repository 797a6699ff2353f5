//! Single cases of objects that do or do not hide others.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{
    Blend, Bounds, Camera, Material, Mesh, Projection, RenderObject, Scene, SceneRef, Topology, Vertex, ViewKind,
};
use drawloom::view::internal::{ObjectTable, OccluderMeshes};
use drawloom_testing::samples::Samples;
use drawloom_testing::scenes::{cube, sized, square};

use crate::occlusion;

/// The expected result if no object is hidden.
const NO_OBJECTS: [usize; 0] = [];

/// A scene whose camera looks from the origin along −Z, with a cube of 2 m at a distance of 20 m. Tests add further
/// objects.
struct WallScene {
    scene: Scene,
    material: Material,
    mesh: Mesh,
}

impl WallScene {
    fn new() -> Self {
        let mut scene = Scene::new();
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), [320, 240])];
        let mut walls = Self { scene, material: Material::default(), mesh: cube() };
        walls.add(DVec3::Z * -20.0, Vec3::ONE);
        walls
    }

    fn add(&mut self, position: DVec3, scale: Vec3) {
        self.add_turned(position, scale, Quat::IDENTITY);
    }

    fn add_turned(&mut self, position: DVec3, scale: Vec3, orientation: Quat) {
        let mesh = self.scene.add(self.mesh.clone()).unwrap();
        let material = self.scene.add(self.material.clone()).unwrap();
        let object = RenderObject::new(mesh, material, position);
        self.scene.add_object(RenderObject { scale, orientation, ..object }).unwrap();
    }

    /// The hidden objects, which must be the same for all tile sizes.
    fn hidden(&self) -> Vec<usize> {
        hidden(&self.scene.as_scene_ref(), &[1, 2, 4, 8])
    }
}

fn hidden(scene: &SceneRef<'_>, tile_sizes: &[u32]) -> Vec<usize> {
    let mut answers = tile_sizes.iter().map(|&tile_size| {
        let (_, hidden) = occlusion(scene, tile_size);
        (0..hidden.len()).filter(|&object| hidden[object]).collect::<Vec<_>>()
    });
    let first = answers.next().unwrap();
    assert!(answers.all(|answer| answer == first), "results differ between tile sizes");
    first
}

/// Objects are chosen in words of 64 and blocks of 256.
#[test]
fn any_object_of_many_may_hide_the_first() {
    for before in [63, 64, 70, 255, 256, 300] {
        let mut walls = WallScene::new();
        // The camera sees none of the others.
        (1..before).for_each(|_| walls.add(DVec3::Z * 20.0, Vec3::splat(0.1)));
        walls.add(DVec3::Z * -10.0, Vec3::new(3.0, 3.0, 0.1));
        assert_eq!(walls.hidden(), [0], "object {before}");
    }
}

/// The middle of its box is hidden, and one end is not.
#[test]
fn an_object_beside_its_position_is_hidden_where_it_is() {
    let cube = cube();
    let vertices = cube.vertices().iter().map(|vertex| {
        let [x, y, z] = vertex.position;
        Vertex { position: [x + 3.0, y, z], ..*vertex }
    });
    let beside = Mesh::new("beside", Topology::TriangleList, vertices.collect(), cube.indices().to_vec()).unwrap();
    // The object begins 18 pixels to the right of the picture's middle, and the wall 14 and 23.
    for (left, expected) in [(0.7, &[2][..]), (1.1, &[])] {
        let mut walls = WallScene::new();
        walls.add(DVec3::new(left + 10.0, 0.0, -10.0), Vec3::new(10.0, 9.0, 0.1));
        walls.mesh = beside.clone();
        walls.add(DVec3::Z * -22.0, Vec3::ONE);
        assert_eq!(walls.hidden(), expected, "{left}");
    }
}

#[test]
fn a_wall_hides_what_is_behind_it_and_nothing_else() {
    let mut walls = WallScene::new();
    assert_eq!(walls.hidden(), NO_OBJECTS);
    walls.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.1));
    // In front of the wall, next to it, and inside it.
    walls.add(DVec3::new(1.5, 0.0, -5.0), Vec3::splat(0.3));
    walls.add(DVec3::new(14.0, 0.0, -20.0), Vec3::ONE);
    walls.add(DVec3::Z * -10.0, Vec3::splat(0.5));
    assert_eq!(walls.hidden(), [0]);
    // A board inside a wall that is thicker.
    walls.add(DVec3::Z * -10.0, Vec3::new(0.5, 0.5, 0.05));
    assert_eq!(walls.hidden(), [0, 5]);
}

/// Slots of another scene may have the same revisions.
#[test]
fn the_parts_of_another_scene_replace_those_of_the_one_before() {
    let mut meshes = OccluderMeshes::default();
    for mesh in [cube(), square(Topology::TriangleList), cube()] {
        let mut scene = Scene::new();
        let (mesh, material) = (scene.add(mesh).unwrap(), scene.add(Material::default()).unwrap());
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        let mut table = ObjectTable::default();
        table.update(&scene.as_scene_ref());
        meshes.sync(scene.assets(), table.used_meshes());
        let mut alone = OccluderMeshes::default();
        alone.sync(scene.assets(), table.used_meshes());
        assert_eq!(meshes.parts(mesh.index()).len(), 1);
        assert_eq!(format!("{:?}", meshes.parts(mesh.index())), format!("{:?}", alone.parts(mesh.index())));
    }
}

#[test]
fn mirrored_rotated_and_scaled_walls_hide_too() {
    let turn = Quat::from_rotation_z(0.3) * Quat::from_rotation_x(std::f32::consts::PI);
    for (scale, turn) in [
        (Vec3::new(-4.0, 4.0, 0.1), Quat::IDENTITY),
        (Vec3::new(4.0, -4.0, -0.1), turn),
        (Vec3::new(-4.0, -4.0, -1e-12), Quat::IDENTITY),
        (Vec3::new(-4e3, 4e3, 1e-3), turn),
    ] {
        let mut walls = WallScene::new();
        walls.add_turned(DVec3::Z * -10.0, scale, turn);
        assert_eq!(walls.hidden(), [0], "{scale}");
    }
    // An object without volume may or may not be drawn.
    let mut walls = WallScene::new();
    walls.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.0));
    assert_eq!(walls.hidden(), NO_OBJECTS);
}

/// The cube's front covers 240 ÷ (2 tan 30°) ÷ 19 = 10.94 pixels on each half of the picture, so 11 columns of pixels.
/// A wall in front of it that is a pixel narrower leaves a column uncovered; one that is a pixel wider covers it.
#[test]
fn a_wall_that_is_a_pixel_too_narrow_hides_nothing() {
    let focal = 120.0 / 30_f64.to_radians().tan();
    let wall = |pixels: f64, tile_size: u32| {
        let mut walls = WallScene::new();
        let half = (pixels / focal * 9.0) as f32;
        walls.add(DVec3::Z * -10.0, Vec3::new(half, 4.0, 1.0));
        hidden(&walls.scene.as_scene_ref(), &[tile_size])
    };
    for tile_size in [1, 2, 4, 8] {
        // Whole tiles on either half of the picture, whose centre is at 160.
        let whole = (11.0 / f64::from(tile_size)).ceil() * f64::from(tile_size);
        assert_eq!(wall(whole - 0.01, tile_size), NO_OBJECTS, "{tile_size}");
        assert_eq!(wall(whole + 0.02, tile_size), [0], "{tile_size}");
    }
}

#[test]
fn an_object_that_crosses_the_near_plane_is_never_hidden_and_hides_only_beyond_the_plane() {
    let mut walls = WallScene::new();
    // The camera is inside one cube, and just in front of another.
    walls.add(DVec3::ZERO, Vec3::ONE);
    assert_eq!(walls.hidden(), NO_OBJECTS);
    let mut walls = WallScene::new();
    walls.add(DVec3::Z * -1.04, Vec3::ONE);
    assert_eq!(walls.hidden(), NO_OBJECTS, "its front is clipped by the near plane");
    let mut walls = WallScene::new();
    walls.add(DVec3::Z * -1.2, Vec3::ONE);
    assert_eq!(walls.hidden(), [0]);
    // The camera looks along a street whose walls begin far behind it.
    let mut walls = WallScene::new();
    walls.add(DVec3::X * 4.0, Vec3::new(1.0, 9.0, 100.0));
    walls.add(DVec3::X * -4.0, Vec3::new(1.0, 9.0, 100.0));
    walls.add(DVec3::new(12.0, 0.0, -20.0), Vec3::ONE);
    walls.add(DVec3::new(-12.0, 0.0, -20.0), Vec3::ONE);
    assert_eq!(walls.hidden(), [3, 4]);
}

/// The camera looks along a wall that begins behind it. Rounding may turn the face beside it into one that is seen from
/// behind, or the other way round, if it is nearer than 256 times the wall's position error: here 256 × 8.7e-5 m =
/// 0.022 m.
#[test]
fn a_clipped_wall_hides_nothing_if_it_is_seen_almost_edge_on() {
    for (gap, expected) in [(0.1, &[2][..]), (0.019, &[])] {
        let mut walls = WallScene::new();
        walls.add(DVec3::new(-3.0 - gap, 0.0, -40.0), Vec3::new(3.0, 9.0, 50.0));
        walls.add(DVec3::new(-4.0, 7.0, -95.0), Vec3::splat(0.3));
        assert_eq!(walls.hidden(), expected, "{gap} m beside the camera");
    }
}

#[test]
fn blended_and_moved_objects_do_not_hide_but_are_hidden() {
    let mut walls = WallScene::new();
    walls.material.blend = Blend::Alpha;
    walls.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.1));
    assert_eq!(walls.hidden(), NO_OBJECTS);
    walls.material.blend = Blend::None;
    walls.add(DVec3::Z * -5.0, Vec3::new(4.0, 4.0, 0.1));
    assert_eq!(walls.hidden(), [0, 1]);
    // An object with bounds other than its mesh's may be anywhere within them.
    let scene = walls.scene.as_scene_ref();
    let mut bounds = scene.bounds.to_vec();
    bounds[2].radius *= 1.01;
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), NO_OBJECTS);
    let mut bounds = scene.bounds.to_vec();
    bounds[0] = Bounds { center: Vec3::ZERO, radius: 4.0 };
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), [0, 1]);
    bounds[0].radius = 19.0;
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), [1]);
}

#[test]
fn a_flat_wall_hides_from_the_directions_in_which_it_is_drawn() {
    for topology in [Topology::TriangleList, Topology::TriangleStrip] {
        for (double_sided, faces_away, mirrored) in [
            (false, false, false),
            (false, true, false),
            (true, true, false),
            (false, false, true),
            (false, true, true),
        ] {
            let mut walls = WallScene::new();
            walls.mesh = square(topology);
            walls.material.double_sided = double_sided;
            let rotation = if faces_away { Quat::from_rotation_y(std::f32::consts::PI) } else { Quat::IDENTITY };
            let scale = Vec3::new(if mirrored { -4.0 } else { 4.0 }, 4.0, 1.0);
            walls.add_turned(DVec3::Z * -10.0, scale, rotation);
            let expected: &[usize] = if double_sided || !faces_away { &[0] } else { &[] };
            assert_eq!(walls.hidden(), expected, "{double_sided} {faces_away} {mirrored}");
        }
    }
}

/// Tiles at the edges between a box's faces, and at the diagonals between a face's triangles, are covered.
#[test]
fn edges_between_faces_are_covered() {
    for angle in [0.0, 0.4, 0.785, 1.2] {
        let mut walls = WallScene::new();
        let tilt = Quat::from_rotation_x(angle * 0.7) * Quat::from_rotation_y(angle);
        walls.add_turned(DVec3::Z * -10.0, Vec3::splat(3.0), tilt);
        for index in -2..=2 {
            walls.add(DVec3::new(f64::from(index), f64::from(index) * 0.5, -25.0), Vec3::splat(0.2));
        }
        assert_eq!(walls.hidden(), [0, 2, 3, 4, 5, 6], "{angle}");
    }
}

#[test]
fn a_wall_hides_without_perspective() {
    let mut walls = WallScene::new();
    let camera = &mut walls.scene.cameras[0];
    camera.projection = Projection::Orthographic { height: 10.0 };
    camera.far = 100.0;
    camera.kind = ViewKind::Reflection;
    walls.add(DVec3::Z * -10.0, Vec3::new(1.3, 1.3, 0.1));
    walls.add(DVec3::new(3.0, 0.0, -20.0), Vec3::ONE);
    assert_eq!(hidden(&walls.scene.as_scene_ref(), &[1, 2, 4]), [0]);
    let shown = Samples::new(&walls.scene.as_scene_ref(), &walls.scene.cameras[0], 0.25, |_| true).shown;
    assert_eq!(shown, [false, true, true]);
}
