//! The geometry of one model.

use std::collections::HashMap;

use drawloom::glam::DVec3;
use drawloom::scene::Vertex;

use crate::polygon::triangulate;
use crate::preprocessing::position_index;

/// The triangles of a model that have an area.
#[derive(Debug, Default)]
pub(crate) struct ModelGeometry {
    /// One part, unless the model has details that are too small for 32-bit coordinates of the whole.
    pub parts: Vec<GeometryPart>,
    /// Those that were left out, as [`Imported::degenerate_triangles`](crate::Imported::degenerate_triangles) says.
    pub degenerate_triangles: usize,
    pub fanned_polygons: usize,
}

/// Triangles of a model. Every vertex has a normal.
#[derive(Debug, Default)]
pub(crate) struct GeometryPart {
    /// The centre of the bounding box. Vertices are relative to it.
    pub center: DVec3,
    pub vertices: Vec<Vertex>,
    /// The colours of the vertices, linear; empty if none has one.
    pub colors: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
}

/// A triangle whose height is less than this share of its longest edge counts as degenerate: it is thinner than the
/// rounding of 32-bit coordinates.
const MIN_RELATIVE_HEIGHT: f64 = 1e-7;

/// The largest coordinate. The radius of the bounding sphere of a mesh is at most √3 times as large, which is finite as
/// `f32`.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 2.0;

/// A part is divided if the longest edge of a triangle is less than this share of half the part's size: its 32-bit
/// coordinates, which are relative to the middle, are rounded by up to a sixteenth of that.
const MIN_RELATIVE_EDGE: f64 = 1e-6;

/// The most times that a part is divided.
const MAX_DIVISIONS: u32 = 64;

impl ModelGeometry {
    /// `positions` are those of the file, whose indices the mesh has as positions. `colors`, in sRGB, are those of the
    /// positions, if there are any.
    pub(crate) fn new(mesh: &tobj::Mesh, positions: &[DVec3], colors: &[[f64; 3]]) -> Self {
        let mut geometry = Self::default();
        let attributes = VertexAttributes::new(mesh, positions, colors);
        let triangles = geometry.triangles(mesh, &attributes.positions);
        divide(triangles, &attributes, MAX_DIVISIONS, &mut geometry.parts);
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
            if points.iter().any(|point| !point.is_finite()) {
                self.degenerate_triangles += arity - 2;
                continue;
            }
            cut.clear();
            self.fanned_polygons += usize::from(!triangulate(&points, &mut cut));
            for cut in &cut {
                let corners = cut.map(|corner| polygon[corner] as usize);
                match triangle(corners, cut.map(|corner| points[corner])) {
                    Some(triangle) => kept.push(triangle),
                    None => self.degenerate_triangles += 1,
                }
            }
        }
        kept
    }
}

impl GeometryPart {
    /// Triangles share vertices that have a normal in the file. Others get the normal of their face, and are not
    /// shared.
    fn new(triangles: &[Triangle], attributes: &VertexAttributes, center: DVec3) -> Self {
        let mut part = Self { center, ..Self::default() };
        let mut shared = HashMap::new();
        for Triangle { corners, normal, .. } in triangles {
            for &corner in corners {
                let index = match attributes.normals[corner].try_normalize() {
                    Some(given) => *shared.entry(corner).or_insert_with(|| part.add_vertex(attributes, corner, given)),
                    None => part.add_vertex(attributes, corner, *normal),
                };
                part.indices.push(index);
            }
        }
        part
    }

    fn add_vertex(&mut self, attributes: &VertexAttributes, corner: usize, normal: DVec3) -> u32 {
        let [u, v] = attributes.texture_coordinates[corner];
        self.vertices.push(Vertex {
            position: (attributes.positions[corner] - self.center).as_vec3().into(),
            normal: normal.as_vec3().into(),
            // The v axis of OBJ points up.
            uv: [u, 1.0 - v],
        });
        self.colors.extend(attributes.colors.get(corner));
        (self.vertices.len() - 1) as u32
    }
}

