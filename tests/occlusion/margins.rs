//! Objects just in front of others, and just behind them: each is where rounding a depth the wrong way would hide it.

use drawloom::glam::{DQuat, DVec2, DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{cube, sized, square};

use crate::occlusion;

const TILE_SIZES: [u32; 4] = [1, 2, 4, 8];

/// The picture, in pixels, and its focal length: the field of view is 60°.
const SIZE: [u32; 2] = [320, 240];

/// A scene in which tests place walls and small cubes relative to the camera: to the right, up and backwards.
struct Site {
    scene: Scene,
    wall: Handle<Mesh>,
    cube: Handle<Mesh>,
    paint: Handle<Material>,
    turn: DQuat,
}

impl Site {
    fn new(turn: DQuat) -> Self {
        let mut scene = Scene::new();
        let camera = Camera::looking_at("main", DVec3::new(3e3, -2e5, 7.0), DVec3::ZERO);
        scene.cameras = vec![sized(Camera { orientation: turn.as_quat(), ..camera }, SIZE)];
        let turn = scene.cameras[0].orientation.as_dquat().normalize();
        let [wall, cube] = [square(Topology::TriangleList), cube()].map(|mesh| scene.add(mesh).unwrap());
        let paint = scene.add(Material::default()).unwrap();
        Self { scene, wall, cube, paint, turn }
    }

    /// A square with this half width and half height, facing the camera and then turned.
    fn add_wall(&mut self, center: DVec3, half: DVec2, turn: DQuat) {
        let position = self.scene.cameras[0].position + self.turn * center;
        let (scale, orientation) = (half.as_vec2().extend(1.0), (self.turn * turn).as_quat().normalize());
        let object = RenderObject::new(self.wall, self.paint, position);
        self.scene.add_object(RenderObject { scale, orientation, ..object }).unwrap();
    }

    fn add_cube(&mut self, center: DVec3, half: f64) {
        let position = self.scene.cameras[0].position + self.turn * center;
        let object = RenderObject::new(self.cube, self.paint, position);
        let orientation = self.turn.as_quat().normalize();
        self.scene.add_object(RenderObject { scale: Vec3::splat(half as f32), orientation, ..object }).unwrap();
    }

    /// The number of hidden objects at a tile size.
    fn hidden(&self, tile_size: u32) -> usize {
        occlusion(&self.scene.as_scene_ref(), tile_size).1.into_iter().filter(|hidden| *hidden).count()
    }
}

/// Pixels per metre at a depth of 1 m.
fn focal() -> f64 {
    f64::from(SIZE[1]) / 2.0 / 30_f64.to_radians().tan()
}

/// The direction in which a pixel is seen, with a depth of 1.
fn ray(x: f64, y: f64) -> DVec3 {
    let [width, height] = SIZE.map(f64::from);
    DVec3::new((x - width / 2.0) / focal(), (height / 2.0 - y) / focal(), -1.0)
}

fn any_turn(random: &mut Random) -> DQuat {
    DQuat::from_axis_angle(random.direction().normalize(), random.between(-3.0, 3.0))
}

/// The depth of an inclined wall differs within a tile: cubes at the farther end of a tile are beyond the depth of its
/// middle.
#[test]
fn what_is_just_in_front_of_an_inclined_wall_is_not_hidden() {
    let mut random = Random::new();
    let (mut behind, mut hidden_behind) = (0, 0);
    for _ in 0..40 {
        let axis = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0).normalize();
        let tilt = DQuat::from_axis_angle(axis, random.between(0.2, 1.4));
        let (center, normal) = (DVec3::Z * -10.0, tilt * DVec3::Z);
        let turn = any_turn(&mut random);
        let site = |cubes: &[(DVec3, f64)]| {
            let mut site = Site::new(turn);
            site.add_wall(center, DVec2::splat(30.0), tilt);
            cubes.iter().for_each(|&(center, half)| site.add_cube(center, half));
            site
        };
        let (mut front, mut back) = (Vec::new(), Vec::new());
        while front.len() < 150 {
            let ray = ray(random.between(1.0, 319.0), random.between(1.0, 239.0));
            let hit = ray * (center.dot(normal) / ray.dot(normal));
            let on_wall = tilt.inverse() * (hit - center);
            if (-50.0..-1.0).contains(&hit.z) && on_wall.abs().max_element() < 29.0 {
                // A cube reaches at most √3 of its half width from its centre. A tenth of it exceeds a device's errors,
                // 10⁻⁵ of the depth.
                let half = -hit.z * 2e-4;
                front.push((hit + normal * (half * 1.85), half));
                back.push((hit * 1.5, half));
            }
        }
        for tile_size in TILE_SIZES {
            assert_eq!(site(&front).hidden(tile_size), 0, "tilted by {tilt}, tiles of {tile_size}");
            behind += back.len();
            hidden_behind += site(&back).hidden(tile_size);
        }
    }
    // Shows that walls are drawn.
    assert!(hidden_behind > behind / 2, "{hidden_behind} of {behind} cubes behind a wall are hidden");
}

