//! What a pixel shows, by rays in f64.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Mesh, Projection};

use crate::signs::Sign;

/// What is seen at a pixel that cannot be mistaken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    Background,
    /// A sign, by its index.
    Sign(usize),
    /// An edge runs through it or past it.
    Unsure,
}

/// What a camera sees of signs.
pub struct Oracle<'a> {
    camera: &'a Camera,
    /// Corners relative to the camera, and which sign they are of. None of them faces away.
    triangles: Vec<([DVec3; 3], usize)>,
}

/// How far from an edge, in pixels, the middle of a pixel is to be.
const MARGIN: f64 = 1.0;

impl<'a> Oracle<'a> {
    pub fn new(camera: &'a Camera, mesh: &Mesh, signs: &[Sign]) -> Self {
        let forward = camera.orientation.as_dquat().normalize() * DVec3::NEG_Z;
        let mut triangles = Vec::new();
        for (index, sign) in signs.iter().enumerate() {
            let turn = sign.orientation.as_dquat().normalize();
            // Camera and sign first: both may be far from the origin.
            let origin = sign.position - camera.position;
            let place = |corner: u32| {
                let vertex = Vec3::from(mesh.vertices()[corner as usize].position);
                origin + turn * (sign.scale.as_dvec3() * vertex.as_dvec3())
            };
            let mirrored = sign.scale.to_array().into_iter().filter(|scale| scale.is_sign_negative()).count() % 2 == 1;
            for corners in mesh.indices().as_chunks::<3>().0 {
                let [a, b, c] = corners.map(place);
                let normal = (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
                let to_eye = if is_perspective(camera) { -a } else { -forward };
                if sign.double_sided || normal.dot(to_eye) > 0.0 {
                    triangles.push(([a, b, c], index));
                }
            }
        }
        Self { camera, triangles }
    }

    /// What the pixel in this column and row shows.
    pub fn seen(&self, x: usize, y: usize) -> Seen {
        let at = |across: f64, down: f64| self.hit(x as f64 + 0.5 + across * MARGIN, y as f64 + 0.5 + down * MARGIN);
        let middle = at(0.0, 0.0);
        let around =
            [[-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]];
        if around.iter().any(|&[across, down]| at(across, down) != middle) {
            return Seen::Unsure;
        }
        middle.map_or(Seen::Background, Seen::Sign)
    }

    /// The sign that a ray through a place of the picture meets first, behind the near plane.
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
        let hits =
            self.triangles.iter().filter_map(|(corners, sign)| Some((meets(origin, direction, corners)?, *sign)));
        // The direction is 1 long along the camera's axis, so that the way along it is the depth.
        let seen = hits.filter(|(depth, _)| *depth >= f64::from(camera.near));
        seen.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, sign)| sign)
    }
}

fn is_perspective(camera: &Camera) -> bool {
    matches!(camera.projection, Projection::Perspective { .. })
}

/// As a share of a triangle.
const SEAM: f64 = 1e-10;

/// How far along a ray a triangle is (Möller and Trumbore 1997).
fn meets(origin: DVec3, direction: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (one, other) = (b - a, c - a);
    let across = direction.cross(other);
    let determinant = one.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let way = origin - a;
    let u = way.dot(across) / determinant;
    let up = way.cross(one);
    let v = direction.dot(up) / determinant;
    // So that no ray slips through between two triangles.
    let inside = u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM;
    inside.then(|| other.dot(up) / determinant)
}
