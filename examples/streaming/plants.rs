//! What stands on the land: trees and rocks, of which all tiles share the meshes.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Material, Mesh, RenderObject, Scene, SceneError, Topology, Vertex};

use crate::land::{WATER, chance, height};
use crate::tile::{SIDE, TileIndex};

/// The meshes and materials of trees and rocks.
pub struct Plants {
    tree: Handle<Mesh>,
    trees: [Handle<Material>; 3],
    rock: Handle<Mesh>,
    stone: Handle<Material>,
}

impl Plants {
    /// # Errors
    /// If the scene refuses one of them.
    pub fn new(scene: &mut Scene) -> Result<Self, SceneError> {
        let mut material = |name: &str, diffuse: [f32; 3]| {
            scene.add(Material { name: name.to_owned(), diffuse: diffuse.into(), ..Material::default() })
        };
        let trees = [
            material("spruce", [0.045, 0.11, 0.05])?,
            material("pine", [0.07, 0.14, 0.05])?,
            material("larch", [0.17, 0.18, 0.05])?,
        ];
        let stone = material("stone", [0.30, 0.28, 0.26])?;
        Ok(Self { tree: scene.add(tree()?)?, trees, rock: scene.add(rock()?)?, stone })
    }

    /// What stands on a tile: the same every time.
    pub fn on(&self, tile: TileIndex) -> Vec<RenderObject> {
        /// Places along a side, of which each has a tree, a rock or nothing.
        const PLACES: i64 = 7;
        let mut objects = Vec::new();
        for number in 0..PLACES * PLACES {
            let (column, row) = (tile.x * PLACES + number % PLACES, tile.z * PLACES + number / PLACES);
            let random = |purpose| chance(column, row, purpose);
            let step = SIDE / PLACES as f64;
            let (x, z) = ((column as f64 + random(1)) * step, (row as f64 + random(2)) * step);
            let ground = height(x, z);
            let slope = (height(x + 2.0, z) - ground).abs().max((height(x, z + 2.0) - ground).abs()) / 2.0;
            let forest = chance(column.div_euclid(9), row.div_euclid(9), 3) > 0.45;
            let grows = ground > WATER + 4.0 && ground < 105.0 && slope < 0.6;
            let (mesh, material, scale, sink) = if grows && random(4) < if forest { 0.62 } else { 0.1 } {
                let size = 5.0 + 6.0 * random(5) as f32;
                let kind = (random(6) * 2.999) as usize;
                (self.tree, self.trees[kind], Vec3::new(size * 0.34, size, size * 0.34), 0.3)
            } else if ground > WATER - 1.0 && slope < 0.8 && random(7) < 0.07 + f64::from(slope) * 0.1 {
                let size = 0.5 + 2.4 * random(8).powi(3) as f32;
                (self.rock, self.stone, Vec3::new(size * 1.3, size * 0.8, size), size * (0.2 + slope))
            } else {
                continue;
            };
            let mut object = RenderObject::new(mesh, material, DVec3::new(x, f64::from(ground - sink), z));
            object.orientation = Quat::from_rotation_y(random(9) as f32 * std::f32::consts::TAU);
            object.scale = scale;
            objects.push(object);
        }
        objects
    }
}

/// A conifer of three cones, one metre high.
fn tree() -> Result<Mesh, SceneError> {
    const SIDES: usize = 7;
    let mut corners = Vec::new();
    for (bottom, top, radius) in [(0.02, 0.52, 0.5), (0.26, 0.78, 0.38), (0.5, 1.0, 0.25)] {
        for side in 0..SIDES {
            let corner = |side: usize| {
                let angle = side as f32 / SIDES as f32 * std::f32::consts::TAU;
                Vec3::new(angle.cos() * radius, bottom, angle.sin() * radius)
            };
            corners.push([corner(side + 1), corner(side), Vec3::Y * top]);
        }
    }
    flat("tree", &corners)
}

/// A boulder: an octahedron, divided once, with corners in and out.
fn rock() -> Result<Mesh, SceneError> {
    let ends = [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z];
    let rough = |corner: Vec3| {
        let place = (corner * 40.0).round();
        let bump = chance(place.x as i64 * 31 + place.y as i64, place.z as i64, 10) as f32;
        corner.normalize() * (0.75 + 0.4 * bump)
    };
    let mut corners = Vec::new();
    for (index, &one) in ends.iter().enumerate() {
        let next = ends[(index + 1) % ends.len()];
        for [a, b, c] in [[next, one, Vec3::Y], [one, next, Vec3::NEG_Y]] {
            let middles = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].map(Vec3::normalize);
            let [ab, bc, ca] = middles;
            corners.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], middles].map(|triangle| triangle.map(rough)));
        }
    }
    flat("rock", &corners)
}

/// A mesh of triangles whose corners share no normals.
fn flat(name: &str, triangles: &[[Vec3; 3]]) -> Result<Mesh, SceneError> {
    let vertices = triangles.iter().flat_map(|[a, b, c]| {
        let normal = (*b - *a).cross(*c - *a).normalize().to_array();
        [*a, *b, *c].map(|corner| Vertex { position: corner.to_array(), normal, uv: [0.0; 2] })
    });
    Mesh::new(name, Topology::TriangleList, vertices.collect(), (0..triangles.len() as u32 * 3).collect())
}
