//! The scene, its mirror, portals and screen, and the cameras of all views.

use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Camera, ClipPlane, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError, Topology, Vertex, ViewKind,
};
use drawloom_testing::demo;

use crate::surface::Surface;
use crate::{contact_sheet, impostor, mirror_ball, smoke};

/// The pixels of a view.
pub const SIZE: [u32; 2] = [480, 270];

/// How many tiles the camera of the detail is divided into, in each direction.
pub const TILES: u32 = 2;

/// The colonnade with a pool, two portals and a screen.
pub struct Gallery {
    pub scene: Scene,
}

impl Gallery {
    /// # Errors
    /// If the scene cannot be made.
    pub fn new() -> Result<Self, SceneError> {
        let mut scene = demo::colonnade()?;
        let world: Vec<_> = scene.objects().collect();
        for handle in world {
            let Ok(object) = scene.object(handle) else { continue };
            scene.replace_object(handle, RenderObject { layers: Surface::WORLD, ..object })?;
        }
        let square = scene.add(square()?)?;
        let surface = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() })?;
        let frame = scene.add(Material { diffuse: Vec3::new(0.25, 0.16, 0.05), ..Material::default() })?;
        let cuboid = scene.add(Mesh::cuboid("frame", Vec3::ONE)?)?;
        for place in Place::all() {
            let mut object = RenderObject::new(square, surface, place.position);
            (object.orientation, object.scale) = (place.orientation, place.half_size.extend(1.0));
            object.layers = place.surface.layer();
            scene.add_object(object)?;
            for object in place.frame(cuboid, frame) {
                scene.add_object(object)?;
            }
        }
        scene.cameras = cameras();
        scene.lights = Self::lights()?;
        let ball = scene.add(ball()?)?;
        let mut mirror_ball = RenderObject::new(ball, surface, mirror_ball::POSITION);
        (mirror_ball.scale, mirror_ball.layers) = (Vec3::splat(mirror_ball::RADIUS), mirror_ball::LAYER);
        scene.add_object(mirror_ball)?;
        smoke::add_smoke(&mut scene, ball)?;
        if let Some(camera) = scene.cameras.iter().find(|camera| camera.name == impostor::VIEW).cloned() {
            impostor::add_tree(&mut scene, ball, square, &camera)?;
        }
        Ok(Self { scene })
    }

    /// The index of the contact sheet's view.
    pub fn sheet_view(&self) -> usize {
        self.scene.cameras.iter().position(|camera| camera.name == contact_sheet::TARGET).unwrap_or(0)
    }

    /// The scene without a view, and without those that only this view samples.
    pub fn without(&self, view: &str) -> Vec<Camera> {
        let belongs_to = |name: &str| name == view || name.strip_prefix(view).is_some_and(|rest| rest.starts_with('/'));
        self.scene.cameras.iter().filter(|camera| !belongs_to(&camera.name)).cloned().collect()
    }

    /// The views that are drawn for another view's picture.
    pub fn optional_views(&self) -> impl Iterator<Item = &str> {
        self.scene
            .cameras
            .iter()
            .map(|camera| camera.name.as_str())
            .filter(|name| !["main", contact_sheet::TARGET].contains(name))
    }

    /// The colonnade's lights, and a lamp over the pool.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn lights() -> Result<Vec<Light>, SceneError> {
        let mut lights = demo::colonnade()?.lights;
        let (position, intensity) = (DVec3::new(0.4, 1.9, 5.6), Vec3::new(2.4, 1.5, 0.8));
        lights.push(Light::Point { position, intensity, range: 9.0, casts_shadow: true });
        Ok(lights)
    }
}

/// Where a surface is that shows another view.
struct Place {
    surface: Surface,
    position: DVec3,
    /// The surface faces +Z.
    orientation: Quat,
    half_size: Vec2,
}

impl Place {
    fn all() -> [Self; 4] {
        let [entry, exit] = portals();
        [
            Self {
                surface: Surface::pool(),
                position: pool().point,
                orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2),
                half_size: Vec2::new(2.6, 1.5),
            },
            Self {
                surface: Surface::portal(),
                position: entry.0,
                orientation: entry.1,
                half_size: Vec2::new(1.1, 1.5),
            },
            Self { surface: Surface::exit(), position: exit.0, orientation: exit.1, half_size: Vec2::new(1.1, 1.5) },
            Self {
                surface: Surface::screen(),
                position: DVec3::new(-4.4, 3.5, 2.6),
                orientation: Quat::from_rotation_y(0.6),
                half_size: Vec2::new(1.28, 0.72),
            },
        ]
    }

    /// Four bars around the surface.
    fn frame(&self, mesh: Handle<Mesh>, material: Handle<Material>) -> impl Iterator<Item = RenderObject> {
        let half = self.half_size;
        let bars = [
            (half.x, 0.0, 0.06, half.y),
            (-half.x, 0.0, 0.06, half.y),
            (0.0, half.y, half.x, 0.06),
            (0.0, -half.y, half.x, 0.06),
        ];
        bars.into_iter().map(move |(x, y, width, height)| {
            let offset = self.orientation * Vec3::new(x, y, 0.0);
            let mut object = RenderObject::new(mesh, material, self.position + offset.as_dvec3());
            object.orientation = self.orientation;
            object.scale = 2.0 * Vec3::new(width.max(0.06), height.max(0.06), 0.06);
            object.layers = Surface::WORLD;
            object
        })
    }
}

