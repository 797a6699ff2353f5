//! A mesh with welded vertices and triangle adjacency.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::Plane;
use crate::scene::Mesh;

/// The triangles of a mesh that are not degenerate, with vertices of equal position merged.
pub(super) struct WeldedMesh {
    /// The distinct positions in object space.
    pub(super) points: Vec<DVec3>,
    /// Indices of points, counter-clockwise seen from the front.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The plane of each triangle.
    pub(super) faces: Vec<Plane>,
    /// The area of each triangle in square metres.
    pub(super) areas: Vec<f64>,
    /// The triangle that has an edge in this direction; `None` if several have it.
    owners: HashMap<[u32; 2], Option<u32>>,
}

impl WeldedMesh {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut welded = Self {
            points: Vec::new(),
            triangles: Vec::new(),
            faces: Vec::new(),
            areas: Vec::new(),
            owners: HashMap::new(),
        };
        let mut known = HashMap::new();
        let point_of_vertex: Vec<u32> = mesh
            .vertices()
            .iter()
            .map(|vertex| {
                // Merges 0 and −0.
                let bits = vertex.position.map(|coordinate| (coordinate + 0.0).to_bits());
                *known.entry(bits).or_insert_with(|| {
                    welded.points.push(Vec3::from(vertex.position).as_dvec3());
                    welded.points.len() as u32 - 1
                })
            })
            .collect();
        for triangle in mesh.triangles() {
            welded.add(triangle.map(|corner| point_of_vertex[corner as usize]));
        }
        welded
    }

    fn add(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = triangle.map(|corner| self.points[corner as usize]);
        let cross = (b - a).cross(c - a);
        let Some(normal) = cross.try_normalize() else { return };
        let index = self.triangles.len() as u32;
        self.triangles.push(triangle);
        self.faces.push(Plane { normal, offset: normal.dot(a) });
        self.areas.push(cross.length() / 2.0);
        for edge in edges(triangle) {
            self.owners.entry(edge).and_modify(|owner| *owner = None).or_insert(Some(index));
        }
    }

    /// The triangle on the other side of an edge, if exactly one triangle is on either side.
    pub(super) fn neighbour(&self, [from, to]: [u32; 2]) -> Option<u32> {
        self.owners.get(&[from, to]).copied().flatten()?;
        self.owners.get(&[to, from]).copied().flatten()
    }

    /// The connected components: sets of triangles connected by such edges.
    pub(super) fn components(&self) -> Vec<Vec<u32>> {
        let mut is_visited = vec![false; self.triangles.len()];
        let mut components = Vec::new();
        for first in 0..self.triangles.len() {
            if std::mem::replace(&mut is_visited[first], true) {
                continue;
            }
            let mut component = vec![first as u32];
            let mut next = 0;
            while let Some(&triangle) = component.get(next) {
                next += 1;
                for neighbour in
                    edges(self.triangles[triangle as usize]).into_iter().filter_map(|edge| self.neighbour(edge))
                {
                    if !std::mem::replace(&mut is_visited[neighbour as usize], true) {
                        component.push(neighbour);
                    }
                }
            }
            components.push(component);
        }
        components
    }

    /// The positions of a triangle's corners.
    pub(super) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|corner| self.points[corner as usize])
    }
}

/// A triangle's directed edges.
pub(super) fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}
