//! Triangle meshes.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

#[cfg(feature = "wgpu")]
use super::MeshBuffers;
use super::generated_geometry::GeneratedGeometry;
use super::vertex_attribute::MeshAttribute;
use super::{AttributeFormat, AttributeLayout, AttributeValue, LevelOfDetail, SceneError, Topology, VertexAttribute};

/// A mesh: vertices, indices and topology. Object space is right-handed and in metres; front faces are
/// counter-clockwise. Clones share their vertices and indices.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    pub(super) name: String,
    topology: Topology,
    vertices: Arc<Vec<Vertex>>,
    indices: Arc<Vec<u32>>,
    attributes: Arc<Vec<MeshAttribute>>,
    pub(super) bounds: Bounds,
    pub(super) corners: [Vec3; 2],
    longest_edge: f32,
    #[cfg(feature = "occlusion")]
    culls_triangles: bool,
    /// The coarser levels, the finest first.
    pub(super) levels: Arc<Vec<LevelOfDetail>>,
    /// If nodes make its vertices.
    pub(super) generated: Option<Arc<GeneratedGeometry>>,
    /// If it is not in `vertices` and `indices`.
    #[cfg(feature = "wgpu")]
    buffers: Option<Arc<MeshBuffers>>,
}

impl Mesh {
    /// Checks the parts, and computes bounds and the length of the longest edge.
    ///
    /// # Errors
    /// If the mesh has no triangle, an index is out of range, the number of indices of a triangle list is not a
    /// multiple of 3, a vertex is not finite, or the bounding sphere has no finite radius.
    pub fn new(
        name: impl Into<String>,
        topology: Topology,
        vertices: Vec<Vertex>,
        indices: Vec<u32>,
    ) -> Result<Self, SceneError> {
        let name = name.into();
        check_corner_count(&name, topology, indices.len())?;
        if let Some(&index) = indices.iter().find(|&&index| index as usize >= vertices.len()) {
            return Err(SceneError::IndexOutOfRange { mesh: name, index, vertices: vertices.len() });
        }
        if let Some(vertex) = vertices.iter().position(|vertex| !vertex.is_finite()) {
            return Err(SceneError::NonFiniteVertex { mesh: name, vertex });
        }
        let mesh = Self::from_valid_parts(name, topology, vertices, indices);
        if !mesh.bounds.is_valid() {
            return Err(SceneError::MeshTooLarge { mesh: mesh.name });
        }
        Ok(mesh)
    }

    /// A mesh in the engine's own buffers. `bounding_box` is its minimum and maximum in object space, in metres:
    /// triangles outside of it may be missing.
    ///
    /// The CPU does not see its triangles. So it has no [`vertices`](Self::vertices), [`indices`](Self::indices),
    /// [`attribute`](Self::attribute) or [`longest_edge`](Self::longest_edge), is never an occluder, is neither
    /// subdivided for paraboloids nor culled by triangle, and the software backend leaves it out. Batches of meshes
    /// with equal layouts share pipelines.
    ///
    /// # Errors
    /// If it has no triangle, no positions, an attribute twice or in a format that does not fit it, a buffer without
    /// the usage for it, a stream that is misaligned or exceeds its buffer, or if the bounding box is inverted, not
    /// finite or too large.
    #[cfg(feature = "wgpu")]
    pub fn from_buffers(
        name: impl Into<String>,
        topology: Topology,
        bounding_box: [Vec3; 2],
        buffers: MeshBuffers,
    ) -> Result<Self, SceneError> {
        let name = name.into();
        check_corner_count(&name, topology, buffers.index_count() as usize)?;
        let [low, high] = bounding_box;
        let is_box = low.is_finite() && high.is_finite() && low.cmple(high).all();
        let problem = if is_box {
            buffers.problem(topology == Topology::TriangleStrip)
        } else {
            Some(format!("its bounding box from {low} to {high} is inverted or not finite"))
        };
        if let Some(problem) = problem {
            return Err(SceneError::InvalidMeshBuffers { mesh: name, problem });
        }
        let mut mesh = Self::from_valid_parts(name, topology, Vec::new(), Vec::new());
        (mesh.bounds, mesh.corners) = (Bounds::around(bounding_box.into_iter()), bounding_box);
        if !mesh.bounds.is_valid() {
            return Err(SceneError::MeshTooLarge { mesh: mesh.name });
        }
        mesh.buffers = Some(Arc::new(buffers));
        Ok(mesh)
    }

