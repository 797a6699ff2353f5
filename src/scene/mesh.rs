//! Triangle meshes.

use std::ops::Range;

use glam::Vec3;

use super::SceneError;

/// A mesh: vertices, indices into them, and how indices make triangles. Right-handed, counter-clockwise triangles face
/// the viewer, lengths in metres in the object's own space.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    name: String,
    topology: Topology,
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    bounds: Bounds,
    corners: [Vec3; 2],
    longest_edge: f32,
    culls_triangles: bool,
}

impl Mesh {
    /// A mesh, with its bounds and the length of its longest edge.
    ///
    /// # Errors
    /// If it has no triangle, if an index points past the vertices, if a triangle list is not made of whole triangles,
    /// if a vertex is not finite, or if no sphere of a finite radius holds them all.
    pub fn new(
        name: impl Into<String>,
        topology: Topology,
        vertices: Vec<Vertex>,
        indices: Vec<u32>,
    ) -> Result<Self, SceneError> {
        let name = name.into();
        if indices.len() < 3 {
            return Err(SceneError::EmptyMesh { mesh: name });
        }
        if topology == Topology::TriangleList && !indices.len().is_multiple_of(3) {
            return Err(SceneError::PartialTriangle { mesh: name, indices: indices.len() });
        }
        if let Some(&index) = indices.iter().find(|&&index| index as usize >= vertices.len()) {
            return Err(SceneError::IndexOutOfRange { mesh: name, index, vertices: vertices.len() });
        }
        if let Some(vertex) = vertices.iter().position(|vertex| !vertex.is_finite()) {
            return Err(SceneError::NonFiniteVertex { mesh: name, vertex });
        }
        let mesh = Self::measured(name, topology, vertices, indices);
        if !mesh.bounds.is_valid() {
            return Err(SceneError::MeshTooLarge { mesh: mesh.name });
        }
        Ok(mesh)
    }

    /// A mesh of parts that are known to fit each other.
    pub(super) fn measured(name: String, topology: Topology, vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        let bounds = Bounds::around(vertices.iter().map(|vertex| Vec3::from(vertex.position)));
        let start = Vec3::from(vertices.first().map_or([0.0; 3], |vertex| vertex.position));
        let corners = vertices.iter().fold([start; 2], |[low, high], vertex| {
            let place = Vec3::from(vertex.position);
            [low.min(place), high.max(place)]
        });
        let mut mesh =
            Self { name, topology, vertices, indices, bounds, corners, longest_edge: 0.0, culls_triangles: false };
        let triangles = mesh.triangles().map(|corners| corners.map(|corner| mesh.vertices[corner as usize]));
        let edges = triangles.filter(has_three_places).flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        let longest_squared = edges.map(|[one, other]| one.distance_squared(&other)).fold(0.0, f64::max);
        mesh.longest_edge = root_rounded_up(longest_squared);
        mesh
    }

    /// The same mesh with its triangles culled, or not. If they are, they are looked at for every view in each frame before they are
    /// drawn, and those that nobody sees are left out, as
    /// [`RenderView::cull_triangles`](crate::view::RenderView::cull_triangles) tells them. A strip becomes a list for it.
    ///
    /// It pays for large meshes where the device is what is waited for, and has more to do for a vertex than a processor for a
    /// triangle. Each object of such a mesh is a draw of its own. It is for meshes that are drawn where they stand: a shader that moves
    /// vertices would be without triangles that it brings into view.
    ///
    /// Frames then need memory for each triangle and pass: some 16 bytes, and 12 to 18 on the device. A pass looks at 11 million of them
    /// at most; objects beyond are drawn whole.
    pub fn with_triangles_culled(mut self, culled: bool) -> Self {
        if culled && self.topology == Topology::TriangleStrip {
            (self.topology, self.indices) = (Topology::TriangleList, self.triangles().flatten().collect());
        }
        self.culls_triangles = culled;
        self
    }

    /// Whether triangles of it that nobody sees are left out of each view: see [`Mesh::with_triangles_culled`].
    pub fn culls_triangles(&self) -> bool {
        self.culls_triangles
    }

    /// What it is called in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How indices make triangles.
    pub fn topology(&self) -> Topology {
        self.topology
    }

