//! Single cases: what hides, and what does not.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{
    Blend, Bounds, Camera, Material, Mesh, Projection, RenderObject, Scene, SceneRef, Topology, ViewKind,
};
use drawloom_testing::samples::Samples;
use drawloom_testing::scenes::{cube, sized, square};

use crate::occlusion;

/// Which objects are hidden where none are.
const NOTHING: [usize; 0] = [];

/// A scene whose camera looks from the origin along −Z: a cube of 2 m, 20 m away, and behind or before it whatever else there is.
struct Stage {
    scene: Scene,
    material: Material,
    mesh: Mesh,
}

impl Stage {
    fn new() -> Self {
        let mut scene = Scene::new();
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), [320, 240])];
        let mut stage = Self { scene, material: Material::default(), mesh: cube() };
        stage.add(DVec3::Z * -20.0, Vec3::ONE);
        stage
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

    /// Which objects are hidden, the same at every coarseness.
    fn hidden(&self) -> Vec<usize> {
        hidden(&self.scene.as_scene_ref(), &[1, 2, 4, 8])
    }
}

fn hidden(scene: &SceneRef<'_>, sides: &[u32]) -> Vec<usize> {
    let mut answers = sides.iter().map(|&side| {
        let (_, hidden) = occlusion(scene, side);
        (0..hidden.len()).filter(|&object| hidden[object]).collect::<Vec<_>>()
    });
    let first = answers.next().unwrap();
    assert!(answers.all(|answer| answer == first), "not the same in all squares");
    first
}

#[test]
fn a_wall_hides_what_is_behind_it_and_nothing_else() {
    let mut stage = Stage::new();
    assert_eq!(stage.hidden(), NOTHING);
    stage.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.1));
    // Before the wall, beside it, and within it.
    stage.add(DVec3::new(1.5, 0.0, -5.0), Vec3::splat(0.3));
    stage.add(DVec3::new(14.0, 0.0, -20.0), Vec3::ONE);
    stage.add(DVec3::Z * -10.0, Vec3::splat(0.5));
    assert_eq!(stage.hidden(), [0]);
    // A board within a wall that is thicker than it.
    stage.add(DVec3::Z * -10.0, Vec3::new(0.5, 0.5, 0.05));
    assert_eq!(stage.hidden(), [0, 5]);
}

#[test]
fn a_wall_is_a_wall_mirrored_turned_and_of_whatever_scale() {
    let turn = Quat::from_rotation_z(0.3) * Quat::from_rotation_x(std::f32::consts::PI);
    for (scale, turn) in [
        (Vec3::new(-4.0, 4.0, 0.1), Quat::IDENTITY),
        (Vec3::new(4.0, -4.0, -0.1), turn),
        (Vec3::new(-4.0, -4.0, -1e-12), Quat::IDENTITY),
        (Vec3::new(-4e3, 4e3, 1e-3), turn),
    ] {
        let mut stage = Stage::new();
        stage.add_turned(DVec3::Z * -10.0, scale, turn);
        assert_eq!(stage.hidden(), [0], "{scale}");
    }
    // What has no volume may be drawn or not.
    let mut stage = Stage::new();
    stage.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.0));
    assert_eq!(stage.hidden(), NOTHING);
}

/// The cube's front covers 240 ÷ (2 tan 30°) ÷ 19 = 10.94 pixels to each side of the middle, so 11 columns of pixels. A wall
/// before it that ends a pixel sooner leaves a column uncovered; one that ends a pixel later covers it.
#[test]
fn a_wall_that_is_a_pixel_too_narrow_hides_nothing() {
    let focal = 120.0 / 30_f64.to_radians().tan();
    let wall = |pixels: f64, side: u32| {
        let mut stage = Stage::new();
        let half = (pixels / focal * 9.0) as f32;
        stage.add(DVec3::Z * -10.0, Vec3::new(half, 4.0, 1.0));
        hidden(&stage.scene.as_scene_ref(), &[side])
    };
    for side in [1, 2, 4, 8] {
        // Whole squares to either side of the picture's middle, which is at 160.
        let whole = (11.0 / f64::from(side)).ceil() * f64::from(side);
        assert_eq!(wall(whole - 0.01, side), NOTHING, "{side}");
        assert_eq!(wall(whole + 0.02, side), [0], "{side}");
    }
}

