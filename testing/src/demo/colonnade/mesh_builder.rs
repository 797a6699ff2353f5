//! Procedural meshes: flat faces and surfaces of revolution.

use std::f32::consts::{PI, TAU};

use drawloom::glam::{Vec2, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Mesh, Scene, SceneError, Topology, Vertex};

/// A mesh while it is built. Its triangles are counter-clockwise seen from outside.
#[derive(Default)]
pub(super) struct MeshBuilder {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

impl MeshBuilder {
    /// Adds the mesh to a scene.
    ///
    /// # Errors
    /// Returns the errors of [`Mesh::new`] and [`Scene::add`].
    pub(super) fn add_to(self, scene: &mut Scene, name: &str) -> Result<Handle<Mesh>, SceneError> {
        scene.add(Mesh::new(name, Topology::TriangleList, self.vertices, self.indices)?)
    }

    /// Adds a quad with its corners counter-clockwise. The first corner is a texture's lower left.
    pub(super) fn quad(mut self, corners: [Vec3; 4]) -> Self {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize();
        let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners.into_iter().zip(uvs).map(|(corner, uv)| vertex(corner, normal, uv)));
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        self
    }

    /// Adds an upright prism between two heights. The corners (x, z) of the footprint are counter-clockwise seen from
    /// above. Both ends are triangle fans, so the footprint must be convex.
    pub(super) fn prism(mut self, footprint: &[Vec2], bottom: f32, top: f32) -> Self {
        let at = |corner: Vec2, height: f32| Vec3::new(corner.x, height, corner.y);
        for (&from, &to) in footprint.iter().zip(footprint.iter().cycle().skip(1)) {
            self = self.quad([at(from, bottom), at(to, bottom), at(to, top), at(from, top)]);
        }
        for (height, normal) in [(top, Vec3::Y), (bottom, Vec3::NEG_Y)] {
            let first = self.vertices.len() as u32;
            self.vertices.extend(footprint.iter().map(|&corner| vertex(at(corner, height), normal, corner.into())));
            for corner in 1..footprint.len() as u32 - 1 {
                let [one, other] = if height == top { [corner, corner + 1] } else { [corner + 1, corner] };
                self.indices.extend([first, first + one, first + other]);
            }
        }
        self
    }

    /// Adds a box between two corners.
    pub(super) fn cuboid(self, low: Vec3, high: Vec3) -> Self {
        let footprint = [[low.x, low.z], [low.x, high.z], [high.x, high.z], [high.x, low.z]].map(Vec2::from);
        self.prism(&footprint, low.y, high.y)
    }

    /// Adds the surface of revolution of a profile (radius, height), from the bottom up, around the Y axis.
    pub(super) fn revolved(mut self, profile: &[Vec2], revolution: &Revolution) -> Self {
        let bands = profile.len() - 1;
        for band in 0..bands {
            let ends = [profile[band], profile[band + 1]];
            // At a point of a smooth profile, the direction from the previous to the next point.
            let slope = |point: usize| profile[(point + 1).min(bands)] - profile[point.saturating_sub(1)];
            let slopes =
                if revolution.smooth { [slope(band), slope(band + 1)] } else { [ends[1] - ends[0], ends[1] - ends[0]] };
            let first = self.vertices.len() as u32;
            for (end, slope) in ends.into_iter().zip(slopes) {
                self.vertices.extend((0..=revolution.segments).map(|step| revolution.vertex(end, slope, step)));
            }
            let row = revolution.segments as u32 + 1;
            for step in 0..revolution.segments as u32 {
                let [here, next] = [first + step, first + step + 1];
                // A face that touches the axis is a triangle.
                if ends[0].x > 0.0 {
                    self.indices.extend([here, next, next + row]);
                }
                if ends[1].x > 0.0 {
                    self.indices.extend([here, next + row, here + row]);
                }
            }
        }
        self
    }

