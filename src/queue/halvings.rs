//! How finely meshes are subdivided for paraboloids, which bend straight edges.

use glam::{DVec3, Vec3};

use crate::scene::SceneRef;
use crate::view::RenderView;

/// How often the edges of an object are to be halved in the view of a paraboloid: until they are seen under 5° at most, where
/// being drawn straight puts them off by half a pixel of a map of 1024 (Brabec et al. 2002). `None` for an object that lies
/// behind the camera as a whole, and keeps no light from anything.
///
/// The distance is that of the nearest place of the mesh's box, so the result is the same for every instance at one distance;
/// it may be more than [`DrawState::FINEST`](crate::command::DrawState::FINEST).
pub(super) fn halvings(view: &RenderView, scene: &SceneRef<'_>, object: usize) -> Option<u32> {
    let mesh = scene.assets.get(scene.meshes[object]).ok()?;
    let scale = scene.scales[object];
    let to_object = scene.orientations[object].normalize().as_dquat().inverse();
    let eye = to_object * (view.camera.position - scene.positions[object]);
    let forward = to_object * (view.camera.orientation.normalize() * Vec3::NEG_Z).as_dvec3();

    let [one, other] = mesh.corners().map(|corner| (corner * scale).as_dvec3());
    let (low, high) = (one.min(other), one.max(other));
    let farthest = DVec3::select(forward.cmpge(DVec3::ZERO), high, low);
    if forward.dot(farthest - eye) <= 0.0 {
        return None;
    }
    let distance = eye.distance(eye.clamp(low, high)).max(f64::from(view.camera.far) * 1e-3);
    let edge = f64::from(mesh.longest_edge()) * f64::from(scale.abs().max_element());
    Some((edge / (WIDEST_ANGLE * distance)).log2().ceil().clamp(0.0, 64.0) as u32)
}

/// In radians.
const WIDEST_ANGLE: f64 = 0.0873;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::scene::{Camera, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex, ViewKind};

    /// A floor of 8 m, seen from a lamp above it.
    fn floor_from(height: f64, scale: Vec3) -> Option<u32> {
        let corner = |x, z| Vertex { position: [x, 0.0, z], ..Vertex::default() };
        let corners = vec![corner(-4.0, -4.0), corner(-4.0, 4.0), corner(4.0, -4.0), corner(4.0, 4.0)];
        let mut scene = Scene::new();
        let mesh = scene.add(Mesh::new("floor", Topology::TriangleStrip, corners, vec![0, 1, 2, 3]).unwrap()).unwrap();
        let material = scene.add(Material::default()).unwrap();
        scene.add_object(RenderObject { scale, ..RenderObject::new(mesh, material, DVec3::ZERO) }).unwrap();
        let lamp = Camera {
            projection: Projection::Paraboloid,
            far: 100.0,
            kind: ViewKind::Shadow,
            ..Camera::looking_at("lamp", DVec3::Y * height, DVec3::Y * (height - 1.0))
        };
        halvings(&RenderView::new(&lamp), &scene.as_scene_ref(), 0)
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
    fn what_is_behind_a_light_keeps_it_from_nothing() {
        assert_eq!(floor_from(0.0, Vec3::ONE), None);
        assert_eq!(floor_from(-3.0, Vec3::ONE), None);
    }
}
