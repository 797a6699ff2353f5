//! A bounding volume hierarchy over the triangles of a scene, for ray casts.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Mesh, SceneRef, Topology};

use super::bounds::bounds;
use super::outliers;
use super::up_axis::UpAxis;

/// The triangles in normalised coordinates, with +Y up: the centre of their bounding box is the origin, and its corners
/// are at distance 1. So f32 is precise enough for scenes of any size, anywhere.
pub(super) struct Bvh {
    /// The centre of the box in the world with +Y up, in metres.
    pub center: DVec3,
    /// Half the box's diagonal, in metres.
    pub radius: f64,
    /// Half the box's size, normalised.
    pub half_size: Vec3,
    triangles: Vec<Triangle>,
    /// The root is first.
    nodes: Vec<Node>,
}

/// The nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// In units of [`Bvh::radius`].
    pub distance: f32,
    /// Whether the surface faces the ray's origin, by its normals.
    pub front_facing: bool,
}

#[derive(Clone, Copy)]
struct Triangle {
    corner: Vec3,
    edges: [Vec3; 2],
    normal: Vec3,
}

struct Node {
    low: Vec3,
    high: Vec3,
    /// The first of its triangles.
    first: usize,
    count: usize,
    /// The index of its second child; the first child follows the node. `None` for a leaf.
    second: Option<usize>,
}

/// The most triangles of a leaf.
const MAX_LEAF_TRIANGLES: usize = 6;

/// The most triangles of a hierarchy. Of more only every second, third ... is kept, which is enough to tell an interior
/// from an object.
const MAX_TRIANGLES: usize = 2_000_000;

/// The most nodes that a ray tests. A ray through a scene tests some hundred. Where triangles lie in each other, as
/// those of a file that has them all many times, no hierarchy separates them, and a ray would test all. Nearer nodes
/// are tested first, so what is found by then is close to what is nearest.
const MAX_NODES_OF_RAY: usize = 2_000;