#[test]
fn what_crosses_the_near_plane_is_never_hidden_and_hides_only_beyond_it() {
    let mut stage = Stage::new();
    // The camera is in the middle of one, and just before another.
    stage.add(DVec3::ZERO, Vec3::ONE);
    assert_eq!(stage.hidden(), NOTHING);
    let mut stage = Stage::new();
    stage.add(DVec3::Z * -1.04, Vec3::ONE);
    assert_eq!(stage.hidden(), NOTHING, "its front is before the near plane, and so is not drawn");
    let mut stage = Stage::new();
    stage.add(DVec3::Z * -1.2, Vec3::ONE);
    assert_eq!(stage.hidden(), [0]);
    // The walls of a street, along which the camera looks, begin far behind it.
    let mut stage = Stage::new();
    stage.add(DVec3::X * 4.0, Vec3::new(1.0, 9.0, 100.0));
    stage.add(DVec3::X * -4.0, Vec3::new(1.0, 9.0, 100.0));
    stage.add(DVec3::new(12.0, 0.0, -20.0), Vec3::ONE);
    stage.add(DVec3::new(-12.0, 0.0, -20.0), Vec3::ONE);
    assert_eq!(stage.hidden(), [3, 4]);
}

#[test]
fn blended_and_moved_objects_hide_nothing_and_are_hidden() {
    let mut stage = Stage::new();
    stage.material.blend = Blend::Alpha;
    stage.add(DVec3::Z * -10.0, Vec3::new(4.0, 4.0, 0.1));
    assert_eq!(stage.hidden(), NOTHING);
    stage.material.blend = Blend::None;
    stage.add(DVec3::Z * -5.0, Vec3::new(4.0, 4.0, 0.1));
    assert_eq!(stage.hidden(), [0, 1]);
    // Whose bounds are not its mesh's may be anywhere within them.
    let scene = stage.scene.as_scene_ref();
    let mut bounds = scene.bounds.to_vec();
    bounds[2].radius *= 1.01;
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), NOTHING);
    let mut bounds = scene.bounds.to_vec();
    bounds[0] = Bounds { center: Vec3::ZERO, radius: 4.0 };
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), [0, 1]);
    bounds[0].radius = 19.0;
    assert_eq!(hidden(&SceneRef { bounds: &bounds, ..scene }, &[8]), [1]);
}

#[test]
fn a_flat_wall_hides_from_the_sides_it_is_drawn_from() {
    for topology in [Topology::TriangleList, Topology::TriangleStrip] {
        for (double_sided, faces_away, mirrored) in [
            (false, false, false),
            (false, true, false),
            (true, true, false),
            (false, false, true),
            (false, true, true),
        ] {
            let mut stage = Stage::new();
            stage.mesh = square(topology);
            stage.material.double_sided = double_sided;
            let turn = if faces_away { Quat::from_rotation_y(std::f32::consts::PI) } else { Quat::IDENTITY };
            let scale = Vec3::new(if mirrored { -4.0 } else { 4.0 }, 4.0, 1.0);
            stage.add_turned(DVec3::Z * -10.0, scale, turn);
            let expected: &[usize] = if double_sided || !faces_away { &[0] } else { &[] };
            assert_eq!(stage.hidden(), expected, "{double_sided} {faces_away} {mirrored}");
        }
    }
}

/// The faces of a box meet in edges that no square is lost to, and neither is any to the cut of a square into triangles.
#[test]
fn edges_between_faces_are_covered() {
    for turn in [0.0, 0.4, 0.785, 1.2] {
        let mut stage = Stage::new();
        let tilt = Quat::from_rotation_x(turn * 0.7) * Quat::from_rotation_y(turn);
        stage.add_turned(DVec3::Z * -10.0, Vec3::splat(3.0), tilt);
        for place in -2..=2 {
            stage.add(DVec3::new(f64::from(place), f64::from(place) * 0.5, -25.0), Vec3::splat(0.2));
        }
        assert_eq!(stage.hidden(), [0, 2, 3, 4, 5, 6], "{turn}");
    }
}

#[test]
fn a_wall_hides_without_perspective() {
    let mut stage = Stage::new();
    let camera = &mut stage.scene.cameras[0];
    camera.projection = Projection::Orthographic { height: 10.0 };
    camera.far = 100.0;
    camera.kind = ViewKind::Reflection;
    stage.add(DVec3::Z * -10.0, Vec3::new(1.3, 1.3, 0.1));
    stage.add(DVec3::new(3.0, 0.0, -20.0), Vec3::ONE);
    assert_eq!(hidden(&stage.scene.as_scene_ref(), &[1, 2, 4]), [0]);
    let shown = Samples::new(&stage.scene.as_scene_ref(), &stage.scene.cameras[0], 0.25, |_| true).shown;
    assert_eq!(shown, [false, true, true]);
}