    /// The vertices.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// The indices, each below the number of vertices.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The sphere that holds every vertex.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The lowest and the highest corner of the box around its vertices, along the axes of object space, in metres.
    pub fn corners(&self) -> [Vec3; 2] {
        self.corners
    }

    /// The length of the longest edge of its triangles, in metres in object space: rounded up from f64, and infinite past
    /// the end of f32. A triangle with two corners at one place draws nothing, and does not count.
    pub fn longest_edge(&self) -> f32 {
        self.longest_edge
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        match self.topology {
            Topology::TriangleList => self.indices.len() / 3,
            Topology::TriangleStrip => self.indices.len() - 2,
        }
    }

    /// The indices of each triangle's corners, counter-clockwise seen from its visible side.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles_in(0..self.triangle_count())
    }

    /// Those of some of the triangles, by their number.
    ///
    /// # Panics
    /// If there are not as many.
    pub(crate) fn triangles_in(&self, numbers: Range<usize>) -> impl Iterator<Item = [u32; 3]> + '_ {
        let (step, turned) = match self.topology {
            Topology::TriangleList => (3, false),
            Topology::TriangleStrip => (1, true),
        };
        let indices = &self.indices[numbers.start * step..];
        let triangles = numbers.zip(indices.array_windows().step_by(step));
        triangles.map(move |(number, &[a, b, c])| if turned && number % 2 == 1 { [a, c, b] } else { [a, b, c] })
    }
}

/// Whether a triangle's corners are at three different places. One that has no three of them has no area either, and stays
/// without one however it is projected.
pub(super) fn has_three_places(triangle: &[Vertex; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| vertex.position);
    a != b && b != c && c != a
}

/// The smallest f32 whose square is not below `square`.
fn root_rounded_up(square: f64) -> f32 {
    let root = square.sqrt() as f32;
    // Squares of f32 are exact in f64.
    if f64::from(root) * f64::from(root) < square { root.next_up() } else { root }
}

/// A vertex, as it lies in memory and in the vertex buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In object space, in metres.
    pub position: [f32; 3],
    /// In object space. Only its direction counts; a normal of 0 stands for the triangle's own.
    pub normal: [f32; 3],
    /// Texture coordinates: (0, 0) is the picture's top left, (1, 1) its bottom right, and they repeat.
    pub uv: [f32; 2],
}

impl Vertex {
    /// The square of the distance in metres, the same to the bit from either of the two.
    pub(super) fn distance_squared(&self, other: &Self) -> f64 {
        Vec3::from(self.position).as_dvec3().distance_squared(Vec3::from(other.position).as_dvec3())
    }

    fn is_finite(&self) -> bool {
        self.position.iter().chain(&self.normal).chain(&self.uv).all(|value| value.is_finite())
    }
}

/// How indices make triangles (M listing 10.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Topology {
    /// Every three indices are a triangle.
    #[default]
    TriangleList = 0,
    /// Every index from the third on makes a triangle with the two before it; every second one is wound the other way.
    TriangleStrip = 1,
}

/// A bounding sphere in object space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Its centre, in metres.
    pub center: Vec3,
    /// Its radius, in metres; never negative.
    pub radius: f32,
}

impl Bounds {
    /// A sphere that holds all points: centred on their box, and grown by what rounding may have lost.
    pub fn around(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let Some((low, high)) = points.clone().fold(None, |range: Option<(Vec3, Vec3)>, point| {
            let (low, high) = range.unwrap_or((point, point));
            Some((low.min(point), high.max(point)))
        }) else {
            return Self::default();
        };
        let center = low * 0.5 + high * 0.5;
        let distance = points.map(|point| point.as_dvec3().distance(center.as_dvec3())).fold(0.0, f64::max);
        Self { center, radius: (distance as f32).next_up() }
    }

    /// Whether centre and radius are finite, and the radius is not negative.
    pub fn is_valid(&self) -> bool {
        self.center.is_finite() && self.radius.is_finite() && self.radius >= 0.0
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    fn corner(x: f32, y: f32, z: f32) -> Vertex {
        Vertex { position: [x, y, z], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] }
    }