impl Bvh {
    /// Leaves out what is far from the rest. `None` if no triangle can be drawn.
    pub(super) fn new(scene: SceneRef<'_>, up: UpAxis) -> Option<Self> {
        let with_mesh = |object: usize| scene.assets.get(scene.meshes[object]).ok().map(|mesh| (object, mesh));
        let objects = || scene.drawable_objects().filter_map(with_mesh);
        let total: usize = objects().map(|(_, mesh)| mesh.triangle_count()).sum();
        let step = total.div_ceil(MAX_TRIANGLES).max(1);
        let drawn = objects().flat_map(|(object, mesh)| in_world(scene, object, mesh)).step_by(step);
        let mut world: Vec<_> = drawn
            .map(|(corners, normal)| {
                (corners.map(|corner| up.to_y_up(corner)), up.to_y_up(normal.as_dvec3()).as_vec3())
            })
            .collect();
        outliers::remove(&mut world);
        let (low, high) = bounds(world.iter().flat_map(|(corners, _)| *corners));
        let (center, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        if !(radius > 0.0 && radius.is_finite()) {
            return None;
        }
        let triangles = world.into_iter().map(|(corners, normal)| {
            let [a, b, c] = corners.map(|corner| ((corner - center) / radius).as_vec3());
            Triangle { corner: a, edges: [b - a, c - a], normal }
        });
        let half_size = ((high - low) / (2.0 * radius)).as_vec3();
        let mut bvh = Self { center, radius, half_size, triangles: triangles.collect(), nodes: Vec::new() };
        bvh.build(0, bvh.triangles.len());
        Some(bvh)
    }

    /// The nearest intersection of a ray. `direction` has unit length.
    pub(super) fn cast(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.cast_counting(origin, direction).0
    }

    /// Points on the triangles, each with the normal there: `count` that are spread over the area, and as many over the
    /// triangles, of which there are most where there is most detail.
    pub(super) fn surface_points(&self, count: usize) -> Vec<(Vec3, Vec3)> {
        let of_triangles = (0..count).map(|number| &self.triangles[number * self.triangles.len() / count]);
        let total: f64 = self.triangles.iter().map(|triangle| f64::from(triangle.area())).sum();
        let (mut passed, mut number) = (0.0, 0);
        let mut of_area = Vec::new();
        for triangle in &self.triangles {
            passed += f64::from(triangle.area());
            while number < count && (number as f64 + 0.5) / count as f64 * total <= passed {
                of_area.push(triangle);
                number += 1;
            }
        }
        let point = |(number, triangle): (usize, &Triangle)| (triangle.point(number), triangle.normal);
        of_triangles.chain(of_area).enumerate().map(point).collect()
    }

    /// The nearest intersection, and how many nodes were tested for it.
    fn cast_counting(&self, origin: Vec3, direction: Vec3) -> (Option<Hit>, usize) {
        let inverse = direction.recip();
        let mut nearest = None;
        let mut limit = f32::INFINITY;
        let mut tested = 1;
        // Each with the distance at which the ray enters it.
        let mut pending: Vec<_> = self.nodes[0].enter(origin, inverse).map(|enter| (0, enter)).into_iter().collect();
        while let Some((index, enter)) = pending.pop() {
            if enter > limit {
                continue;
            }
            let node = &self.nodes[index];
            if let Some(second) = node.second {
                // Leaves that are pending already are still intersected.
                if tested >= MAX_NODES_OF_RAY {
                    continue;
                }
                tested += 2;
                let children = [index + 1, second].map(|child| (child, self.nodes[child].enter(origin, inverse)));
                let mut children = children.map(|(child, enter)| enter.map(|enter| (child, enter)));
                // The nearer one is taken first.
                if let [Some((_, first)), Some((_, second))] = children
                    && first < second
                {
                    children.swap(0, 1);
                }
                pending.extend(children.into_iter().flatten());
                continue;
            }
            for triangle in &self.triangles[node.first..node.first + node.count] {
                if let Some(distance) = triangle.distance(origin, direction).filter(|&distance| distance < limit) {
                    limit = distance;
                    nearest = Some(Hit { distance, front_facing: triangle.normal.dot(direction) < 0.0 });
                }
            }
        }
        (nearest, tested)
    }

    /// Adds the node over `count` triangles from `first` on and its descendants: a median split along the longest axis.
    fn build(&mut self, first: usize, count: usize) {
        let triangles = &mut self.triangles[first..first + count];
        let corners = triangles.iter().flat_map(Triangle::corners);
        let (low, high) =
            corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
        let index = self.nodes.len();
        self.nodes.push(Node { low, high, first, count, second: None });
        if count <= MAX_LEAF_TRIANGLES {
            return;
        }
        let axis = (high - low).max_position();
        let half = count / 2;
        triangles.select_nth_unstable_by(half, |one, other| one.centroid()[axis].total_cmp(&other.centroid()[axis]));
        self.build(first, half);
        self.nodes[index].second = Some(self.nodes.len());
        self.build(first + half, count - half);
    }
}

impl Node {
    /// The distance at which the ray enters the box, if it does.
    fn enter(&self, origin: Vec3, inverse: Vec3) -> Option<f32> {
        let (one, other) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        let enter = one.min(other).max_element().max(0.0);
        let leave = one.max(other).min_element();
        // A ray in the plane of a side gives NaN, which counts as a hit: a false positive only costs time.
        let misses = enter > leave * 1.00001;
        (!misses).then_some(enter)
    }
}

impl Triangle {
    fn corners(&self) -> [Vec3; 3] {
        [self.corner, self.corner + self.edges[0], self.corner + self.edges[1]]
    }

    fn area(&self) -> f32 {
        self.edges[0].cross(self.edges[1]).length() / 2.0
    }

    /// A point on the triangle. Successive numbers give points that are spread over it.
    fn point(&self, number: usize) -> Vec3 {
        // The fractions of multiples of two numbers that are independent of each other: the plastic number's powers.
        let [mut u, mut v] = [0.754_877_7, 0.569_840_3].map(|step: f32| (number as f32 * step).fract());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        self.corner + self.edges[0] * u + self.edges[1] * v
    }

    fn centroid(&self) -> Vec3 {
        self.corner + (self.edges[0] + self.edges[1]) / 3.0
    }

    /// Möller–Trumbore intersection, without backface culling.
    fn distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let across = direction.cross(self.edges[1]);
        let inverse = self.edges[0].dot(across).recip();
        let offset = origin - self.corner;
        let u = offset.dot(across) * inverse;
        let turned = offset.cross(self.edges[0]);
        let v = direction.dot(turned) * inverse;
        let distance = self.edges[1].dot(turned) * inverse;
        // A ray parallel to the triangle divides by 0; every comparison is then false.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-6).then_some(distance)
    }
}

