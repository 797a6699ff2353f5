//! A mesh whose vertices at one place are one, and which triangles are neighbours.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::Plane;
use crate::scene::Mesh;

/// The triangles of a mesh that have an area, over places that each occur once.
pub(super) struct WeldedMesh {
    /// In object space.
    pub(super) places: Vec<DVec3>,
    /// The places of their corners, counter-clockwise seen from their visible side.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The plane of each.
    pub(super) faces: Vec<Plane>,
    /// In square metres.
    pub(super) areas: Vec<f64>,
    /// Which triangle has an edge in this direction; `None` where several have.
    owners: HashMap<[u32; 2], Option<u32>>,
}

impl WeldedMesh {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut welded = Self {
            places: Vec::new(),
            triangles: Vec::new(),
            faces: Vec::new(),
            areas: Vec::new(),
            owners: HashMap::new(),
        };
        let mut known = HashMap::new();
        let welds: Vec<u32> = mesh
            .vertices()
            .iter()
            .map(|vertex| {
                // Zeros of either sign are one place.
                let bits = vertex.position.map(|coordinate| (coordinate + 0.0).to_bits());
                *known.entry(bits).or_insert_with(|| {
                    welded.places.push(Vec3::from(vertex.position).as_dvec3());
                    welded.places.len() as u32 - 1
                })
            })
            .collect();
        for triangle in mesh.triangles() {
            welded.add(triangle.map(|corner| welds[corner as usize]));
        }
        welded
    }

    fn add(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = triangle.map(|corner| self.places[corner as usize]);
        let across = (b - a).cross(c - a);
        let Some(normal) = across.try_normalize() else { return };
        let index = self.triangles.len() as u32;
        self.triangles.push(triangle);
        self.faces.push(Plane { normal, offset: normal.dot(a) });
        self.areas.push(across.length() / 2.0);
        for edge in edges(triangle) {
            self.owners.entry(edge).and_modify(|owner| *owner = None).or_insert(Some(index));
        }
    }

    /// The triangle on the other side of a triangle's edge, if there is just one.
    pub(super) fn neighbour(&self, [from, to]: [u32; 2]) -> Option<u32> {
        self.owners.get(&[from, to]).copied().flatten()?;
        self.owners.get(&[to, from]).copied().flatten()
    }

    /// The triangles that hang together by such edges.
    pub(super) fn pieces(&self) -> Vec<Vec<u32>> {
        let mut is_taken = vec![false; self.triangles.len()];
        let mut pieces = Vec::new();
        for first in 0..self.triangles.len() {
            if std::mem::replace(&mut is_taken[first], true) {
                continue;
            }
            let mut piece = vec![first as u32];
            let mut looked_at = 0;
            while let Some(&triangle) = piece.get(looked_at) {
                looked_at += 1;
                for neighbour in
                    edges(self.triangles[triangle as usize]).into_iter().filter_map(|edge| self.neighbour(edge))
                {
                    if !std::mem::replace(&mut is_taken[neighbour as usize], true) {
                        piece.push(neighbour);
                    }
                }
            }
            pieces.push(piece);
        }
        pieces
    }

    /// The places of a triangle's corners.
    pub(super) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|corner| self.places[corner as usize])
    }
}

/// A triangle's edges, each in its direction.
pub(super) fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}