/// The water's surface.
fn pool() -> ClipPlane {
    ClipPlane { point: DVec3::new(-0.2, 0.06, 6.2), normal: Vec3::Y }
}

/// Two portals on both sides of the pool. The second is turned so that the main camera, through the first, sees the
/// first again.
fn portals() -> [(DVec3, Quat); 2] {
    let [entry, exit] = [DVec3::new(-3.6, 1.6, 6.6), DVec3::new(4.4, 1.6, 4.8)];
    let facing = |from: DVec3, to: DVec3| Quat::from_rotation_arc(Vec3::Z, (to - from).normalize().as_vec3());
    [(entry, facing(entry, exit)), (exit, facing(exit, exit + DVec3::new(-0.3, 0.0, 0.95)))]
}

fn camera(name: &str, position: DVec3, target: DVec3, degrees: f32) -> Camera {
    let projection = Projection::Perspective { field_of_view: degrees.to_radians() };
    Camera { projection, size: SIZE, ..Camera::looking_at(name, position, target) }
}

/// The cameras of all views, shadow maps aside. Their order does not matter.
fn cameras() -> Vec<Camera> {
    let main = camera("main", DVec3::new(1.4, 2.4, 11.8), DVec3::new(-0.8, 1.3, 2.0), 60.0);
    let guest = camera("guest", DVec3::new(-2.2, 1.7, 10.2), DVec3::new(0.4, 1.2, 3.0), 65.0);
    let screen = camera("screen", DVec3::new(2.5, 6.0, 10.5), DVec3::new(-0.6, 0.5, 4.0), 60.0);
    let detail = camera("detail", DVec3::new(0.6, 1.7, 4.8), DVec3::new(-3.4, 2.3, -6.0), 40.0);
    let [entry, exit] = portals();
    let portal = main.through_portal("portal", entry, exit);
    let inner = portal.through_portal("portal", entry, exit);
    let [width, height] = contact_sheet::SIZE;
    // From above, without perspective.
    let plan = Camera::looking_at("plan", DVec3::new(0.0, 30.0, 2.0), DVec3::new(0.0, 0.0, 2.0));
    let plan = Camera { projection: Projection::Orthographic { height: 16.0 }, far: 60.0, size: SIZE, ..plan };
    let mut cameras = vec![
        main.reflected("pool", pool()),
        guest.reflected("pool", pool()),
        inner,
        portal,
        Camera { kind: ViewKind::Reflection, ..screen },
    ];
    cameras.extend((0..TILES * TILES).map(|tile| {
        let camera = detail.tile([tile % TILES, tile / TILES], TILES);
        Camera { name: format!("tiles/{tile}"), ..camera }
    }));
    cameras.extend(mirror_ball::cameras());
    cameras.extend(impostor::camera(&main, None));
    cameras.extend([detail, guest, main, plan]);
    for camera in &mut cameras {
        impostor::choose_layers(camera);
    }
    let sheet = camera(contact_sheet::TARGET, DVec3::ZERO, DVec3::NEG_Z, 60.0);
    cameras.push(Camera { kind: ViewKind::Post, size: [width, height], ..sheet });
    cameras
}

/// A square of 2 m that faces +Z.
fn square() -> Result<Mesh, SceneError> {
    let corner =
        |x: f32, y: f32| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [x * 0.5 + 0.5, 0.5 - y * 0.5] };
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Mesh::new("square", Topology::TriangleList, corners, vec![0, 1, 2, 2, 3, 0])
}

/// A ball of radius 1.
fn ball() -> Result<Mesh, SceneError> {
    const RINGS: u32 = 20;
    const SEGMENTS: u32 = 40;
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for ring in 0..=RINGS {
        for segment in 0..=SEGMENTS {
            let [u, v] = [segment as f32 / SEGMENTS as f32, ring as f32 / RINGS as f32];
            let (turn, down) = (u * std::f32::consts::TAU, v * std::f32::consts::PI);
            let normal = Vec3::new(down.sin() * turn.sin(), down.cos(), down.sin() * turn.cos()).to_array();
            vertices.push(Vertex { position: normal, normal, uv: [u, v] });
            if ring < RINGS && segment < SEGMENTS {
                let first = ring * (SEGMENTS + 1) + segment;
                let below = first + SEGMENTS + 1;
                indices.extend([first, below, below + 1, first, below + 1, first + 1]);
            }
        }
    }
    Mesh::new("ball", Topology::TriangleList, vertices, indices)
}