/// Adds the triangles as one part, or divides them at the middle of the longest axis until each part has room for its
/// smallest triangle.
fn divide(triangles: Vec<Triangle>, attributes: &VertexAttributes, divisions: u32, parts: &mut Vec<GeometryPart>) {
    if triangles.is_empty() {
        return;
    }
    let corners = |triangle: &Triangle| triangle.corners.map(|corner| attributes.positions[corner]);
    let (low, high) = bounds(triangles.iter().flat_map(corners));
    let smallest = triangles.iter().map(|triangle| triangle.longest_edge).fold(f64::INFINITY, f64::min);
    let centroid = |triangle: &Triangle| corners(triangle).into_iter().map(|corner| corner / 3.0).sum::<DVec3>();
    let (first, last) = bounds(triangles.iter().map(centroid));
    let axis = (last - first).max_position();
    let middle = first[axis] / 2.0 + last[axis] / 2.0;
    let has_room = smallest >= MIN_RELATIVE_EDGE * ((high - low).max_element() / 2.0);
    if has_room || divisions == 0 || middle >= last[axis] {
        parts.push(GeometryPart::new(&triangles, attributes, low / 2.0 + high / 2.0));
        return;
    }
    let (before, behind) = triangles.into_iter().partition(|triangle| centroid(triangle)[axis] <= middle);
    divide(before, attributes, divisions - 1, parts);
    divide(behind, attributes, divisions - 1, parts);
}

/// The corners of the box around points.
fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)))
}

struct Triangle {
    corners: [usize; 3],
    normal: DVec3,
    longest_edge: f64,
}

/// The vertex attributes of a tobj mesh, one entry per vertex. A missing normal is zero.
struct VertexAttributes {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    texture_coordinates: Vec<[f32; 2]>,
    /// Linear; empty if no vertex has a colour.
    colors: Vec<[f32; 3]>,
}

impl VertexAttributes {
    fn new(mesh: &tobj::Mesh, positions: &[DVec3], colors: &[[f64; 3]]) -> Self {
        // f64 works with either float type that tobj can be built with.
        let to_f64 = |values: &[_; 3]| values.map(f64::from);
        let to_f32 = |values: &[_; 2]| values.map(|value| f64::from(value) as f32);
        let indices = mesh.positions.as_chunks().0.iter().map(|position| position_index(to_f64(position)));
        // Without colours in the file, no index has one.
        let colors: Vec<_> = indices.clone().filter_map(|index| colors.get(index)).collect();
        let is_colored = colors.iter().any(|color| **color != [1.0; 3]);
        Self {
            positions: indices.map(|index| positions[index]).collect(),
            colors: colors.into_iter().filter(|_| is_colored).map(|color| color.map(linear_from_srgb)).collect(),
            normals: mesh.normals.as_chunks().0.iter().map(|normal| DVec3::from(to_f64(normal))).collect(),
            texture_coordinates: mesh.texcoords.as_chunks().0.iter().map(to_f32).collect(),
        }
    }
}

/// The linear value of a channel in sRGB (IEC 61966-2-1).
fn linear_from_srgb(value: f64) -> f32 {
    (if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }) as f32
}

/// A triangle with its normal, if it has an area and 32-bit coordinates can represent it.
fn triangle(corners: [usize; 3], [a, b, c]: [DVec3; 3]) -> Option<Triangle> {
    let product = (b - a).cross(c - a);
    let longest = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
    // A comparison with NaN is false.
    let has_area = product.length() > MIN_RELATIVE_HEIGHT * longest;
    let is_representable = [a, b, c].iter().all(|point| point.abs().cmple(DVec3::splat(MAX_COORDINATE)).all());
    let normal = if has_area && is_representable { product.try_normalize() } else { None };
    normal.map(|normal| Triangle { corners, normal, longest_edge: longest.sqrt() })
}
