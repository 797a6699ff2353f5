//! Subdivision of meshes.

use std::collections::HashMap;

use super::mesh::has_distinct_corners;
use super::{Mesh, Topology, Vertex};

impl Mesh {
    /// The same surface as a triangle list in which no edge is longer than `longest`, in metres in object space.
    ///
    /// It is for projections that bend straight lines, such as the paraboloids of a shadow map for all directions
    /// (Brabec et al., "Shadow Mapping for Hemispherical and Omnidirectional Light Sources", 2002). Only vertices are
    /// projected, and rasterised edges between them are straight. The error of an edge that subtends the angle φ is up
    /// to 1 − cos(φ/2) of the map's radius: in a map 1024 pixels wide 39 pixels at 45°, 1.95 at 10°, and 0.49 at 5°.
    ///
    /// Longer edges are split at their midpoints until none is left. Whether and where an edge is split depends only on
    /// the positions of its ends, so surfaces that meet along an edge stay connected, even if normals or texture
    /// coordinates differ there. A new vertex has the mean normal, texture coordinates and attributes of
    /// both ends, as interpolation gives at the midpoint; those of one end if they are whole numbers.
    ///
    /// Each step splits all long edges. Subdivision stops before a step that could exceed `triangle_limit` triangles or
    /// 2³² vertices, and does not split an edge whose midpoint f32 cannot distinguish from its ends.
    /// [`longest_edge`](Self::longest_edge) of the result is then still above `longest`. A `longest` that is NaN or not
    /// positive cannot be reached, and subdivides up to the limit.
    ///
    /// Triangles with two corners at the same position are left out, as they draw nothing. If none remains, the result
    /// is a single degenerate triangle. A mesh [in the engine's own buffers](Self::from_buffers) does not change.
    ///
    /// The result has no levels of detail, and its triangles are not culled, whatever the mesh has.
    ///
    /// ```
    /// use drawloom::scene::{Mesh, Topology, Vertex};
    ///
    /// # fn main() -> Result<(), drawloom::scene::SceneError> {
    /// let corner = |x: f32, z: f32| Vertex { position: [x, 0.0, z], normal: [0.0, 1.0, 0.0], uv: [x, z] };
    /// let corners = vec![corner(0.0, 0.0), corner(0.0, 8.0), corner(8.0, 0.0), corner(8.0, 8.0)];
    /// let floor = Mesh::new("floor", Topology::TriangleStrip, corners, vec![0, 1, 2, 3])?;
    /// assert_eq!(floor.subdivided(1.5, 10_000).triangle_count(), 128);
    /// # Ok(())
    /// # }
    /// ```
    pub fn subdivided(&self, longest: f32, triangle_limit: usize) -> Self {
        if !self.has_triangles() {
            return self.clone();
        }
        // `max` returns the other operand if one is NaN.
        let longest = f64::from(longest.max(0.0));
        let mut surface =
            Surface { vertices: self.vertices().to_vec(), midpoint_ends: Vec::new(), triangles: Vec::new() };
        self.triangles().for_each(|corners| surface.add(corners));
        loop {
            let long_edges = surface.long_edges(longest * longest);
            let splits = long_edges.iter().flatten().filter(|&&is_long| is_long).count();
            let triangle_room = triangle_limit.saturating_sub(surface.triangles.len());
            let vertex_room = (u32::MAX as usize).saturating_sub(surface.vertices.len());
            if splits == 0 || splits > triangle_room.min(vertex_room) {
                break;
            }
            surface.split(&long_edges, splits);
        }
        if surface.triangles.is_empty() {
            surface.triangles.push([self.indices()[0]; 3]);
        }
        let indices = surface.triangles.into_flattened();
        Self::from_valid_parts(self.name().to_owned(), Topology::TriangleList, surface.vertices, indices)
            .with_attributes_of(self, &surface.midpoint_ends)
    }
}

