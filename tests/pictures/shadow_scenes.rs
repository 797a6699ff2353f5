//! Scenes of shadows, compared with stored references: a lamp among columns, and an avenue in the sun.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Camera, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::image_distance::assert_different;
use crate::references::compare_picture;
use crate::shadows::{fixture_with, sun, without_shadow};

pub const CASES: &[Case] = &[
    ("reference_of_a_lamp_among_columns", || compare("lamp", lamp_among_columns()?, ShadowMaps::default())),
    ("reference_of_an_avenue_in_cascades", || {
        compare("avenue", avenue()?, ShadowMaps { cascades: 4, max_distance: 90.0, ..ShadowMaps::default() })
    }),
];

/// The picture is that of the reference, and without shadows it would not be.
fn compare(name: &str, mut scene: Scene, maps: ShadowMaps) -> Result<(), Failed> {
    let drawn = fixture_with(maps)?.draw(&scene)?;
    scene.lights = scene.lights.into_iter().map(without_shadow).collect();
    assert_different(&drawn, &fixture_with(maps)?.draw(&scene)?)?;
    compare_picture(name, &drawn)
}

/// Boxes that stand on the ground.
struct Site {
    scene: Scene,
    cube: Handle<Mesh>,
    stone: Handle<Material>,
}

impl Site {
    fn new(camera: Camera) -> Result<Self, SceneError> {
        let mut scene = Scene::new();
        scene.cameras = vec![sized(camera, [320, 180])];
        scene.ambient = Vec3::splat(0.04);
        scene.background = Vec3::new(0.3, 0.45, 0.7);
        let cube = scene.add(cube())?;
        let stone = scene.add(Material { diffuse: Vec3::new(0.8, 0.75, 0.65), ..Material::default() })?;
        Ok(Self { scene, cube, stone })
    }

    /// A box of this half width, height and half depth on the ground at (x, z), turned by `turn` radians.
    fn add(&mut self, [x, z]: [f64; 2], [half, height, depth]: [f32; 3], turn: f32) -> Result<(), SceneError> {
        let position = DVec3::new(x, f64::from(height) / 2.0, z);
        self.scene.add_object(RenderObject {
            scale: Vec3::new(half, height / 2.0, depth),
            orientation: Quat::from_rotation_y(turn),
            ..RenderObject::new(self.cube, self.stone, position)
        })?;
        Ok(())
    }

    /// The ground, whose upper side is at a height of 0.
    fn add_ground(&mut self, half: f32) -> Result<(), SceneError> {
        self.add([0.0; 2], [half, 0.2, half], 0.0)?;
        let ground = self.scene.objects().last();
        if let Some(ground) = ground {
            let object = self.scene.object(ground)?;
            self.scene.replace_object(ground, RenderObject { position: DVec3::Y * -0.1, ..object })?;
        }
        Ok(())
    }
}

/// A lamp in a ring of columns and low blocks before two walls: shadows run over the ground and up the walls in all
/// directions, across the edges of the cube.
fn lamp_among_columns() -> Result<Scene, SceneError> {
    let looking = Camera::looking_at("main", DVec3::new(3.2, 4.6, 6.4), DVec3::new(-0.3, 0.7, -0.6));
    let mut site = Site::new(looking)?;
    site.add_ground(12.0)?;
    site.add([0.0, -4.5], [12.0, 4.0, 0.2], 0.0)?;
    site.add([-5.0, 0.0], [0.2, 4.0, 12.0], 0.0)?;
    for index in 0..9 {
        let (sine, cosine) = (f64::from(index) * std::f64::consts::TAU / 9.0 + 0.2).sin_cos();
        let height = if index % 3 == 0 { 0.5 } else { 2.4 };
        site.add([cosine * 2.2, sine * 2.2], [0.16, height, 0.16], index as f32)?;
    }
    let position = DVec3::new(0.1, 1.3, 0.05);
    let intensity = Vec3::new(14.0, 11.0, 8.0);
    site.scene.lights = vec![Light::Point { position, intensity, range: 16.0, casts_shadow: true }];
    Ok(site.scene)
}

/// Two rows of columns from before the camera's feet to the end of what the maps cover.
fn avenue() -> Result<Scene, SceneError> {
    let projection = Projection::Perspective { field_of_view: 1.0 };
    let looking = Camera::looking_at("main", DVec3::new(0.3, 1.7, 2.0), DVec3::new(-0.4, 0.9, -6.0));
    let mut site = Site::new(Camera { projection, ..looking })?;
    site.add_ground(150.0)?;
    for row in 0..16 {
        let z = -1.5 - 5.0 * f64::from(row);
        for x in [-2.4, 2.4] {
            site.add([x, z], [0.2, 3.0, 0.2], 0.3)?;
            site.add([x * 0.5, z - 1.7], [0.12, 0.25, 0.12], row as f32)?;
        }
    }
    site.scene.lights = vec![sun(DVec3::new(-0.65, -0.6, 0.3).normalize())];
    Ok(site.scene)
}
