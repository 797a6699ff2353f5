//! A hierarchy of boxes over triangles, for rays.

use drawloom::glam::Vec3;

/// A triangle with the colour of its surface.
#[derive(Clone, Copy)]
pub struct Triangle {
    pub corners: [Vec3; 3],
    pub normals: [Vec3; 3],
    pub color: Vec3,
}

/// What a ray meets.
#[derive(Clone, Copy)]
pub struct Hit {
    pub distance: f32,
    pub normal: Vec3,
    pub color: Vec3,
}

#[derive(Default)]
pub struct Bvh {
    triangles: Vec<Triangle>,
    /// The root is first; the first child of a node follows it.
    nodes: Vec<Node>,
}

struct Node {
    low: Vec3,
    high: Vec3,
    triangles: std::ops::Range<usize>,
    /// `None` for a leaf.
    second: Option<usize>,
}

/// The most triangles of a leaf.
const MAX_LEAF_TRIANGLES: usize = 8;

impl Bvh {
    /// Takes over other triangles. The memory is used again.
    pub fn rebuild(&mut self, triangles: impl Iterator<Item = Triangle>) {
        self.triangles.clear();
        self.triangles.extend(triangles);
        self.nodes.clear();
        if !self.triangles.is_empty() {
            self.build(0, self.triangles.len());
        }
    }

    fn build(&mut self, start: usize, end: usize) {
        let corners = self.triangles[start..end].iter().flat_map(|triangle| triangle.corners);
        let (low, high) = corners
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| (low.min(corner), high.max(corner)));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, triangles: start..end, second: None });
        if end - start <= MAX_LEAF_TRIANGLES {
            return;
        }
        let axis = (high - low).max_position();
        let middle = (start + end) / 2;
        let key = |triangle: &Triangle| triangle.corners.iter().map(|corner| corner[axis]).sum::<f32>();
        self.triangles[start..end].select_nth_unstable_by(middle - start, |one, other| key(one).total_cmp(&key(other)));
        self.build(start, middle);
        self.nodes[node].second = Some(self.nodes.len());
        self.build(middle, end);
    }

    /// The nearest triangle that a ray meets.
    pub fn cast(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let (mut nearest, mut pending) = (None, vec![0]);
        let mut reach = f32::INFINITY;
        while let Some(index) = pending.pop() {
            let Some(node) = self.nodes.get(index) else { break };
            let [to_low, to_high] = [node.low, node.high].map(|corner| (corner - origin) / direction);
            let enters = to_low.min(to_high).max_element().max(0.0);
            if enters > to_low.max(to_high).min_element().min(reach) {
                continue;
            }
            match node.second {
                Some(second) => pending.extend([index + 1, second]),
                None => {
                    for triangle in &self.triangles[node.triangles.clone()] {
                        if let Some(hit) = triangle.cast(origin, direction).filter(|hit| hit.distance < reach) {
                            reach = hit.distance;
                            nearest = Some(hit);
                        }
                    }
                }
            }
        }
        nearest
    }
}

impl Triangle {
    /// Möller and Trumbore's test.
    fn cast(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant.abs() < 1e-9 {
            return None;
        }
        let from_a = origin - a;
        let u = from_a.dot(p) / determinant;
        let q = from_a.cross(ab);
        let v = direction.dot(q) / determinant;
        let distance = ac.dot(q) / determinant;
        let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-4;
        let [na, nb, nc] = self.normals;
        let normal = (na * (1.0 - u - v) + nb * u + nc * v).normalize_or_zero();
        is_inside.then_some(Hit { distance, normal, color: self.color })
    }
}
