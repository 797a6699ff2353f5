//! How finely meshes are subdivided for paraboloid views, which bend straight edges.

use glam::{DVec3, Vec3};

use super::RenderView;
use crate::scene::SceneRef;

/// The subdivision level of an object that a paraboloid view draws at a level of detail: how often its edges are halved
/// until none is seen under more than `widest_angle` radians; see
/// [`ShadowQuality::widest_edge`](crate::quality::ShadowQuality::widest_edge). `None` for an object that lies entirely
/// behind the camera and so casts no shadow.
///
/// The distance is that of the nearest point of the mesh's box, so instances at one distance have one level. Where the
/// box is very near, or contains the camera, the distance of every triangle is computed instead. The level may exceed
/// [`DrawState::MAX_SUBDIVISION_LEVEL`](crate::command::DrawState::MAX_SUBDIVISION_LEVEL).
pub(super) fn subdivision_level(
    view: &RenderView,
    scene: &SceneRef<'_>,
    (object, level_of_detail): (usize, u32),
    widest_angle: f64,
) -> Option<u32> {
    let mesh = scene.assets.get(scene.meshes[object]).ok()?;
    let scale = scene.scale_column().get(object);
    let to_object = scene.orientation_column().get(object).normalize().as_dquat().inverse();
    let eye = to_object * (view.camera.position - scene.position_column().get(object));
    let forward = to_object * (view.camera.orientation.normalize() * Vec3::NEG_Z).as_dvec3();
    let min_distance = f64::from(view.camera.far) * MIN_DISTANCE_SHARE;

    let [one, other] = mesh.corners().map(|corner| (corner * scale).as_dvec3());
    let (low, high) = (one.min(other), one.max(other));
    let farthest = DVec3::select(forward.cmpge(DVec3::ZERO), high, low);
    if forward.dot(farthest - eye) <= 0.0 {
        return None;
    }
    let edge = f64::from(mesh.longest_edge_of(level_of_detail)) * f64::from(scale.abs().max_element());
    let until = |shortest: f64| (edge / shortest).log2().ceil().clamp(0.0, 64.0) as u32;
    let by_box = until(widest_angle * eye.distance(eye.clamp(low, high)).max(min_distance));
    if by_box < TRIANGLE_TEST_THRESHOLD {
        return Some(by_box);
    }
    let relative = |corner: u32| (Vec3::from(mesh.vertices()[corner as usize].position) * scale).as_dvec3() - eye;
    let triangles = mesh.triangles_in(level_of_detail, 0..mesh.triangle_count_of(level_of_detail));
    let shortest = triangles.map(|corners| corners.map(relative)).filter_map(|[a, b, c]| {
        let widest = widest_angle * distance_to_triangle(a, b, c).max(min_distance);
        let is_before = [a, b, c].iter().any(|corner| forward.dot(*corner) > 0.0);
        (is_before && a.distance(b).max(b.distance(c)).max(c.distance(a)) > widest).then_some(widest)
    });
    Some(shortest.reduce(f64::min).map_or(0, until))
}

/// Nearer geometry is treated as at this share of the light's range.
const MIN_DISTANCE_SHARE: f64 = 1e-3;

/// From this level by the box on, testing every triangle is worth its time.
const TRIANGLE_TEST_THRESHOLD: u32 = 4;

