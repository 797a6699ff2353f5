//! The triangles of one model.

use std::collections::HashMap;

use glam::DVec3;

use super::polygon::triangulate;
use crate::scene::Vertex;

/// What can be drawn of a model: triangles with an area, around their own centre, each vertex with a normal.
#[derive(Debug, Default)]
pub(super) struct ModelGeometry {
    /// The centre of its box. Vertices are relative to it.
    pub center: DVec3,
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    pub degenerate_triangles: usize,
    pub fanned_polygons: usize,
}

/// A triangle thinner than this share of its longest edge has no area: 32-bit coordinates cannot place it so thin, so it
/// is nothing but rounding.
const THINNEST: f64 = 1e-7;

impl ModelGeometry {
    pub(super) fn new(mesh: &tobj::Mesh) -> Self {
        let mut geometry = Self::default();
        let source = Source::new(mesh);
        let triangles = geometry.triangles(mesh, &source.positions);
        let points = triangles.iter().flat_map(|triangle| triangle.corners.map(|corner| source.positions[corner]));
        let (low, high) =
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
        if !triangles.is_empty() {
            geometry.center = (low + high) / 2.0;
        }
        // Vertices are shared where the file gives them a normal; where a face lends its own, they are not.
        let mut shared = HashMap::new();
        for Triangle { corners, normal } in triangles {
            for corner in corners {
                let index = match source.normals[corner].try_normalize() {
                    Some(given) => *shared.entry(corner).or_insert_with(|| geometry.add_vertex(&source, corner, given)),
                    None => geometry.add_vertex(&source, corner, normal),
                };
                geometry.indices.push(index);
            }
        }
        geometry
    }

    /// Every triangle with an area; the others are counted.
    fn triangles(&mut self, mesh: &tobj::Mesh, positions: &[DVec3]) -> Vec<Triangle> {
        let mut kept = Vec::new();
        let mut cut = Vec::new();
        let mut corners: &[u32] = &mesh.indices;
        // Without arities every face is a triangle.
        let count = if mesh.face_arities.is_empty() { corners.len() / 3 } else { mesh.face_arities.len() };
        for face in 0..count {
            let arity = mesh.face_arities.get(face).map_or(3, |&arity| arity as usize);
            let (polygon, rest) = corners.split_at(arity);
            corners = rest;
            let points: Vec<_> = polygon.iter().map(|&corner| positions[corner as usize]).collect();
            cut.clear();
            self.fanned_polygons += usize::from(!triangulate(&points, &mut cut));
            for triangle in &cut {
                match normal(triangle.map(|corner| points[corner])) {
                    Some(normal) => {
                        kept.push(Triangle { corners: triangle.map(|corner| polygon[corner] as usize), normal });
                    }
                    None => self.degenerate_triangles += 1,
                }
            }
        }
        kept
    }

    fn add_vertex(&mut self, source: &Source, corner: usize, normal: DVec3) -> u32 {
        let [u, v] = source.coordinates[corner];
        self.vertices.push(Vertex {
            position: (source.positions[corner] - self.center).as_vec3().into(),
            normal: normal.as_vec3().into(),
            // An OBJ file's second axis points up.
            uv: [u, 1.0 - v],
        });
        (self.vertices.len() - 1) as u32
    }
}

struct Triangle {
    corners: [usize; 3],
    normal: DVec3,
}

/// A mesh as tobj gives it, one entry a vertex; the normal is zero where there is none.
struct Source {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    coordinates: Vec<[f32; 2]>,
}

impl Source {
    fn new(mesh: &tobj::Mesh) -> Self {
        // 64-bit here whichever tobj was built with, and so that products do not overflow.
        let triple = |values: &[_; 3]| DVec3::from(values.map(f64::from));
        let pair = |values: &[_; 2]| values.map(|value| f64::from(value) as f32);
        Self {
            positions: mesh.positions.as_chunks().0.iter().map(triple).collect(),
            normals: mesh.normals.as_chunks().0.iter().map(triple).collect(),
            coordinates: mesh.texcoords.as_chunks().0.iter().map(pair).collect(),
        }
    }
}

/// The direction a triangle faces, if it has an area.
fn normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let product = (b - a).cross(c - a);
    let longest = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
    // Comparisons with NaN are false.
    if product.length() > THINNEST * longest { product.try_normalize() } else { None }
}