/// A mesh while it is subdivided.
struct Surface {
    vertices: Vec<Vertex>,
    /// For each vertex that was added, the two that it is halfway between.
    midpoint_ends: Vec<[u32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// For each triangle, which of its edges are too long.
    fn long_edges(&self, longest_squared: f64) -> Vec<[bool; 3]> {
        let mut long_edges = Vec::with_capacity(self.triangles.len());
        for &triangle in &self.triangles {
            let mut is_long = [false; 3];
            for (is_long, edge) in is_long.iter_mut().zip(edges_of(triangle)) {
                *is_long = self.length_squared(edge) > longest_squared && self.has_midpoint(edge);
            }
            long_edges.push(is_long);
        }
        long_edges
    }

    /// Splits each long edge once. Adds a triangle for each of the `splits` long edges of each triangle, and no more
    /// vertices than that.
    fn split(&mut self, long_edges: &[[bool; 3]], splits: usize) {
        let triangles = std::mem::take(&mut self.triangles);
        self.triangles.reserve(triangles.len() + splits);
        // Most edges are of two triangles.
        let mut midpoints = HashMap::with_capacity(splits / 2);
        for (triangle, is_long) in triangles.into_iter().zip(long_edges) {
            let mut triangle_midpoints = [None; 3];
            for (index, edge) in edges_of(triangle).into_iter().enumerate() {
                if is_long[index] {
                    let [one, other] = edge;
                    let midpoint = *midpoints.entry([one.min(other), one.max(other)]).or_insert_with(|| {
                        self.vertices.push(self.midpoint(edge));
                        self.midpoint_ends.push(edge);
                        self.vertices.len() as u32 - 1
                    });
                    triangle_midpoints[index] = Some(midpoint);
                }
            }
            self.add_parts(triangle, triangle_midpoints);
        }
    }

    /// Adds the parts of a triangle whose edges a–b, b–c and c–a are split at these midpoints.
    fn add_parts(&mut self, [a, b, c]: [u32; 3], midpoints: [Option<u32>; 3]) {
        match midpoints {
            [None, None, None] => self.add([a, b, c]),
            [Some(midpoint), None, None] => self.add_halves([a, b, c], midpoint),
            [None, Some(midpoint), None] => self.add_halves([b, c, a], midpoint),
            [None, None, Some(midpoint)] => self.add_halves([c, a, b], midpoint),
            [Some(first), Some(second), None] => self.add_thirds([a, b, c], first, second),
            [None, Some(first), Some(second)] => self.add_thirds([b, c, a], first, second),
            [Some(second), None, Some(first)] => self.add_thirds([c, a, b], first, second),
            [Some(ab), Some(bc), Some(ca)] => {
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].into_iter().for_each(|part| self.add(part));
            }
        }
    }

    /// Splits the edge a–b at `midpoint`.
    fn add_halves(&mut self, [a, b, c]: [u32; 3], midpoint: u32) {
        self.add([a, midpoint, c]);
        self.add([midpoint, b, c]);
    }

    /// Splits the edge a–b at `first` and b–c at `second`.
    fn add_thirds(&mut self, [a, b, c]: [u32; 3], first: u32, second: u32) {
        self.add([first, b, second]);
        // The shorter diagonal is below √¾ of either split edge, so long edges keep shrinking.
        if self.length_squared([a, second]) <= self.length_squared([first, c]) {
            self.add([a, first, second]);
            self.add([a, second, c]);
        } else {
            self.add([a, first, c]);
            self.add([first, second, c]);
        }
    }

    /// Adds a triangle unless two of its corners coincide. Leaving that out opens no crack, as its other two edges
    /// coincide.
    fn add(&mut self, triangle: [u32; 3]) {
        if has_distinct_corners(&triangle.map(|corner| self.vertices[corner as usize])) {
            self.triangles.push(triangle);
        }
    }

    /// Whether f32 can distinguish an edge's midpoint from its ends. Splitting would never finish otherwise.
    fn has_midpoint(&self, [one, other]: [u32; 2]) -> bool {
        let midpoint = self.midpoint([one, other]).position;
        midpoint != self.vertices[one as usize].position && midpoint != self.vertices[other as usize].position
    }

