//! Small scenes for tests.

pub mod everything;
pub mod leveled;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Blend, Camera, Light, Material, Mesh, RenderObject, Scene, SceneError, Texture, Topology, Vertex,
};

/// A cube with sides of 2 m and front faces on the outside.
pub fn cube() -> Mesh {
    cube_facing(1.0)
}

/// The same cube with the normals pointing inwards and the same winding.
pub fn cube_with_flipped_normals() -> Mesh {
    cube_facing(-1.0)
}

fn cube_facing(sign: f32) -> Mesh {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let right = normal.any_orthonormal_vector();
        let up = normal.cross(right);
        let first = vertices.len() as u32;
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let position = (normal + right * x + up * y).to_array();
            let normal = (normal * sign).to_array();
            vertices.push(Vertex { position, normal, uv: [x * 0.5 + 0.5, 0.5 - y * 0.5] });
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    Mesh::new("cube", Topology::TriangleList, vertices, indices).unwrap()
}

/// A square with sides of 2 m that faces +Z. The first row of its texture is at its upper edge.
pub fn square(topology: Topology) -> Mesh {
    let corner =
        |x: f32, y: f32| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [x * 0.5 + 0.5, 0.5 - y * 0.5] };
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let indices = match topology {
        Topology::TriangleList => vec![0, 1, 2, 2, 1, 3],
        Topology::TriangleStrip => vec![0, 1, 2, 3],
    };
    Mesh::new("square", topology, corners, indices).unwrap()
}

/// The scene with `change` applied to every mesh.
pub fn with_meshes(mut scene: Scene, change: impl Fn(&Mesh) -> Mesh) -> Scene {
    let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, change(mesh))).collect();
    meshes.into_iter().for_each(|(handle, mesh)| scene.replace(handle, mesh).unwrap());
    scene
}

/// The mesh as a triangle list.
pub fn as_list(mesh: &Mesh) -> Mesh {
    let indices = mesh.triangles().flatten().collect();
    Mesh::new(mesh.name(), Topology::TriangleList, mesh.vertices().to_vec(), indices).unwrap()
}

/// The mesh with triangle culling.
pub fn culled(mesh: &Mesh) -> Mesh {
    mesh.clone().with_triangle_culling(true)
}

/// `count` boxes and squares in all directions, with several meshes and materials, opaque and blended, some mirrored,
/// with two lights and two cameras. Every call returns the same scene.
pub fn field(count: usize) -> Scene {
    make_field(count).unwrap()
}

fn make_field(count: usize) -> Result<Scene, SceneError> {
    let mut scene = Scene::new();
    let meshes =
        [scene.add(cube())?, scene.add(square(Topology::TriangleStrip))?, scene.add(square(Topology::TriangleList))?];
    let mut materials = Vec::new();
    for (index, blend) in [Blend::None, Blend::None, Blend::Alpha, Blend::None, Blend::Additive].into_iter().enumerate()
    {
        let diffuse = Vec3::new(0.2 + 0.15 * index as f32, 0.6, 0.9 - 0.15 * index as f32);
        let double_sided = index % 2 == 0;
        let name = format!("material {index}");
        materials.push(scene.add(Material {
            name,
            diffuse,
            blend,
            double_sided,
            opacity: 0.5,
            ..Material::default()
        })?);
    }
    let mut random = Random(7);
    for index in 0..count {
        let mut within = |low: f64, high: f64| low + random.next() * (high - low);
        let mut object = RenderObject::new(
            meshes[index % meshes.len()],
            materials[index % materials.len()],
            DVec3::new(within(-20.0, 20.0), within(-8.0, 8.0), within(-40.0, 20.0)),
        );
        object.orientation = Quat::from_rotation_y(within(0.0, std::f64::consts::TAU) as f32);
        object.scale = Vec3::splat(within(0.2, 1.0) as f32);
        if index % 11 == 0 {
            object.scale.x = -object.scale.x;
        }
        scene.add_object(object)?;
    }
    scene.lights = vec![
        Light::Directional {
            direction: Vec3::new(0.3, -0.8, -0.5).normalize(),
            illuminance: Vec3::splat(2.0),
            casts_shadow: false,
        },
        Light::Point {
            position: DVec3::new(0.0, 3.0, -5.0),
            intensity: Vec3::new(30.0, 10.0, 5.0),
            range: 40.0,
            casts_shadow: false,
        },
    ];
    scene.ambient = Vec3::splat(0.1);
    scene.background = Vec3::new(0.02, 0.03, 0.05);
    scene.cameras = vec![
        sized(Camera::looking_at("front", DVec3::new(0.0, 2.0, 24.0), DVec3::ZERO), [320, 180]),
        sized(Camera::looking_at("side", DVec3::new(-24.0, 6.0, -10.0), DVec3::new(0.0, 0.0, -10.0)), [200, 200]),
    ];
    Ok(scene)
}

/// `count` squares, each with a texture and a material of its own, and the textures.
pub fn textured(count: u32) -> (Scene, Vec<Handle<Texture>>) {
    let mut scene = field(0);
    let mesh = scene.add(square(Topology::TriangleList)).unwrap();
    let mut textures = Vec::new();
    for index in 0..count {
        let texture = scene.add(Texture::new("one", 1, 1, vec![index as u8, 9, 9, 255]).unwrap()).unwrap();
        let material = scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        textures.push(texture);
    }
    (scene, textures)
}

/// The camera with a picture of this size.
pub fn sized(mut camera: Camera, size: [u32; 2]) -> Camera {
    camera.size = size;
    camera
}

/// Reproducible pseudo-random numbers from 0 to 1 (xorshift64*, Marsaglia 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
