use super::*;
use crate::scene::{Bounds, Texture, Topology, Vertex};

/// A mesh's triangles as they are wound, every second one of a strip turned around.
fn triangles(mesh: &Mesh) -> Vec<[Vertex; 3]> {
    let stride = if mesh.topology() == Topology::TriangleList { 3 } else { 1 };
    let corners = mesh.indices().windows(3).step_by(stride).enumerate();
    let wound = corners.map(|(number, corners)| match mesh.topology() {
        Topology::TriangleStrip if number % 2 == 1 => [corners[1], corners[0], corners[2]],
        _ => [corners[0], corners[1], corners[2]],
    });
    wound.map(|corners| corners.map(|index| mesh.vertices()[index as usize])).collect()
}

fn facing(corners: &[Vertex; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|corner| Vec3::from(corner.position));
    (b - a).cross(c - a)
}

#[test]
fn every_triangle_is_wound_around_its_normals_which_have_unit_length() {
    let scene = colonnade().unwrap();
    for (_, mesh) in scene.assets().iter::<Mesh>() {
        for (number, corners) in triangles(mesh).iter().enumerate() {
            for corner in corners {
                let normal = Vec3::from(corner.normal);
                assert!(normal.is_normalized(), "{}, triangle {number}: {normal}", mesh.name());
                assert!(facing(corners).dot(normal) > 0.0, "{}, triangle {number}", mesh.name());
            }
        }
    }
}

#[test]
fn solids_are_closed_and_have_their_volume() {
    let scene = colonnade().unwrap();
    // The published footprints, 165 and 330 high, in units of a hundredth.
    for (name, volume) in [("block", 1.0), ("slab", 0.3), ("short block", 4.5), ("tall block", 9.1), ("lantern", 4.0)] {
        let mesh = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).find(|mesh| mesh.name() == name).unwrap();
        let triangles = triangles(mesh);
        let outward: Vec3 = triangles.iter().map(facing).sum();
        assert!(outward.length() < 1e-3, "{name} is open: {outward}");
        let six_times: f32 = triangles.iter().map(|corners| facing(corners).dot(corners[0].position.into())).sum();
        assert!((six_times / 6.0 / volume - 1.0).abs() < 0.03, "{name}: {}", six_times / 6.0);
    }
}

#[test]
fn the_box_has_its_published_measurements() {
    let scene = colonnade().unwrap();
    let area = |name: &str| {
        let mesh = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).find(|mesh| mesh.name() == name).unwrap();
        triangles(mesh).iter().map(|corners| facing(corners).length() / 2.0).sum::<f32>()
    };
    let published = [
        ("box floor", 0.5 * (552.8 + 549.6) * 559.2),
        ("box back wall", 0.5 * (549.6 + 556.0) * 548.8),
        ("box right wall", 559.2 * 548.8),
        ("box lamp", 130.0 * 105.0),
        ("box ceiling", 556.0 * 559.2 - 130.0 * 105.0),
    ];
    for (name, expected) in published {
        assert!((area(name) * 1e4 / expected - 1.0).abs() < 1e-3, "{name}: {}", area(name));
    }
    // Its faces look at its middle.
    for name in ["box floor", "box ceiling", "box back wall", "box right wall", "box left wall", "box lamp"] {
        let mesh = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).find(|mesh| mesh.name() == name).unwrap();
        for corners in triangles(mesh) {
            let inward = Vec3::new(0.0, 2.7, -2.8) - Vec3::from(corners[0].position);
            assert!(facing(&corners).dot(inward) > 0.0, "{name}");
        }
    }
    let lamp = |light: &&Light| matches!(light, Light::Hemispherical { direction: Vec3::NEG_Y, .. });
    assert_eq!(scene.lights.iter().filter(lamp).count(), 1);
}

#[test]
fn it_has_what_a_test_wants_of_a_scene() {
    let scene = colonnade().unwrap();
    let reference = scene.as_scene_ref();
    let objects = reference.object_count();
    assert!((300..=900).contains(&objects), "{objects}");
    let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).collect();
    assert!(meshes.len() * 10 < objects, "instanced from {} meshes", meshes.len());
    assert!(meshes.iter().any(|mesh| mesh.topology() == Topology::TriangleStrip));
    assert_eq!(scene.assets().iter::<Texture>().count(), 1);
    assert!(reference.scales.iter().any(|scale| scale.min_element() < 0.0), "none is mirrored");
    assert!(reference.orientations.iter().any(|&orientation| orientation != Quat::IDENTITY), "none is turned");
    let kind = |light: &Light| std::mem::discriminant(light);
    let mut kinds: Vec<_> = scene.lights.iter().map(kind).collect();
    kinds.dedup();
    assert!(kinds.len() >= 4, "{} kinds of light in a row", kinds.len());
    assert!((8..=24).contains(&scene.lights.len()), "{}", scene.lights.len());
    for (index, light) in scene.lights.iter().enumerate() {
        light.check(index).unwrap();
    }
    scene.cameras[0].check().unwrap();
    assert!(reference.bounds.iter().all(Bounds::is_valid));
}

#[test]
fn it_is_the_same_every_time() {
    let [one, other] = [colonnade().unwrap(), colonnade().unwrap()];
    assert_eq!(one.as_scene_ref().positions, other.as_scene_ref().positions);
    assert_eq!(one.as_scene_ref().orientations, other.as_scene_ref().orientations);
    assert_eq!(one.lights, other.lights);
    let vertices = |scene: &Scene| scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh.vertices().to_vec()).collect();
    let [one, other]: [Vec<_>; 2] = [vertices(&one), vertices(&other)];
    assert_eq!(one, other);
}
