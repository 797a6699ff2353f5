//! The engine's world: its own arrays, one entry for each object.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Assets, Bounds, Camera, ColumnValues, Light, Material, Mesh, SceneError, SceneRef, Topology, Vertex,
};

use crate::metal::{self, METAL, Metal};
use crate::tints::TINT;

/// The positions of the rings in metres, and how far each is turned towards the camera.
const RINGS: [([f64; 3], f32); 3] = [([-9.0, 6.0, 16.0], 0.9), ([0.0, 6.5, 18.0], 1.57), ([9.0, 6.0, 16.0], 0.5)];

/// The material of each ring.
const METALS: [(&str, Metal); 3] = [
    ("gold", Metal { color: [1.0, 1.0, 1.0], roughness: 1.0 }),
    ("copper", Metal { color: [1.0, 0.62, 0.5], roughness: 0.5 }),
    ("blued steel", Metal { color: [0.35, 0.5, 1.0], roughness: 1.6 }),
];

pub struct World {
    pub camera: Camera,
    time: f64,
    lights: Vec<Light>,
    assets: Assets,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
    /// How many objects are in the field; rings follow.
    field: usize,
    /// Red, green, blue, and how much of it is emitted.
    tints: Vec<[f32; 4]>,
}

impl World {
    /// A hilly field of spheres in all colours of the rainbow, and metal rings above it, in a picture of this size.
    pub fn new(field: usize, size: [u32; 2]) -> Result<Self, SceneError> {
        let count = field + RINGS.len();
        let mut assets = Assets::default();
        let sphere = sphere()?;
        let bounds = sphere.bounds();
        let sphere = assets.add(sphere)?;
        let torus = metal::torus()?;
        let torus_bounds = torus.bounds();
        let torus = assets.add(torus)?;
        let white = assets.add(Material { name: "white".into(), diffuse: Vec3::ONE, ..Material::default() })?;
        let metals = METALS.map(|(name, metal)| Material {
            name: name.into(),
            values: Some(METAL.values(metal)),
            ..Material::default()
        });
        let metals = metals.map(|metal| assets.add(metal));
        let tint = |object: usize| {
            let [red, green, blue] = hue(object as f32 / count as f32 * 5.0);
            let emitted = if object.is_multiple_of(97) { 6.0 } else { 0.0 };
            [red, green, blue, emitted]
        };
        let mut world = Self {
            camera: Camera {
                size,
                ..Camera::looking_at("main", DVec3::new(0.0, 9.0, 40.0), DVec3::new(0.0, 0.0, 4.0))
            },
            time: 0.0,
            lights: vec![Light::Directional {
                direction: Vec3::new(-0.5, -0.8, -0.4).normalize(),
                illuminance: Vec3::splat(2.5),
                casts_shadow: true,
            }],
            assets,
            positions: vec![DVec3::ZERO; count],
            orientations: vec![Quat::IDENTITY; count],
            scales: vec![Vec3::splat(0.3); count],
            bounds: vec![bounds; count],
            meshes: vec![sphere; count],
            materials: vec![white; count],
            field,
            tints: (0..count).map(tint).collect(),
        };
        for ((object, (position, turn)), metal) in (field..).zip(RINGS).zip(metals) {
            world.positions[object] = position.into();
            world.orientations[object] = Quat::from_rotation_x(turn);
            world.scales[object] = Vec3::splat(3.0);
            world.bounds[object] = torus_bounds;
            world.meshes[object] = torus;
            world.materials[object] = metal?;
        }
        world.place();
        Ok(world)
    }

    /// One frame later: waves go through the field, and the camera moves sideways.
    pub fn step(&mut self) {
        self.time += 1.0 / 60.0;
        self.camera.position.x = 2.0 * self.time;
        self.place();
    }

    fn place(&mut self) {
        let side = (self.field as f64).sqrt().ceil();
        for (index, position) in self.positions[..self.field].iter_mut().enumerate() {
            let (x, z) = (index as f64 % side - side / 2.0, (index as f64 / side).floor() - side / 2.0);
            let height = (x * 0.15 + self.time * 2.0).sin() + (z * 0.2).cos();
            *position = DVec3::new(x * 0.7, height, z * 0.7);
        }
    }

    /// The engine's own data of objects.
    pub fn columns(&self) -> [ColumnValues<'_>; 1] {
        [TINT.values(&self.tints)]
    }

    pub fn as_scene_ref<'a>(&'a self, columns: &'a [ColumnValues<'a>]) -> SceneRef<'a> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            columns,
            lights: &self.lights,
            cameras: std::slice::from_ref(&self.camera),
            ambient: Vec3::splat(0.08),
            background: Vec3::new(0.02, 0.03, 0.05),
            ..SceneRef::new(&self.assets)
        }
    }
}

/// A colour of the rainbow; the whole numbers are red.
fn hue(turn: f32) -> [f32; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|phase| 0.5 + 0.5 * ((turn + phase) * std::f32::consts::TAU).cos())
}

fn sphere() -> Result<Mesh, SceneError> {
    const COLUMNS: u32 = 12;
    const ROWS: u32 = 8;
    let point = |row: u32, column: u32| {
        let (latitude, longitude) = (
            (row as f32 / ROWS as f32 - 0.5) * std::f32::consts::PI,
            column as f32 / COLUMNS as f32 * std::f32::consts::TAU,
        );
        [latitude.cos() * longitude.cos(), latitude.sin(), -latitude.cos() * longitude.sin()]
    };
    let mut vertices = Vec::new();
    let mut indices = Vec::new();
    for row in 0..=ROWS {
        for column in 0..=COLUMNS {
            let position = point(row, column);
            vertices.push(Vertex { position, normal: position, uv: [0.0; 2] });
            if row < ROWS && column < COLUMNS {
                let first = row * (COLUMNS + 1) + column;
                let above = first + COLUMNS + 1;
                indices.extend([first, first + 1, above + 1, first, above + 1, above]);
            }
        }
    }
    Mesh::new("sphere", Topology::TriangleList, vertices, indices)
}