    /// [The engine's own buffers](Self::from_buffers) that it is in, if it is.
    #[cfg(feature = "wgpu")]
    pub fn buffers(&self) -> Option<&Arc<MeshBuffers>> {
        self.buffers.as_ref()
    }

    /// Whether the CPU knows its triangles.
    pub(crate) fn has_triangles(&self) -> bool {
        !self.indices.is_empty()
    }

    /// Computes bounds and the length of the longest edge of a mesh whose parts are known to be valid.
    pub(super) fn from_valid_parts(name: String, topology: Topology, vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        let bounds = Bounds::around(vertices.iter().map(|vertex| Vec3::from(vertex.position)));
        let start = Vec3::from(vertices.first().map_or([0.0; 3], |vertex| vertex.position));
        let corners = vertices.iter().fold([start; 2], |[low, high], vertex| {
            let position = Vec3::from(vertex.position);
            [low.min(position), high.max(position)]
        });
        let mut mesh = Self {
            name,
            topology,
            vertices: Arc::new(vertices),
            indices: Arc::new(indices),
            attributes: Arc::default(),
            bounds,
            corners,
            longest_edge: 0.0,
            #[cfg(feature = "occlusion")]
            culls_triangles: false,
            levels: Arc::default(),
            generated: None,
            #[cfg(feature = "wgpu")]
            buffers: None,
        };
        mesh.longest_edge = mesh.longest_edge_among(&mesh.indices);
        mesh
    }

    /// The length of the longest edge among the triangles of some indices.
    pub(super) fn longest_edge_among(&self, indices: &[u32]) -> f32 {
        let triangles = triangles_of(self.topology, indices, 0..triangle_count(self.topology, indices.len()));
        let triangles = triangles.map(|corners| corners.map(|corner| self.vertices[corner as usize]));
        let edges = triangles.filter(has_distinct_corners).flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        let longest_squared = edges.map(|[one, other]| one.distance_squared(&other)).fold(0.0, f64::max);
        root_rounded_up(longest_squared)
    }

    /// Adds the values of an attribute, one for each vertex.
    ///
    /// # Errors
    /// If there is not one value for each vertex, a value is not finite, the mesh has the attribute already, or is [in
    /// the engine's own buffers](Self::from_buffers).
    pub fn with_attribute<T: AttributeValue>(
        mut self,
        attribute: VertexAttribute<T>,
        values: &[T],
    ) -> Result<Self, SceneError> {
        let (layout, vertices) = (attribute.layout(), self.vertices.len());
        let refused =
            |problem: String| SceneError::InvalidAttribute { mesh: self.name.clone(), attribute: layout.name, problem };
        if !self.has_triangles() {
            return Err(refused(
                "must be in one of the mesh's vertex streams, because its vertices are in the engine's buffers"
                    .to_owned(),
            ));
        }
        if values.len() != vertices {
            return Err(refused(format!("has {} values for {vertices} vertices", values.len())));
        }
        if self.attributes.iter().any(|known| known.layout.name == layout.name) {
            return Err(refused("is there already".to_owned()));
        }
        let bytes: Vec<u8> = bytemuck::cast_slice(values).to_vec();
        if let AttributeFormat::Float32(components) = layout.format {
            let is_finite = |value: &[u8]| bytemuck::pod_read_unaligned::<f32>(value).is_finite();
            if let Some(number) = bytes.chunks_exact(4).position(|value| !is_finite(value)) {
                return Err(refused(format!("is not finite at vertex {}", number / usize::from(components))));
            }
        }
        Arc::make_mut(&mut self.attributes).push(MeshAttribute { layout, bytes });
        Ok(self)
    }