    #[test]
    fn bad_meshes_are_refused_by_name() {
        let corners = vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0)];
        let make = |vertices, indices| Mesh::new("leaf", Topology::TriangleList, vertices, indices);
        assert!(matches!(make(corners.clone(), vec![]), Err(SceneError::EmptyMesh { mesh }) if mesh == "leaf"));
        assert!(matches!(make(corners.clone(), vec![0, 1, 2, 0]), Err(SceneError::PartialTriangle { indices: 4, .. })));
        let outside = make(corners.clone(), vec![0, 1, 3]);
        assert!(matches!(outside, Err(SceneError::IndexOutOfRange { index: 3, vertices: 3, .. })));
        let broken = vec![corners[0], corners[1], corner(f32::NAN, 0.0, 0.0)];
        assert!(matches!(make(broken, vec![0, 1, 2]), Err(SceneError::NonFiniteVertex { vertex: 2, .. })));
        let huge = vec![corner(f32::MAX, f32::MAX, 0.0), corner(f32::MIN, f32::MIN, 0.0), corners[2]];
        assert!(matches!(make(huge, vec![0, 1, 2]), Err(SceneError::MeshTooLarge { .. })));
        assert!(make(corners, vec![0, 1, 2]).is_ok());
    }

    #[test]
    fn bounds_hold_every_point_at_every_magnitude() {
        for scale in [1e-20_f32, 1e-3, 1.0, 1e6, 1e30] {
            let points = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-4.0, 0.1, 7.3), Vec3::new(0.3, -9.0, 2.0)];
            let scaled = points.map(|point| point * scale);
            let bounds = Bounds::around(scaled.into_iter());
            for point in scaled {
                assert!(point.as_dvec3().distance(bounds.center.as_dvec3()) <= f64::from(bounds.radius), "{scale}");
            }
        }
    }

    /// Both are held against the edges of the list that the strip is.
    #[test]
    fn the_longest_edge_is_rounded_up_and_no_further() {
        for scale in [1e-40_f32, 1e-20, 0.1, 1.0, 3e7, 1e30] {
            let places = [[0.1, 0.2, 0.3], [1.7, 0.0, -0.4], [0.3, 2.9, 0.7], [-0.9, 2.2, 5.3], [0.3, 0.2, 0.1]];
            let corners: Vec<_> = places.iter().map(|[x, y, z]| corner(x * scale, y * scale, z * scale)).collect();
            let strip = Mesh::new("strip", Topology::TriangleStrip, corners.clone(), vec![0, 1, 2, 3, 4]).unwrap();
            let list = vec![0, 1, 2, 1, 3, 2, 2, 3, 4];
            assert!(strip.triangles().flatten().eq(list.iter().copied()));
            let edges = [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3], [2, 4], [3, 4]];
            let place = |index: usize| Vec3::from(corners[index].position).as_dvec3();
            let longest = edges.iter().map(|&[a, b]| place(a).distance(place(b))).fold(0.0, f64::max);
            for mesh in [&strip, &Mesh::new("list", Topology::TriangleList, corners.clone(), list).unwrap()] {
                let edge = mesh.longest_edge();
                assert!(
                    f64::from(edge) >= longest && f64::from(edge.next_down()) < longest,
                    "{scale}: {edge} {longest}"
                );
            }
        }
    }

    #[test]
    fn an_edge_that_f32_can_hold_is_not_rounded() {
        let longest_of = |corners: [Vertex; 3]| {
            Mesh::new("leaf", Topology::TriangleList, corners.to_vec(), vec![0, 1, 2]).unwrap().longest_edge()
        };
        assert_eq!(longest_of([corner(0.0, 0.0, 0.0), corner(3.0, 0.0, 0.0), corner(0.0, 4.0, 0.0)]), 5.0);
        assert_eq!(
            longest_of([corner(0.5, 0.0, 0.0), corner(0.0, 0.5, 0.0), corner(0.5, 0.5, 0.0)]),
            0.5_f32.sqrt().next_up()
        );
        let far = f32::MAX * 0.75;
        assert_eq!(longest_of([corner(far, 0.0, 0.0), corner(-far, 0.0, 0.0), corner(0.0, 1.0, 0.0)]), f32::INFINITY);
        assert_eq!(longest_of([corner(0.0, 0.0, 0.0), corner(9.0, 0.0, 0.0), corner(9.0, 0.0, 0.0)]), 0.0);
    }
}