/// The finite triangles of an object in the world, each with the sum of its vertex normals.
fn in_world<'a>(
    scene: SceneRef<'a>,
    object: usize,
    mesh: &'a Mesh,
) -> impl Iterator<Item = ([DVec3; 3], Vec3)> + use<'a> {
    let (position, orientation, scale) = (scene.positions[object], scene.orientations[object], scene.scales[object]);
    let stride = match mesh.topology() {
        Topology::TriangleList => 3,
        Topology::TriangleStrip => 1,
    };
    mesh.indices().windows(3).step_by(stride).filter_map(move |corners| {
        let vertices = [corners[0], corners[1], corners[2]].map(|index| mesh.vertices()[index as usize]);
        let points = vertices.map(|vertex| {
            let local = Vec3::from(vertex.position).as_dvec3() * scale.as_dvec3();
            position + orientation.as_dquat() * local
        });
        let normal = orientation * (vertices.map(|vertex| Vec3::from(vertex.normal)).iter().sum::<Vec3>() / scale);
        let is_finite = points.iter().all(|point| point.is_finite()) && normal.is_finite();
        is_finite.then_some((points, normal))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::colonnade;

    #[test]
    fn a_ray_cast_equals_a_brute_force_search() {
        let scene = colonnade().unwrap();
        let bvh = Bvh::new(scene.as_scene_ref(), UpAxis::Y).unwrap();
        let mut hits = 0;
        for number in 0..60 {
            let turn = number as f32;
            let origin = Vec3::new((turn * 0.7).sin() * 0.5, (turn * 0.3).cos() * 0.1, (turn * 1.3).sin() * 0.5);
            let direction = Vec3::new((turn * 2.1).sin(), (turn * 0.9).sin(), (turn * 1.7).cos()).normalize();
            let distances = bvh.triangles.iter().filter_map(|triangle| triangle.distance(origin, direction));
            let expected = distances.min_by(f32::total_cmp);
            assert_eq!(bvh.cast(origin, direction).map(|hit| hit.distance), expected, "{number}");
            hits += usize::from(expected.is_some());
        }
        assert!((15..60).contains(&hits), "{hits}");
    }

    /// `count` triangles that all reach through the whole scene.
    fn nested(count: usize, corners: impl Fn(f32) -> [Vec3; 3]) -> Bvh {
        let triangles = (0..count).map(|number| {
            let [a, b, c] = corners(number as f32 / count as f32);
            Triangle { corner: a, edges: [b - a, c - a], normal: (b - a).cross(c - a) }
        });
        let triangles = triangles.collect();
        let mut bvh =
            Bvh { center: DVec3::ZERO, radius: 1.0, half_size: Vec3::splat(0.5), triangles, nodes: Vec::new() };
        bvh.build(0, count);
        bvh
    }

    #[test]
    fn a_ray_tests_few_nodes_however_many_triangles_lie_in_each_other() {
        let coincident = |_: f32| [Vec3::new(-0.5, -0.5, 0.1), Vec3::new(0.5, -0.5, 0.0), Vec3::new(0.0, 0.5, -0.1)];
        // Each is nearer to the ray's origin than the one before, by less than they are tilted.
        let stacked = |share: f32| coincident(share).map(|corner| corner + Vec3::Z * (0.01 * share));
        let origin = Vec3::new(0.01, -0.02, 2.0);
        for (bvh, tolerance) in [(nested(50_000, coincident), 0.0), (nested(50_000, stacked), 0.01)] {
            let (hit, tested) = bvh.cast_counting(origin, Vec3::NEG_Z);
            assert!(tested <= MAX_NODES_OF_RAY + 1, "{tested} of {}", bvh.nodes.len());
            let distances = bvh.triangles.iter().filter_map(|triangle| triangle.distance(origin, Vec3::NEG_Z));
            let nearest = distances.fold(f32::INFINITY, f32::min);
            let hit = hit.expect("all are hit");
            assert!(hit.front_facing && (0.0..=tolerance).contains(&(hit.distance - nearest)), "{hit:?} {nearest}");
        }
    }
}