/// Two walls, each of which covers a part of a tile, cover it together; its depth is that of the farther one.
#[test]
fn what_is_just_in_front_of_the_farther_of_two_walls_is_not_hidden() {
    let mut random = Random::stream(1);
    let mut hidden_behind = 0;
    for _ in 0..40 {
        let (near, far) = (random.between(3.0, 9.0), random.between(10.0, 30.0));
        let (seam, turn) = (random.between(100.0, 220.0), any_turn(&mut random));
        let site = |depth: f64, rows: &[(f64, f64)]| {
            let mut site = Site::new(turn);
            // From the picture's left to the seam, and from behind the nearer wall to the picture's right.
            for (from, to, depth) in [(-9.0, seam, near), (seam - 4.0, 329.0, far)] {
                let half = DVec2::new((to - from) / 2.0, 130.0) * (depth / focal());
                site.add_wall(ray((from + to) / 2.0, 120.0) * depth, half, DQuat::IDENTITY);
            }
            rows.iter().for_each(|&(x, y)| site.add_cube(ray(seam + x, y) * depth, depth * 2e-4));
            site
        };
        let positions: Vec<_> = (0..100).map(|_| (random.between(0.1, 8.0), random.between(1.0, 239.0))).collect();
        for tile_size in TILE_SIZES {
            let hidden = site(far * 0.99, &positions).hidden(tile_size);
            assert_eq!(hidden, 0, "walls at {near} m and {far} m, seam at {seam}, tiles of {tile_size}");
            hidden_behind += site(far * 1.5, &positions).hidden(tile_size);
        }
    }
    assert!(hidden_behind > 40 * 4 * 100 * 9 / 10, "{hidden_behind} cubes behind both walls are hidden");
}

/// A device may draw the wall farther away than it is, and what is behind the wall nearer. Its bounds, as shares of the
/// depth in steps of 2⁻²⁰: 1 for the position of either, 4 for the depth that it computes of either, and a quarter for
/// interpolating it. So up to 10 steps behind a wall nothing is hidden. The wall's size adds 0.07 to its position's. 11
/// steps behind, everything is hidden.
#[test]
fn what_a_device_may_draw_in_front_of_a_wall_is_not_hidden() {
    for depth in [1.0, 10.0, 1e3, 1e6] {
        for (steps, expected) in [(0.0, 0), (5.0, 0), (10.0, 0), (11.0, 1), (50.0, 1)] {
            let mut site = Site::new(DQuat::IDENTITY);
            site.scene.cameras[0].position = DVec3::ZERO;
            site.add_wall(DVec3::Z * -depth, DVec2::splat(depth * 0.05), DQuat::IDENTITY);
            let behind = depth * (1.0 + steps / f64::from(1 << 20));
            site.add_wall(DVec3::Z * -behind, DVec2::splat(depth * 1e-3), DQuat::IDENTITY);
            for tile_size in TILE_SIZES {
                assert_eq!(site.hidden(tile_size), expected, "{steps} steps behind {depth} m, tiles of {tile_size}");
            }
        }
    }
}