/// The distance from the origin to the nearest point of a triangle.
fn distance_to_triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let normal = (b - a).cross(c - a);
    // Inside, where the origin is on the inner side of all three edges.
    let is_inside = [(a, b), (b, c), (c, a)].iter().all(|(one, other)| (other - one).cross(-*one).dot(normal) >= 0.0);
    if is_inside && normal != DVec3::ZERO {
        return normal.normalize().dot(a).abs();
    }
    let to_edge = |one: DVec3, other: DVec3| {
        let along = other - one;
        let share = (-one.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        // An edge without length has no share.
        (one + along * if share.is_nan() { 0.0 } else { share }).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Camera, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex, ViewKind};

    /// That of [`Quality::balanced`](crate::quality::Quality::balanced): 5°.
    const WIDEST_ANGLE: f64 = 0.087_266_462_599_716_48;

    /// A floor of 8 m, seen from a lamp above it.
    fn floor_from(height: f64, scale: Vec3) -> Option<u32> {
        floor_under(WIDEST_ANGLE, DVec3::Y * height, scale)
    }

    fn floor_under(widest_angle: f64, lamp: DVec3, scale: Vec3) -> Option<u32> {
        let corner = |x, z| Vertex { position: [x, 0.0, z], ..Vertex::default() };
        let corners = vec![corner(-4.0, -4.0), corner(-4.0, 4.0), corner(4.0, -4.0), corner(4.0, 4.0)];
        let floor = Mesh::new("floor", Topology::TriangleStrip, corners, vec![0, 1, 2, 3]).unwrap();
        level_under(widest_angle, lamp, floor, scale)
    }

    /// The level of a mesh, seen by a lamp that looks down.
    fn level_under(widest_angle: f64, lamp: DVec3, mesh: Mesh, scale: Vec3) -> Option<u32> {
        let mut scene = Scene::new();
        let (mesh, material) = (scene.add(mesh).unwrap(), scene.add(Material::default()).unwrap());
        scene.add_object(RenderObject { scale, ..RenderObject::new(mesh, material, DVec3::ZERO) }).unwrap();
        let lamp = Camera {
            projection: Projection::Paraboloid,
            far: 100.0,
            kind: ViewKind::Shadow,
            ..Camera::looking_at("lamp", lamp, lamp - DVec3::Y)
        };
        subdivision_level(&RenderView::new(&lamp), &scene.as_scene_ref(), (0, 0), widest_angle)
    }

    #[test]
    fn edges_are_seen_under_five_degrees_at_most() {
        for height in [0.5, 2.0, 10.0, 80.0] {
            let edge = 128_f64.sqrt() / f64::from(1 << floor_from(height, Vec3::ONE).unwrap());
            assert!(edge / height <= WIDEST_ANGLE, "{height}");
            assert!(2.0 * edge / height > WIDEST_ANGLE, "{height}");
        }
        assert_eq!(floor_from(90.0, Vec3::splat(0.5)), Some(0));
        assert_eq!(floor_from(2.0, Vec3::new(-2.0, 1.0, 0.1)), floor_from(1.0, Vec3::ONE));
        assert_eq!(floor_from(1e-3, Vec3::splat(1e-30)), Some(0));
        assert_eq!(floor_from(1e-3, Vec3::splat(1e30)), Some(64));
    }

    #[test]
    fn twice_the_angle_is_one_level_less() {
        for height in [0.5, 2.0, 10.0, 30.0] {
            let level = |times: f64| floor_under(WIDEST_ANGLE * times, DVec3::Y * height, Vec3::ONE).unwrap();
            assert_eq!([level(0.5), level(2.0)], [level(1.0) + 1, level(1.0) - 1], "{height}");
        }
        assert_eq!(floor_under(1e-300, DVec3::Y * 2.0, Vec3::ONE), Some(64));
    }

    /// Scaled, an edge of the floor is at most 33.9 m long. At 2, 6.3 and 28.1 m an edge may be 6, 19 and 84 m long.
    #[test]
    fn the_distance_is_that_of_the_nearest_point_of_the_scaled_box() {
        let from = |x| floor_under(3.0, DVec3::new(x, 2.0, 0.0), Vec3::new(3.0, 1.0, 1.0));
        assert_eq!([from(10.0), from(18.0), from(40.0)], [Some(3), Some(1), Some(0)]);
    }

    #[test]
    fn a_small_triangle_near_to_a_lamp_needs_no_subdivision() {
        let below = |height: f32, size: f32| {
            [[-1.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, -1.0]]
                .map(|[x, _, z]| Vertex { position: [x * size, -height, z * size], ..Vertex::default() })
        };
        let level = |triangles: &[[Vertex; 3]]| {
            let indices = (0..triangles.len() as u32 * 3).collect();
            let mesh = Mesh::new("triangles", Topology::TriangleList, triangles.concat(), indices).unwrap();
            level_under(WIDEST_ANGLE, DVec3::ZERO, mesh, Vec3::ONE)
        };
        let (large, small) = (below(4.0, 4.0), below(0.1, 5e-4));
        assert_eq!([level(&[large]), level(&[small])], [Some(5), Some(0)]);
        assert_eq!(level(&[small, large]), Some(5));
    }

    #[test]
    fn an_object_behind_a_light_casts_no_shadow() {
        assert_eq!(floor_from(0.0, Vec3::ONE), None);
        assert_eq!(floor_from(-3.0, Vec3::ONE), None);
    }

    /// A room of 4 m whose walls are cut into squares of 10 cm, seen from its middle and from a hand's breadth off its
    /// floor.
    #[test]
    fn a_room_around_a_lamp_is_subdivided_no_more_than_its_walls_need() {
        let mut vertices = Vec::new();
        for face in 0..6 {
            for (u, v) in (0..40).flat_map(|u| (0..40).map(move |v| (u, v))) {
                for (du, dv) in [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)] {
                    let mut position = [(u + du) as f32 * 0.1 - 2.0, (v + dv) as f32 * 0.1 - 2.0, 2.0];
                    position[2] *= if face < 3 { 1.0 } else { -1.0 };
                    position.rotate_right(face % 3);
                    vertices.push(Vertex { position, ..Vertex::default() });
                }
            }
        }
        let indices = (0..vertices.len() as u32).collect();
        let mut scene = Scene::new();
        let mesh = scene.add(Mesh::new("room", Topology::TriangleList, vertices, indices).unwrap()).unwrap();
        let material = scene.add(Material::default()).unwrap();
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        let from = |height: f64| {
            let lamp = Camera {
                projection: Projection::Paraboloid,
                far: 10.0,
                kind: ViewKind::Shadow,
                ..Camera::looking_at("lamp", DVec3::Y * height, DVec3::Y * (height - 1.0))
            };
            subdivision_level(&RenderView::new(&lamp), &scene.as_scene_ref(), (0, 0), WIDEST_ANGLE)
        };
        // 14 cm at 2 m are 4°, and at 10 cm 81°.
        assert_eq!(from(0.0), Some(0));
        assert_eq!(from(-1.9), Some(5));
    }

    proptest! {
        #[test]
        fn the_distance_to_a_triangle_is_that_to_its_nearest_point(
            corners in prop::array::uniform3(prop::array::uniform3(-3.0..3.0_f64)),
        ) {
            let [a, b, c] = corners.map(DVec3::from);
            let found = distance_to_triangle(a, b, c);
            let steps = 60;
            let points = (0..=steps).flat_map(|one| (0..=steps - one).map(move |other| (one, other)));
            let distances = points.map(|(one, other)| {
                let (one, other) = (f64::from(one) / f64::from(steps), f64::from(other) / f64::from(steps));
                (a + (b - a) * one + (c - a) * other).length()
            });
            let nearest = distances.fold(f64::INFINITY, f64::min);
            let step = (b - a).length().max((c - a).length()) / f64::from(steps) * 2.0;
            prop_assert!(found <= nearest + 1e-9 && found >= nearest - step, "{found} {nearest}");
        }
    }
}
