//! The geometry of one model.

use std::collections::HashMap;

use glam::DVec3;

use super::polygon::triangulate;
use crate::scene::Vertex;

/// The triangles of a model that have an area. Every vertex has a normal.
#[derive(Debug, Default)]
pub(super) struct ModelGeometry {
    /// The centre of the bounding box. Vertices are relative to it.
    pub center: DVec3,
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    pub degenerate_triangles: usize,
    pub fanned_polygons: usize,
}

/// A triangle whose height is less than this share of its longest edge counts as degenerate: it is thinner than the rounding
/// of 32-bit coordinates.
const MIN_RELATIVE_HEIGHT: f64 = 1e-7;

impl ModelGeometry {
    pub(super) fn new(mesh: &tobj::Mesh) -> Self {
        let mut geometry = Self::default();
        let attributes = VertexAttributes::new(mesh);
        let triangles = geometry.triangles(mesh, &attributes.positions);
        let points = triangles.iter().flat_map(|triangle| triangle.corners.map(|corner| attributes.positions[corner]));
        let (low, high) =
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
        if !triangles.is_empty() {
            geometry.center = (low + high) / 2.0;
        }
        // Triangles share vertices that have a normal in the file. Others get the normal of their face, and are not shared.
        let mut shared = HashMap::new();
        for Triangle { corners, normal } in triangles {
            for corner in corners {
                let index = match attributes.normals[corner].try_normalize() {
                    Some(given) => {
                        *shared.entry(corner).or_insert_with(|| geometry.add_vertex(&attributes, corner, given))
                    }
                    None => geometry.add_vertex(&attributes, corner, normal),
                };
                geometry.indices.push(index);
            }
        }
        geometry
    }

    /// Returns every triangle with an area, and counts the others.
    fn triangles(&mut self, mesh: &tobj::Mesh, positions: &[DVec3]) -> Vec<Triangle> {
        let mut kept = Vec::new();
        let mut cut = Vec::new();
        let mut corners: &[u32] = &mesh.indices;
        // Without arities, every face is a triangle.
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

    fn add_vertex(&mut self, attributes: &VertexAttributes, corner: usize, normal: DVec3) -> u32 {
        let [u, v] = attributes.texture_coordinates[corner];
        self.vertices.push(Vertex {
            position: (attributes.positions[corner] - self.center).as_vec3().into(),
            normal: normal.as_vec3().into(),
            // The v axis of OBJ points up.
            uv: [u, 1.0 - v],
        });
        (self.vertices.len() - 1) as u32
    }
}

struct Triangle {
    corners: [usize; 3],
    normal: DVec3,
}

/// The vertex attributes of a tobj mesh, one entry per vertex. A missing normal is zero.
struct VertexAttributes {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    texture_coordinates: Vec<[f32; 2]>,
}

impl VertexAttributes {
    fn new(mesh: &tobj::Mesh) -> Self {
        // f64 works with either float type that tobj can be built with, and products do not overflow.
        let to_vec3 = |values: &[_; 3]| DVec3::from(values.map(f64::from));
        let to_f32 = |values: &[_; 2]| values.map(|value| f64::from(value) as f32);
        Self {
            positions: mesh.positions.as_chunks().0.iter().map(to_vec3).collect(),
            normals: mesh.normals.as_chunks().0.iter().map(to_vec3).collect(),
            texture_coordinates: mesh.texcoords.as_chunks().0.iter().map(to_f32).collect(),
        }
    }
}

/// The normal of a triangle, if it has an area.
fn normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let product = (b - a).cross(c - a);
    let longest = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
    // A comparison with NaN is false.
    if product.length() > MIN_RELATIVE_HEIGHT * longest { product.try_normalize() } else { None }
}