    /// The bytes of the values of an attribute, one for each vertex; `None` if the mesh does not have it in that
    /// format.
    ///
    /// ```
    /// # use drawloom::scene::{Mesh, Topology, VERTEX_COLOR, Vertex};
    /// # let corners = vec![Vertex::default(); 3];
    /// # let mesh = Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?;
    /// let mesh = mesh.with_attribute(VERTEX_COLOR, &[[1.0, 0.5, 0.0]; 3])?;
    /// assert_eq!(mesh.attribute(VERTEX_COLOR).map(<[u8]>::len), Some(36));
    /// # Ok::<(), drawloom::scene::SceneError>(())
    /// ```
    pub fn attribute<T: AttributeValue>(&self, attribute: VertexAttribute<T>) -> Option<&[u8]> {
        self.attribute_of(attribute.layout())
    }

    /// The values of the attribute with this layout.
    pub(crate) fn attribute_of(&self, layout: AttributeLayout) -> Option<&[u8]> {
        let known = self.attributes.iter().find(|known| known.layout == layout);
        known.map(|known| known.bytes.as_slice())
    }

    /// The attributes of another mesh with the same vertices, followed by ones that were added halfway between two
    /// others.
    pub(super) fn with_attributes_of(self, other: &Self, midpoint_ends: &[[u32; 2]]) -> Self {
        let attributes = other.attributes.iter().map(|attribute| attribute.subdivided(midpoint_ends)).collect();
        Self { attributes: Arc::new(attributes), ..self }
    }

    /// Enables or disables triangle culling. If enabled, each frame tests every triangle in every view, and leaves out
    /// those that [`RenderView::cull_triangles`](crate::view::RenderView::cull_triangles) finds invisible. Enabling it
    /// turns a strip into a list.
    ///
    /// It is worth it for large meshes in frames that are limited by the device, if the device takes longer for a
    /// vertex than a CPU core for a triangle. Each of its objects is a draw of its own. Shaders must not move the
    /// vertices of such a mesh: triangles that a shader would move into view may be missing.
    ///
    /// Frames then need memory for each triangle and pass: some 16 bytes, and 12 to 18 on the device. A pass tests 11
    /// million triangles at most; further objects are drawn whole. So are meshes [in the engine's own
    /// buffers](Self::from_buffers).
    #[cfg(feature = "occlusion")]
    pub fn with_triangle_culling(self, enabled: bool) -> Self {
        let enabled = enabled && self.has_triangles();
        let mesh = if enabled { self.into_list() } else { self };
        Self { culls_triangles: enabled, ..mesh }
    }

    /// The mesh and its levels as triangle lists.
    #[cfg(any(feature = "meshopt", feature = "occlusion"))]
    pub(super) fn into_list(mut self) -> Self {
        if self.topology == Topology::TriangleStrip {
            let (levels, indices) = (Arc::make_mut(&mut self.levels), Arc::make_mut(&mut self.indices));
            let lists = levels.iter_mut().map(|level| &mut level.indices).chain([indices]);
            for indices in lists {
                let all = 0..triangle_count(Topology::TriangleStrip, indices.len());
                *indices = triangles_of(Topology::TriangleStrip, indices, all).flatten().collect();
            }
            self.topology = Topology::TriangleList;
        }
        self
    }

    /// Whether triangle culling is enabled: see [`Mesh::with_triangle_culling`].
    #[cfg(feature = "occlusion")]
    pub fn culls_triangles(&self) -> bool {
        self.culls_triangles
    }

    /// The name in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How indices form triangles.
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

    /// The bounding sphere of all vertices.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The lowest and highest corner of the axis-aligned bounding box in object space.
    pub fn corners(&self) -> [Vec3; 2] {
        self.corners
    }

    /// The length of the longest edge, in metres in object space: rounded up from f64, and infinite beyond the range of
    /// f32. Triangles with two corners at the same position draw nothing and do not count.
    pub fn longest_edge(&self) -> f32 {
        self.longest_edge
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        let corners = self.indices.len();
        #[cfg(feature = "wgpu")]
        let corners = self.buffers.as_ref().map_or(corners, |buffers| buffers.index_count() as usize);
        triangle_count(self.topology, corners).max(self.generated_triangle_count())
    }

