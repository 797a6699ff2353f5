//! Objects are drawn at their positions, upright, and nearer ones in front.

use drawloom::backend::Picture;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom_testing::scenes::{cube, field, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw, pixel};
use crate::image_distance::{assert_alike, assert_different};

pub const CASES: &[Case] = &[
    ("objects_above_and_to_the_right_appear_there", directions),
    ("a_texture_has_the_correct_orientation", a_texture_has_the_correct_orientation),
    ("textures_of_every_size_keep_their_colour", every_size),
    ("a_strip_draws_what_a_list_draws", strip_equals_list),
    ("the_nearer_object_hides_the_farther_in_any_order", nearer_hides),
    ("a_mirrored_object_shows_its_outside", mirrored),
    ("back_faces_are_culled_unless_double_sided", culled),
    ("extreme_scales_cause_no_nan", extreme_scales),
    ("a_zero_normal_is_replaced_by_the_triangles_normal", zero_normals),
    ("pictures_far_from_the_origin_equal_those_near_it", far_away),
    ("each_view_has_its_own_picture", two_views),
];

/// A scene of unlit surfaces that emit their own colour, with a camera 5 m in front of the origin.
struct UnlitScene {
    scene: Scene,
    mesh: drawloom::handle::Handle<Mesh>,
}

impl UnlitScene {
    fn new(mesh: Mesh) -> Result<Self, Failed> {
        let mut scene = Scene::new();
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [90, 90])];
        let mesh = scene.add(mesh)?;
        Ok(Self { scene, mesh })
    }

    fn add(&mut self, color: Vec3, change: impl FnOnce(&mut RenderObject)) -> Result<(), Failed> {
        let material = self.scene.add(Material { emission: color, diffuse: Vec3::ZERO, ..Material::default() })?;
        let mut object = RenderObject::new(self.mesh, material, DVec3::ZERO);
        object.scale = Vec3::splat(0.4);
        change(&mut object);
        self.scene.add_object(object)?;
        Ok(())
    }
}

#[derive(Debug, PartialEq, Eq)]
enum Hue {
    Red,
    Green,
    Blue,
    Black,
    Mixed,
}

fn hue(picture: &Picture, x: u32, y: u32) -> Hue {
    match pixel(picture, x, y).map(|channel| channel > 80) {
        [true, false, false] => Hue::Red,
        [false, true, false] => Hue::Green,
        [false, false, true] => Hue::Blue,
        [false, false, false] => Hue::Black,
        _ => Hue::Mixed,
    }
}

fn expect(picture: &Picture, points: &[(u32, u32, Hue)]) -> Result<(), Failed> {
    for (x, y, expected) in points {
        let found = hue(picture, *x, *y);
        if found != *expected {
            return Err(format!("({x}, {y}) is {found:?}, not {expected:?}").into());
        }
    }
    Ok(())
}

fn directions() -> Result<(), Failed> {
    let mut unlit = UnlitScene::new(square(Topology::TriangleList))?;
    unlit.add(Vec3::X, |object| object.position.y = 2.0)?;
    unlit.add(Vec3::Y, |object| object.position.x = 2.0)?;
    unlit.add(Vec3::Z, |object| object.position.x = -2.0)?;
    let points =
        [(45, 14, Hue::Red), (76, 45, Hue::Green), (14, 45, Hue::Blue), (45, 76, Hue::Black), (45, 45, Hue::Black)];
    expect(&draw(&unlit.scene)?, &points)
}

fn textured(texture: Texture) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [90, 90])];
    scene.ambient = Vec3::ONE;
    let texture = scene.add(texture)?;
    let material = scene.add(Material { texture: Some(texture), diffuse: Vec3::ONE, ..Material::default() })?;
    let mesh = scene.add(square(Topology::TriangleList))?;
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    Ok(scene)
}

fn a_texture_has_the_correct_orientation() -> Result<(), Failed> {
    // Four quarters, wide enough that filtering affects only their edges.
    let mut pixels = Vec::new();
    for y in 0..64 {
        for x in 0..64 {
            pixels.extend(match (x < 32, y < 32) {
                (true, true) => [255, 0, 0, 255],
                (false, true) => [0, 255, 0, 255],
                (true, false) => [0, 0, 255, 255],
                (false, false) => [0, 0, 0, 255],
            });
        }
    }
    let picture = draw(&textured(Texture::new("quarters", 64, 64, pixels)?)?)?;
    expect(&picture, &[(35, 35, Hue::Red), (55, 35, Hue::Green), (35, 55, Hue::Blue), (55, 55, Hue::Black)])
}

fn every_size() -> Result<(), Failed> {
    for (width, height) in [(1, 1), (256, 64), (300, 500), (1000, 20), (2048, 1500), (3000, 16)] {
        let pixels = [255, 0, 0, 255].repeat(width as usize * height as usize);
        let picture = draw(&textured(Texture::new("red", width, height, pixels)?)?)?;
        expect(&picture, &[(45, 45, Hue::Red)]).map_err(|_| format!("{width}x{height}"))?;
    }
    Ok(())
}

fn strip_equals_list() -> Result<(), Failed> {
    let with = |topology| -> Result<Picture, Failed> {
        let mut unlit = UnlitScene::new(square(topology))?;
        unlit.add(Vec3::X, |object| object.orientation = Quat::from_rotation_y(0.5))?;
        unlit.add(Vec3::Y, |object| object.position = DVec3::new(0.6, 0.6, 0.3))?;
        draw(&unlit.scene)
    };
    let strip = with(Topology::TriangleStrip)?;
    expect(&strip, &[(45, 45, Hue::Red)])?;
    if strip == with(Topology::TriangleList)? { Ok(()) } else { Err("they differ".into()) }
}

