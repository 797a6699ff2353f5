//! Meshes with levels of detail.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, LevelOfDetail, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex};

use super::sized;

/// A sphere with a radius of 1 m of 960 triangles, and two coarser levels of 224 and 48 triangles.
pub fn globe() -> Mesh {
    let (rows, columns) = (16_u32, 32_u32);
    let mut vertices = Vec::new();
    for row in 0..=rows {
        for column in 0..columns {
            let (down, around) = (
                std::f64::consts::PI * f64::from(row) / f64::from(rows),
                std::f64::consts::TAU * f64::from(column) / f64::from(columns),
            );
            let normal = DVec3::new(down.sin() * around.sin(), down.cos(), down.sin() * around.cos()).as_vec3();
            let uv = [column as f32 / columns as f32, row as f32 / rows as f32];
            vertices.push(Vertex { position: normal.to_array(), normal: normal.to_array(), uv });
        }
    }
    let with_step = |step: u32| {
        let mut indices = Vec::new();
        for row in (0..rows).step_by(step as usize) {
            for column in (0..columns).step_by(step as usize) {
                let vertex = |row, column| row * columns + column % columns;
                let [upper, lower] = [row, row + step];
                let left = [upper, lower].map(|row| vertex(row, column));
                let right = [upper, lower].map(|row| vertex(row, column + step));
                if lower < rows {
                    indices.extend([left[0], left[1], right[1]]);
                }
                if upper > 0 {
                    indices.extend([left[0], right[1], right[0]]);
                }
            }
        }
        indices
    };
    let levels = [2, 4].map(|step| {
        let indices = with_step(step);
        let error = depth_below_unit_sphere(&vertices, &indices);
        LevelOfDetail::new(indices, error)
    });
    let mesh = Mesh::new("globe", Topology::TriangleList, vertices, with_step(1)).unwrap();
    mesh.with_levels(levels).unwrap()
}

/// How far the deepest triangle is below the unit sphere that its corners are on. All surfaces around the centre that
/// lie between this depth and the sphere are within it of each other.
fn depth_below_unit_sphere(vertices: &[Vertex], indices: &[u32]) -> f32 {
    let position = |index: &u32| Vec3::from(vertices[*index as usize].position).as_dvec3();
    let distances = indices.chunks_exact(3).map(|corners| {
        let [a, b, c] = [0, 1, 2].map(|corner| position(&corners[corner]));
        (b - a).cross(c - a).normalize().dot(a)
    });
    ((1.0 - distances.fold(1.0, f64::min)) as f32).next_up()
}

/// The mesh with a level of half of its triangles, whose error is larger than the mesh; unchanged if it has one
/// triangle.
pub fn halved(mesh: &Mesh) -> Mesh {
    let corners = mesh.indices().len();
    let half = match mesh.topology() {
        Topology::TriangleList => corners / 6 * 3,
        Topology::TriangleStrip => corners - 1,
    };
    let level = LevelOfDetail::new(mesh.indices()[..half].to_vec(), mesh.bounds().radius * 2.0 + 1.0);
    mesh.clone().with_levels([level]).unwrap_or_else(|_| mesh.clone())
}

/// The triangles of the mesh's coarsest level, as a mesh without levels.
pub fn coarsest(mesh: &Mesh) -> Mesh {
    let Some(level) = mesh.levels().last() else { return mesh.clone() };
    let (vertices, indices) = (mesh.vertices().to_vec(), level.indices().to_vec());
    Mesh::new(mesh.name(), mesh.topology(), vertices, indices).unwrap().with_triangle_culling(mesh.culls_triangles())
}

/// The mesh without levels.
pub fn whole(mesh: &Mesh) -> Mesh {
    mesh.clone().with_levels([]).unwrap()
}

/// A square with sides of 2 m that faces +Z, whose levels are narrower by their errors on the left and on the right.
/// Each level draws the same two triangles several times, the mesh itself eight times.
fn plate() -> Mesh {
    let errors = [0.0].into_iter().chain((0..LevelOfDetail::MAX_COUNT).map(|level| 0.005 * (1 << level) as f32));
    let corner = |x: f32, y: f32| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
    let corners = |error: f32| [-1.0, 1.0].map(|y| [error - 1.0, 1.0 - error].map(|x| corner(x, y)));
    let vertices = errors.clone().flat_map(corners).flatten().collect();
    let indices = |level: u32| [0, 1, 3, 0, 3, 2].map(|corner| level * 4 + corner).repeat(8 - level as usize);
    let levels = (0..).zip(errors).skip(1).map(|(level, error)| LevelOfDetail::new(indices(level), error));
    Mesh::new("plate", Topology::TriangleList, vertices, indices(0)).unwrap().with_levels(levels).unwrap()
}

/// Plates of different colours that shine by themselves, in a row that leads away from the camera, before a black
/// background. The camera is so far away that an error is about as large at the nearest point of a plate's bounds as at
/// the plate.
pub fn plates() -> Scene {
    let mut scene = Scene::new();
    let plate = scene.add(plate()).unwrap();
    for index in 0..14 {
        let emission = Vec3::new(0.25 + f64::from(index % 3) as f32 * 0.25, f64::from(index % 2) as f32, 1.0);
        let material = scene.add(Material { diffuse: Vec3::ZERO, emission, ..Material::default() }).unwrap();
        let position = DVec3::new(f64::from(index) * 2.6 - 9.0, f64::from(index % 3) - 1.0, f64::from(index) * -5.0);
        scene.add_object(RenderObject::new(plate, material, position)).unwrap();
    }
    let projection = Projection::Perspective { field_of_view: 0.2 };
    let camera = Camera { projection, ..Camera::looking_at("main", DVec3::Z * 60.0, DVec3::ZERO) };
    scene.cameras = vec![sized(camera, [640, 360])];
    scene
}

/// The largest distance in pixels between a pixel that is `marked` and the nearest one that is at the border, or
/// differs from a neighbour in one of some pictures, which are rows of `width` pixels.
pub fn distance_from_edges<T: PartialEq>(pictures: &[&[T]], width: usize, marked: impl Fn(usize) -> bool) -> f64 {
    let coordinates = |pixel: usize| [(pixel % width) as f64, (pixel / width) as f64];
    let count = pictures[0].len();
    let rows = (0..count - width).map(|pixel| [pixel, pixel + width]);
    let columns = (0..count - 1).filter(|pixel| pixel % width + 1 < width).map(|pixel| [pixel, pixel + 1]);
    let differs = |[one, other]: &[usize; 2]| pictures.iter().any(|picture| picture[*one] != picture[*other]);
    let at_border = |pixel: &usize| {
        let (column, row) = (pixel % width, pixel / width);
        column == 0 || row == 0 || column + 1 == width || (row + 1) * width == count
    };
    let edges = rows.chain(columns).filter(differs).flatten().chain((0..count).filter(at_border));
    let edges: Vec<_> = edges.map(coordinates).collect();
    let nearest = |pixel: usize| {
        let [x, y] = coordinates(pixel);
        edges.iter().map(|edge| (x - edge[0]).hypot(y - edge[1])).fold(f64::INFINITY, f64::min)
    };
    (0..count).filter(|&pixel| marked(pixel)).map(nearest).fold(0.0, f64::max)
}