    /// The indices of each triangle's corners, counter-clockwise seen from its front; none of a mesh
    /// [in the engine's own buffers](Self::from_buffers).
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles_in(0, 0..self.triangle_count())
    }

    /// The same for a range of the triangles of a level of detail.
    ///
    /// # Panics
    /// If the range exceeds the number of triangles.
    pub(crate) fn triangles_in(&self, level: u32, numbers: Range<usize>) -> impl Iterator<Item = [u32; 3]> + '_ {
        let numbers = if self.has_triangles() { numbers } else { 0..0 };
        triangles_of(self.topology, self.indices_of(level), numbers)
    }
}

/// The number of triangles that this number of corners forms.
pub(super) fn triangle_count(topology: Topology, corners: usize) -> usize {
    match topology {
        Topology::TriangleList => corners / 3,
        Topology::TriangleStrip => corners.saturating_sub(2),
    }
}

/// The corners of some of the triangles that indices form.
fn triangles_of(topology: Topology, indices: &[u32], numbers: Range<usize>) -> impl Iterator<Item = [u32; 3]> + '_ {
    let (step, alternates) = match topology {
        Topology::TriangleList => (3, false),
        Topology::TriangleStrip => (1, true),
    };
    let triangles = numbers.clone().zip(indices[numbers.start * step..].array_windows().step_by(step));
    triangles.map(move |(number, &[a, b, c])| if alternates && number % 2 == 1 { [a, c, b] } else { [a, b, c] })
}

/// # Errors
/// If this many corners form no triangle, or a part of one.
pub(super) fn check_corner_count(mesh: &str, topology: Topology, corners: usize) -> Result<(), SceneError> {
    if corners < 3 {
        return Err(SceneError::EmptyMesh { mesh: mesh.to_owned() });
    }
    if topology == Topology::TriangleList && !corners.is_multiple_of(3) {
        return Err(SceneError::PartialTriangle { mesh: mesh.to_owned(), corners });
    }
    Ok(())
}

/// Whether a triangle's corners are at three different positions. Otherwise it has no area in any projection.
pub(super) fn has_distinct_corners(triangle: &[Vertex; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| vertex.position);
    a != b && b != c && c != a
}

/// The smallest f32 whose square is not below `square`.
fn root_rounded_up(square: f64) -> f32 {
    let root = square.sqrt() as f32;
    // Squares of f32 are exact in f64.
    if f64::from(root) * f64::from(root) < square { root.next_up() } else { root }
}

/// A vertex, with the layout of the vertex buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In object space, in metres.
    pub position: [f32; 3],
    /// In object space, of any length. A normal of 0 means the geometric normal of the triangle.
    pub normal: [f32; 3],
    /// Texture coordinates: (0, 0) is the top left and (1, 1) the bottom right of the texture, which repeats.
    pub uv: [f32; 2],
}

impl Vertex {
    /// The squared distance in metres. Both orders of the vertices give the same bits.
    pub(super) fn distance_squared(&self, other: &Self) -> f64 {
        Vec3::from(self.position).as_dvec3().distance_squared(Vec3::from(other.position).as_dvec3())
    }