    /// Adds a wall `width` wide and `thickness` deep, centred on the Y axis, with its bottom at 0 and a round arch of
    /// `radius` cut out of it.
    pub(super) fn arch(mut self, width: f32, radius: f32, height: f32, thickness: f32) -> Self {
        const STEPS: usize = 20;
        let curve = (0..=STEPS).map(|step| {
            let (sine, cosine) = (PI * step as f32 / STEPS as f32).sin_cos();
            Vec2::new(-radius * cosine, radius * sine)
        });
        let sides = [Vec2::new(-width / 2.0, 0.0), Vec2::new(width / 2.0, 0.0)];
        let lower: Vec<_> = [sides[0]].into_iter().chain(curve).chain([sides[1]]).collect();
        let (front, back) = (thickness / 2.0, -thickness / 2.0);
        for pair in lower.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let [above_from, above_to] = [from, to].map(|point| Vec2::new(point.x, height));
            self = self
                .quad([from.extend(front), to.extend(front), above_to.extend(front), above_from.extend(front)])
                .quad([to.extend(back), from.extend(back), above_from.extend(back), above_to.extend(back)])
                .quad([from.extend(back), to.extend(back), to.extend(front), from.extend(front)]);
        }
        let [left, right] = sides.map(|side| [side, Vec2::new(side.x, height)]);
        self.quad([left[0].extend(back), left[0].extend(front), left[1].extend(front), left[1].extend(back)])
            .quad([right[0].extend(front), right[0].extend(back), right[1].extend(back), right[1].extend(front)])
            .quad([left[1].extend(front), right[1].extend(front), right[1].extend(back), left[1].extend(back)])
    }
}

/// How a profile becomes a surface of revolution.
pub(super) struct Revolution {
    /// The number of segments around the axis.
    pub segments: usize,
    /// The number of grooves around the axis, and their depth relative to the radius.
    pub grooves: Option<(usize, f32)>,
    /// Whether normals are smooth along the profile; otherwise each band is shaded flat.
    pub smooth: bool,
}

impl Revolution {
    pub(super) const EDGES: Self = Self { segments: 28, grooves: None, smooth: false };
    pub(super) const CURVE: Self = Self { segments: 28, grooves: None, smooth: true };

    fn vertex(&self, point: Vec2, slope: Vec2, step: usize) -> Vertex {
        let share = step as f32 / self.segments as f32;
        let (sine, cosine) = (share * TAU).sin_cos();
        // The radius is scaled by 1 − depth · sin², and `change` is the derivative of that factor.
        let (shrunk, change) = self.grooves.map_or((1.0, 0.0), |(count, depth)| {
            let angle = share * PI * count as f32;
            (1.0 - depth * angle.sin().powi(2), -depth * count as f32 * angle.sin() * angle.cos())
        });
        let [outward, around] = [Vec3::new(sine, 0.0, cosine), Vec3::new(cosine, 0.0, -sine)];
        let position = outward * (point.x * shrunk) + Vec3::Y * point.y;
        let normal = (around * shrunk + outward * change).cross(outward * (slope.x * shrunk) + Vec3::Y * slope.y);
        vertex(position, normal.normalize(), [share, point.y])
    }
}

/// Cloth that hangs from the X axis in folds, 1 wide and `length` long, as one triangle strip facing +Z.
///
/// # Errors
/// Returns the error of [`Mesh::new`].
pub(super) fn banner(length: f32) -> Result<Mesh, SceneError> {
    const ROWS: u32 = 32;
    let vertices = (0..=ROWS).flat_map(|row| {
        let share = row as f32 / ROWS as f32;
        let (sine, cosine) = (share * TAU * 1.5).sin_cos();
        // The folds grow towards the loose end.
        let depth = 0.09 * share * sine;
        let change = 0.09 * (sine + share * TAU * 1.5 * cosine) / length;
        let normal = Vec3::new(0.0, change, 1.0).normalize();
        [0.5, -0.5].map(|x| vertex(Vec3::new(x, -length * share, depth), normal, [x + 0.5, share]))
    });
    Mesh::new("banner", Topology::TriangleStrip, vertices.collect(), (0..2 * (ROWS + 1)).collect())
}

fn vertex(position: Vec3, normal: Vec3, uv: [f32; 2]) -> Vertex {
    Vertex { position: position.into(), normal: normal.into(), uv }
}