fn nearer_hides() -> Result<(), Failed> {
    for near_first in [true, false] {
        let mut unlit = UnlitScene::new(square(Topology::TriangleList))?;
        let mut order = [(Vec3::X, 1.0), (Vec3::Z, -1.0)];
        if !near_first {
            order.reverse();
        }
        for (color, z) in order {
            unlit.add(color, |object| object.position.z = z)?;
        }
        expect(&draw(&unlit.scene)?, &[(45, 45, Hue::Red)])?;
    }
    Ok(())
}

fn mirrored() -> Result<(), Failed> {
    let with = |scale: Vec3| -> Result<Picture, Failed> {
        let mut scene = Scene::new();
        scene.cameras = field(0).cameras[..1].to_vec();
        scene.lights = field(0).lights;
        let (mesh, material) = (scene.add(cube())?, scene.add(Material::default())?);
        let mut object = RenderObject::new(mesh, material, DVec3::ZERO);
        object.scale = scale * 3.0;
        object.orientation = Quat::from_rotation_y(0.4);
        scene.add_object(object)?;
        draw(&scene)
    };
    let plain = with(Vec3::ONE)?;
    assert_alike(&with(Vec3::new(-1.0, 1.0, 1.0))?, &plain)?;
    assert_alike(&with(Vec3::new(-1.0, -1.0, -1.0))?, &plain)?;
    assert_alike(&with(Vec3::new(-1.0, 1.0, -1.0))?, &plain)?;
    assert_different(&with(Vec3::new(0.5, 1.0, 1.0))?, &plain)
}

fn culled() -> Result<(), Failed> {
    let turned = Quat::from_rotation_y(std::f32::consts::PI);
    let mut unlit = UnlitScene::new(square(Topology::TriangleList))?;
    unlit.add(Vec3::X, |object| object.orientation = turned)?;
    expect(&draw(&unlit.scene)?, &[(45, 45, Hue::Black)])?;
    let handle = unlit.scene.objects().next().ok_or("there is an object")?;
    let material = unlit.scene.object(handle)?.material;
    let both = Material { double_sided: true, ..unlit.scene.assets().get(material)?.clone() };
    unlit.scene.replace(material, both)?;
    expect(&draw(&unlit.scene)?, &[(45, 45, Hue::Red)])
}

fn extreme_scales() -> Result<(), Failed> {
    for scale in [
        Vec3::ZERO,
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::splat(1e-20),
        Vec3::new(1e6, 1.0, 1e-6),
        Vec3::splat(1e18),
        Vec3::splat(1e20),
    ] {
        let mut scene = field(0);
        let (mesh, material) = (scene.add(cube())?, scene.add(Material::default())?);
        let mut object = RenderObject::new(mesh, material, DVec3::ZERO);
        object.scale = scale;
        scene.add_object(object)?;
        let mut fixture = Fixture::new()?;
        let recorded = fixture.record(&scene)?;
        let radiance = fixture.submit(recorded)?.read(0, "radiance")?;
        // A half float is infinite or NaN if its exponent is all ones.
        let broken = radiance.bytes.chunks_exact(2).any(|half| half[1] & 0x7c == 0x7c);
        if broken {
            return Err(format!("a pixel is not a number at scale {scale}").into());
        }
    }
    Ok(())
}

fn zero_normals() -> Result<(), Failed> {
    let with = |change: fn([f32; 3]) -> [f32; 3]| -> Result<Picture, Failed> {
        let mut scene = field(0);
        let mesh = cube();
        let vertices = mesh.vertices().iter().map(|vertex| Vertex { normal: change(vertex.normal), ..*vertex });
        let mesh = Mesh::new("cube", mesh.topology(), vertices.collect(), mesh.indices().to_vec())?;
        let (mesh, material) = (scene.add(mesh)?, scene.add(Material::default())?);
        scene.add_object(RenderObject { scale: Vec3::splat(3.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
        draw(&scene)
    };
    let right = with(|normal| normal)?;
    assert_alike(&with(|_| [0.0; 3])?, &right)?;
    assert_alike(&with(|normal| normal.map(|component| component * 1e-12))?, &right)
}

fn far_away() -> Result<(), Failed> {
    let near = draw(&field(300))?;
    for distance in [1e3, 1e6, 1e9, 4e9] {
        let mut scene = field(300);
        let shift = DVec3::new(distance, -distance * 0.5, distance * 0.25);
        for camera in &mut scene.cameras {
            camera.position += shift;
        }
        for light in &mut scene.lights {
            if let drawloom::scene::Light::Point { position, .. } = light {
                *position += shift;
            }
        }
        for handle in scene.objects().collect::<Vec<_>>() {
            let mut object = scene.object(handle)?;
            object.position += shift;
            scene.replace_object(handle, object)?;
        }
        assert_alike(&draw(&scene)?, &near)
            .map_err(|failed| format!("at {distance} m: {}", failed.message().unwrap_or("")))?;
    }
    Ok(())
}

fn two_views() -> Result<(), Failed> {
    let scene = field(200);
    let mut fixture = Fixture::new()?;
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    for (view, camera) in scene.cameras.iter().enumerate() {
        let together = submission.read(view, "picture")?;
        if [together.width, together.height] != camera.size {
            return Err(format!("view {view} is {}x{}", together.width, together.height).into());
        }
        let mut alone = field(200);
        alone.cameras = vec![camera.clone()];
        if draw(&alone)? != together {
            return Err(format!("view {view} differs from the same view alone").into());
        }
    }
    Ok(())
}
