//! A ray tracer in f64, which predicts pixels.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Mesh, Projection};

use crate::markers::Marker;

/// The prediction for a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prediction {
    Background,
    /// A marker, by its index.
    Marker(usize),
    /// An edge is too close to the pixel to predict it.
    Unsure,
}

/// Predicts which marker each pixel of a camera shows.
pub struct Oracle<'a> {
    camera: &'a Camera,
    /// Front-facing triangles: corners relative to the camera, and the index of the marker.
    triangles: Vec<([DVec3; 3], usize)>,
}

/// The smallest distance of a predictable pixel from an edge, in pixels.
const MARGIN: f64 = 1.0;

impl<'a> Oracle<'a> {
    pub fn new(camera: &'a Camera, mesh: &Mesh, markers: &[Marker]) -> Self {
        let forward = camera.orientation.as_dquat().normalize() * DVec3::NEG_Z;
        let mut triangles = Vec::new();
        for (index, marker) in markers.iter().enumerate() {
            let turn = marker.orientation.as_dquat().normalize();
            // Subtracted first, as both may be far from the origin.
            let origin = marker.position - camera.position;
            let position = |corner: u32| {
                let vertex = Vec3::from(mesh.vertices()[corner as usize].position);
                origin + turn * (marker.scale.as_dvec3() * vertex.as_dvec3())
            };
            let mirrored =
                marker.scale.to_array().into_iter().filter(|scale| scale.is_sign_negative()).count() % 2 == 1;
            for corners in mesh.indices().as_chunks::<3>().0 {
                let [a, b, c] = corners.map(position);
                let normal = (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
                let to_eye = if is_perspective(camera) { -a } else { -forward };
                if marker.double_sided || normal.dot(to_eye) > 0.0 {
                    triangles.push(([a, b, c], index));
                }
            }
        }
        Self { camera, triangles }
    }

    /// The prediction for the pixel in column `x` and row `y`.
    pub fn predict(&self, x: usize, y: usize) -> Prediction {
        let at = |across: f64, down: f64| self.hit(x as f64 + 0.5 + across * MARGIN, y as f64 + 0.5 + down * MARGIN);
        let middle = at(0.0, 0.0);
        let around =
            [[-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]];
        if around.iter().any(|&[across, down]| at(across, down) != middle) {
            return Prediction::Unsure;
        }
        middle.map_or(Prediction::Background, Prediction::Marker)
    }

    /// The marker that a ray through a point of the picture hits first, behind the near plane.
    fn hit(&self, x: f64, y: f64) -> Option<usize> {
        let camera = self.camera;
        let [width, height] = camera.size.map(f64::from);
        let (x, y) = ((x / width * 2.0 - 1.0) * width / height, 1.0 - y / height * 2.0);
        let turn = camera.orientation.as_dquat().normalize();
        let (origin, direction) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let tangent = (f64::from(field_of_view) * 0.5).tan();
                (DVec3::ZERO, turn * DVec3::new(x * tangent, y * tangent, -1.0))
            }
            Projection::Orthographic { height: picture } => {
                let half = f64::from(picture) * 0.5;
                (turn * DVec3::new(x * half, y * half, 0.0), turn * DVec3::NEG_Z)
            }
            other => unreachable!("no main camera is {other:?}"),
        };
        let hits = self
            .triangles
            .iter()
            .filter_map(|(corners, marker)| Some((intersect(origin, direction, corners)?, *marker)));
        // The direction has length 1 along the camera's axis, so the ray parameter is the depth.
        let visible = hits.filter(|(depth, _)| *depth >= f64::from(camera.near));
        visible.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, marker)| marker)
    }
}

fn is_perspective(camera: &Camera) -> bool {
    matches!(camera.projection, Projection::Perspective { .. })
}

/// The tolerance at the edges of triangles, in barycentric coordinates: no ray passes between two triangles.
const EDGE_TOLERANCE: f64 = 1e-10;

/// The ray parameter of an intersection (Möller and Trumbore 1997).
fn intersect(origin: DVec3, direction: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (one, other) = (b - a, c - a);
    let across = direction.cross(other);
    let determinant = one.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let offset = origin - a;
    let u = offset.dot(across) / determinant;
    let up = offset.cross(one);
    let v = direction.dot(up) / determinant;
    let inside = u >= -EDGE_TOLERANCE && v >= -EDGE_TOLERANCE && u + v <= 1.0 + EDGE_TOLERANCE;
    inside.then(|| other.dot(up) / determinant)
}