    /// Both directions of an edge give the same bits.
    fn midpoint(&self, [one, other]: [u32; 2]) -> Vertex {
        let mut midpoint: [f32; 8] = bytemuck::cast(self.vertices[one as usize]);
        let other: [f32; 8] = bytemuck::cast(self.vertices[other as usize]);
        for (component, other) in midpoint.iter_mut().zip(other) {
            *component = component.midpoint(other);
        }
        bytemuck::cast(midpoint)
    }

    fn length_squared(&self, edge: [u32; 2]) -> f64 {
        let [one, other] = edge.map(|end| &self.vertices[end as usize]);
        one.distance_squared(other)
    }
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};

    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::scene::VertexAttribute;

    const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

    /// A distorted box. Each side has four vertices of its own, so normals and texture coordinates differ along its
    /// edges.
    fn distorted_box(size: Vec3, origin: Vec3, bends: [[f32; 3]; 8]) -> Mesh {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for normal in SIDES {
            let right = normal.any_orthonormal_vector();
            let up = normal.cross(right);
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner| vertices.len() as u32 + corner));
            for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                let corner = normal + right * x + up * y;
                let bend =
                    usize::from(corner.x > 0.0) + 2 * usize::from(corner.y > 0.0) + 4 * usize::from(corner.z > 0.0);
                let position = (origin + size * (corner + Vec3::from(bends[bend]))).to_array();
                vertices.push(Vertex { position, normal: normal.to_array(), uv: [x, y] });
            }
        }
        Mesh::new("box", Topology::TriangleList, vertices, indices).unwrap()
    }

    fn positions(mesh: &Mesh) -> Vec<[DVec3; 3]> {
        let position = |corner: u32| Vec3::from(mesh.vertices()[corner as usize].position).as_dvec3();
        mesh.triangles().map(|triangle| triangle.map(position)).collect()
    }

    fn across([a, b, c]: [DVec3; 3]) -> DVec3 {
        (b - a).cross(c - a)
    }

    fn area(mesh: &Mesh) -> f64 {
        positions(mesh).into_iter().map(|triangle| across(triangle).length() / 2.0).sum()
    }

    fn longest_of(mesh: &Mesh) -> f64 {
        let edges = positions(mesh).into_iter().flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]);
        edges.fold(0.0, f64::max)
    }

    /// The number of directed edges without an opposite edge: 0 on a closed surface.
    fn border(mesh: &Mesh) -> usize {
        let position = |corner: u32| mesh.vertices()[corner as usize].position.map(|value| (value + 0.0).to_bits());
        let mut edges: HashMap<_, i32> = HashMap::new();
        for [one, other] in mesh.triangles().flat_map(edges_of).map(|edge| edge.map(position)) {
            *edges.entry([one, other]).or_default() += 1;
            *edges.entry([other, one]).or_default() -= 1;
        }
        edges.into_values().filter(|&count| count != 0).count()
    }

    fn flat(topology: Topology, corners: &[[f32; 2]], indices: Vec<u32>) -> Mesh {
        let vertex = |&[x, y]: &[f32; 2]| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [x, y] };
        Mesh::new("flat", topology, corners.iter().map(vertex).collect(), indices).unwrap()
    }

    fn leaf(corners: [[f32; 2]; 3]) -> Mesh {
        flat(Topology::TriangleList, &corners, vec![0, 1, 2])
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_closed_surface_stays_closed_and_keeps_its_shape(
            sizes in prop::array::uniform3(0.05..1.0_f32),
            origin in prop::array::uniform3(-5.0..5.0_f32),
            bends in prop::array::uniform8(prop::array::uniform3(-0.3..0.3_f32)),
            exponent in -20..20_i32,
            share in 0.06..2.0_f32,
            limit in prop_oneof![Just(usize::MAX), 0..3000_usize],
        ) {
            let scale = 2_f32.powi(exponent);
            const POSITION: VertexAttribute<[f32; 3]> = VertexAttribute::new("position_again");
            const SIDE: VertexAttribute<u32> = VertexAttribute::new("side");
            let whole = distorted_box(Vec3::from(sizes) * scale, Vec3::from(origin) * scale, bends);
            let again: Vec<_> = whole.vertices().iter().map(|vertex| vertex.position).collect();
            let sides: Vec<_> = (0..again.len() as u32).map(|vertex| vertex / 4).collect();
            let whole = whole.with_attribute(POSITION, &again).unwrap().with_attribute(SIDE, &sides).unwrap();
            prop_assert_eq!(border(&whole), 0);
            let longest = share * scale;
            let fine = whole.subdivided(longest, limit);
            prop_assert_eq!(fine.topology(), Topology::TriangleList);
            prop_assert!(fine.triangle_count() <= limit.max(12));
            prop_assert_eq!(border(&fine), 0);
            if limit == usize::MAX {
                prop_assert!(fine.longest_edge() <= longest);
            }
            let again: &[[f32; 3]] = bytemuck::cast_slice(fine.attribute(POSITION).unwrap());
            prop_assert!(fine.vertices().iter().map(|vertex| &vertex.position).eq(again));
            prop_assert!(longest_of(&fine) <= f64::from(fine.longest_edge()));
            prop_assert!((area(&fine) / area(&whole) - 1.0).abs() < 1e-4, "{} {}", area(&fine), area(&whole));
            for (triangle, corners) in fine.triangles().zip(positions(&fine)) {
                let normals = triangle.map(|corner| Vec3::from(fine.vertices()[corner as usize].normal));
                prop_assert!(SIDES.contains(&normals[0]) && normals == [normals[0]; 3]);
                let side = |corner: u32| {
                    let sides: &[u32] = bytemuck::cast_slice(fine.attribute(SIDE).unwrap());
                    SIDES[sides[corner as usize] as usize]
                };
                prop_assert_eq!(triangle.map(side), normals);
                prop_assert!(across(corners).dot((normals[0] / Vec3::from(sizes)).as_dvec3()) > 0.0);
            }
        }

        /// All triangles of this strip face +Z.
        #[test]
        fn a_strip_is_subdivided_like_the_equivalent_list(
            bends in prop::collection::vec(0.0..0.8_f32, 3..20),
            longest in 0.2..3.0_f32,
        ) {
            let corner = |(number, &bend): (u8, &f32)| [f32::from(number) + bend, -f32::from(number % 2)];
            let corners: Vec<_> = (0..).zip(&bends).map(corner).collect();
            let count = corners.len() as u32;
            let strip = flat(Topology::TriangleStrip, &corners, (0..count).collect());
            let list = (0..count - 2).flat_map(|first| match first % 2 {
                0 => [first, first + 1, first + 2],
                _ => [first, first + 2, first + 1],
            });
            let list = flat(Topology::TriangleList, &corners, list.collect());
            let fine = strip.subdivided(longest, 100_000);
            prop_assert_eq!(&fine, &list.subdivided(longest, 100_000));
            prop_assert!(fine.longest_edge() <= longest);
            prop_assert!(positions(&fine).into_iter().all(|triangle| across(triangle).z > 0.0));
        }
    }

    #[test]
    fn only_long_edges_are_split() {
        let upright = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]];
        for (longest, triangles) in [(6.0, 1), (5.0, 1), (4.5, 2), (4.0, 2), (3.5, 3), (2.5, 4), (2.4, 8)] {
            let fine = leaf(upright).subdivided(longest, 100);
            assert_eq!(fine.triangle_count(), triangles, "{longest}");
            assert!(fine.longest_edge() <= longest);
        }
        let whole = leaf(upright);
        assert_eq!(whole.subdivided(5.0, 100), whole);
    }

    #[test]
    fn neighbours_share_new_vertices_with_interpolated_coordinates() {
        let corners = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0], [5.0, 0.5]];
        let whole = flat(Topology::TriangleList, &corners, vec![0, 1, 2, 0, 2, 3, 1, 4, 2]);
        let fine = whole.subdivided(0.3, usize::MAX);
        let bits = |vertex: &Vertex| vertex.position.map(f32::to_bits);
        let distinct: HashSet<_> = fine.vertices().iter().map(bits).collect();
        assert_eq!(distinct.len(), fine.vertices().len());
        // Euler's formula for a disc: vertices + triangles = edges + 1. All edges but those at the rim have two
        // triangles.
        let rim = border(&fine) / 2;
        assert_eq!(distinct.len() + fine.triangle_count(), (3 * fine.triangle_count() + rim) / 2 + 1);
        for vertex in fine.vertices() {
            let [x, y, _] = vertex.position;
            assert!((x - vertex.uv[0]).abs() + (y - vertex.uv[1]).abs() < 1e-6, "{vertex:?}");
        }
    }

    #[test]
    fn subdivision_stops_before_the_limit() {
        let whole = leaf([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        for (limit, triangles, longest) in [(0, 1, 2.0), (3, 1, 2.0), (4, 4, 0.5), (15, 4, 0.5), (16, 16, 0.125)] {
            let fine = whole.subdivided(1e-3, limit);
            assert_eq!(fine.triangle_count(), triangles, "{limit}");
            assert!((fine.longest_edge().powi(2) - longest).abs() < 1e-6, "{limit}: {}", fine.longest_edge());
        }
    }

    #[test]
    fn an_invalid_length_subdivides_up_to_the_limit() {
        let whole = leaf([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let fine = whole.subdivided(0.0, 1024);
        assert_eq!(fine.triangle_count(), 1024);
        for longest in [-0.0, -1.0, f32::NAN, f32::NEG_INFINITY, f32::MIN_POSITIVE] {
            assert_eq!(whole.subdivided(longest, 1024), fine, "{longest}");
        }
        assert_eq!(whole.subdivided(f32::INFINITY, 1024), whole);
    }

    #[test]
    fn edges_between_neighbouring_numbers_are_not_split() {
        for start in [0.0_f32, 1.0, 1e30] {
            let next = |steps: u32| f32::from_bits(start.to_bits() + steps);
            let whole = leaf([[start, start], [next(5), next(1)], [next(2), next(7)]]);
            let fine = whole.subdivided(0.0, usize::MAX);
            assert!(fine.longest_edge() > 0.0 && fine.longest_edge() < whole.longest_edge(), "{start}");
            assert!(fine.triangle_count() < 100, "{start}: {}", fine.triangle_count());
        }
    }

    #[test]
    fn the_largest_numbers_stay_finite() {
        let far = f32::MAX * 0.7;
        let whole = leaf([[far, far], [-far, far], [far, -far]]);
        assert_eq!(whole.longest_edge(), f32::INFINITY);
        let fine = whole.subdivided(1.0, 1000);
        assert_eq!(fine.triangle_count(), 256);
        assert!((fine.longest_edge() / (far / 8.0) - 2_f32.sqrt()).abs() < 1e-6);
        assert!(fine.bounds().is_valid());
    }

    #[test]
    fn degenerate_triangles_are_left_out() {
        let line = leaf([[0.0, 0.0], [8.0, 0.0], [3.0, 0.0]]).subdivided(1.0, 100);
        assert!(line.longest_edge() <= 1.0 && area(&line) == 0.0);

        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [50.0, 0.0], [50.0, 0.0], [51.0, 0.0], [50.0, 1.0]];
        let two_strips = flat(Topology::TriangleStrip, &corners, vec![0, 1, 2, 2, 4, 3, 5, 6]);
        let fine = two_strips.subdivided(1.0, 1000);
        assert_eq!(fine.triangle_count(), 4, "the joint between two strips adds no triangle");

        // In the last one, the midpoint of the longest edge is the third corner.
        for gone in [[[1.0, 1.0]; 3], [[0.0, 0.0], [9.0, 9.0], [9.0, 9.0]], [[0.0, 0.0], [8.0, 0.0], [4.0, 0.0]]] {
            let fine = leaf(gone).subdivided(5.0, 1000);
            assert_eq!((fine.triangle_count(), fine.longest_edge()), (1, 0.0), "{gone:?}");
        }
    }
}