    fn is_finite(&self) -> bool {
        self.position.iter().chain(&self.normal).chain(&self.uv).all(|value| value.is_finite())
    }
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
    /// A sphere around all points: it is centred on their bounding box, and its radius is rounded up.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f32, y: f32, z: f32) -> Vertex {
        Vertex { position: [x, y, z], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] }
    }

    #[test]
    fn an_invalid_mesh_is_an_error_with_its_name() {
        let corners = vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0)];
        let make = |vertices, indices| Mesh::new("leaf", Topology::TriangleList, vertices, indices);
        assert!(matches!(make(corners.clone(), vec![]), Err(SceneError::EmptyMesh { mesh }) if mesh == "leaf"));
        assert!(matches!(make(corners.clone(), vec![0, 1, 2, 0]), Err(SceneError::PartialTriangle { corners: 4, .. })));
        let outside = make(corners.clone(), vec![0, 1, 3]);
        assert!(matches!(outside, Err(SceneError::IndexOutOfRange { index: 3, vertices: 3, .. })));
        let broken = vec![corners[0], corners[1], corner(f32::NAN, 0.0, 0.0)];
        assert!(matches!(make(broken, vec![0, 1, 2]), Err(SceneError::NonFiniteVertex { vertex: 2, .. })));
        let huge = vec![corner(f32::MAX, f32::MAX, 0.0), corner(f32::MIN, f32::MIN, 0.0), corners[2]];
        assert!(matches!(make(huge, vec![0, 1, 2]), Err(SceneError::MeshTooLarge { .. })));
        assert!(make(corners, vec![0, 1, 2]).is_ok());
    }

    #[test]
    fn an_invalid_attribute_is_an_error_with_its_name() {
        const WEIGHT: VertexAttribute<[f32; 2]> = VertexAttribute::new("weight");
        let corners = vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0)];
        let mesh = Mesh::new("leaf", Topology::TriangleList, corners, vec![0, 1, 2]).unwrap();
        let problem_of = |mesh: Result<Mesh, SceneError>| match mesh {
            Err(SceneError::InvalidAttribute { mesh, attribute: "weight", problem }) if mesh == "leaf" => problem,
            other => panic!("{other:?}"),
        };
        let few = mesh.clone().with_attribute(WEIGHT, &[[0.0; 2]; 2]);
        assert_eq!(problem_of(few), "has 2 values for 3 vertices");
        let broken = mesh.clone().with_attribute(WEIGHT, &[[0.0; 2], [0.0, f32::INFINITY], [0.0; 2]]);
        assert_eq!(problem_of(broken), "is not finite at vertex 1");
        let mesh = mesh.with_attribute(WEIGHT, &[[0.5; 2]; 3]).unwrap();
        assert_eq!(mesh.attribute(WEIGHT).map(<[u8]>::len), Some(24));
        assert_eq!(mesh.attribute(VertexAttribute::<[f32; 3]>::new("weight")), None);
        let same_name = mesh.with_attribute(VertexAttribute::<u32>::new("weight"), &[1; 3]);
        assert_eq!(problem_of(same_name), "is there already");
    }

    #[test]
    fn bounds_contain_every_point_at_every_magnitude() {
        for scale in [1e-20_f32, 1e-3, 1.0, 1e6, 1e30] {
            let points = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-4.0, 0.1, 7.3), Vec3::new(0.3, -9.0, 2.0)];
            let scaled = points.map(|point| point * scale);
            let bounds = Bounds::around(scaled.into_iter());
            for point in scaled {
                assert!(point.as_dvec3().distance(bounds.center.as_dvec3()) <= f64::from(bounds.radius), "{scale}");
            }
        }
    }

    #[test]
    fn the_longest_edge_is_rounded_up_to_the_next_f32() {
        for scale in [1e-40_f32, 1e-20, 0.1, 1.0, 3e7, 1e30] {
            let positions = [[0.1, 0.2, 0.3], [1.7, 0.0, -0.4], [0.3, 2.9, 0.7], [-0.9, 2.2, 5.3], [0.3, 0.2, 0.1]];
            let corners: Vec<_> = positions.iter().map(|[x, y, z]| corner(x * scale, y * scale, z * scale)).collect();
            let strip = Mesh::new("strip", Topology::TriangleStrip, corners.clone(), vec![0, 1, 2, 3, 4]).unwrap();
            let list = vec![0, 1, 2, 1, 3, 2, 2, 3, 4];
            assert!(strip.triangles().flatten().eq(list.iter().copied()));
            let edges = [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3], [2, 4], [3, 4]];
            let position = |index: usize| Vec3::from(corners[index].position).as_dvec3();
            let longest = edges.iter().map(|&[a, b]| position(a).distance(position(b))).fold(0.0, f64::max);
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
    fn an_edge_length_that_f32_represents_is_not_rounded() {
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
