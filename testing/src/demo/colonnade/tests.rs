use drawloom::glam::{Quat, Vec3};
use drawloom::scene::{Blend, Bounds, Light, Mesh, RenderObject, Scene, Texture, Topology, Vertex};

use super::colonnade;
use crate::demo::frame_check::draw_whole;

/// The triangles of a mesh. Every second one of a strip is reversed.
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

fn of_mesh<'a>(scene: &'a Scene, name: &'a str) -> impl Iterator<Item = RenderObject> + 'a {
    let objects = scene.objects().map(|handle| scene.object(handle).unwrap());
    objects.filter(move |object| scene.assets().get(object.mesh).unwrap().name() == name)
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
    // The blocks have their published footprints and the heights 165 and 330, in units of 1/100.
    for (name, volume) in [("block", 1.0), ("slab", 0.3), ("short block", 4.5), ("tall block", 9.1), ("ball", 4.0)] {
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
    // Its faces point at its centre.
    for name in ["box floor", "box ceiling", "box back wall", "box right wall", "box left wall", "box lamp"] {
        let mesh = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).find(|mesh| mesh.name() == name).unwrap();
        for corners in triangles(mesh) {
            let inward = Vec3::new(0.0, 2.7, -2.8) - Vec3::from(corners[0].position);
            assert!(facing(&corners).dot(inward) > 0.0, "{name}");
        }
    }
    let is_lamp = |light: &&Light| match light {
        Light::Hemispherical { position, direction: Vec3::NEG_Y, .. } => (-5.6..0.0).contains(&position.z),
        _ => false,
    };
    assert_eq!(scene.lights.iter().filter(is_lamp).count(), 1);
}

#[test]
fn the_scene_has_instances_mirrored_objects_strips_and_a_texture() {
    let scene = colonnade().unwrap();
    let reference = scene.as_scene_ref();
    let objects = reference.object_count();
    assert!((800..=1100).contains(&objects), "{objects}");
    let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh).collect();
    assert!(meshes.len() * 10 < objects, "instanced from {} meshes", meshes.len());
    assert!(meshes.iter().any(|mesh| mesh.topology() == Topology::TriangleStrip));
    assert_eq!(scene.assets().iter::<Texture>().count(), 1);
    assert!(reference.scales.iter().any(|scale| scale.min_element() < 0.0), "none is mirrored");
    assert!(reference.orientations.iter().any(|&orientation| orientation != Quat::IDENTITY), "none is turned");
    assert!(reference.bounds.iter().all(Bounds::is_valid));
    assert_eq!(reference.drawable_objects().count(), objects);
}

#[test]
fn its_camera_lights_and_objects_are_valid() {
    draw_whole(colonnade().unwrap().as_scene_ref());
}

#[test]
fn there_are_many_small_lights_and_a_few_large_ones() {
    let scene = colonnade().unwrap();
    let [mut directional, mut points, mut spots, mut lamps] = [0, 0, 0, 0];
    for (index, light) in scene.lights.iter().enumerate() {
        match *light {
            Light::Directional { .. } => directional += 1,
            Light::Point { range, .. } => {
                points += 1;
                assert!((2.0..=6.0).contains(&range), "point light {index} reaches {range} m");
            }
            Light::Spot { range, .. } => {
                spots += 1;
                assert!((2.0..=7.0).contains(&range), "spotlight {index} reaches {range} m");
            }
            Light::Hemispherical { .. } => lamps += 1,
            _ => panic!("{light:?}"),
        }
    }
    assert_eq!((directional, lamps), (2, 2));
    assert!((40..=60).contains(&points), "{points}");
    assert!((16..=24).contains(&spots), "{spots}");
}

#[test]
fn candlesticks_surround_the_lamp_over_the_nave() {
    let scene = colonnade().unwrap();
    let lamps = scene.lights.iter().filter_map(|light| match light {
        Light::Hemispherical { position, direction: Vec3::NEG_Y, .. } if position.z > 1.5 => Some(*position),
        _ => None,
    });
    let [lamp] = lamps.collect::<Vec<_>>()[..] else { panic!("one lamp hangs over the nave") };
    let around = of_mesh(&scene, "candlestick").map(|object| object.position - lamp.with_y(0.0)).collect::<Vec<_>>();
    for [x, z] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
        let has_one =
            around.iter().any(|position| position.x * x > 0.5 && position.z * z > 0.5 && position.length() < lamp.y);
        assert!(has_one, "none stands towards {x}, {z}");
    }
    // The lamp casts no shadow of its own.
    for mesh in ["lamp shade", "ball"] {
        for object in of_mesh(&scene, mesh).filter(|object| (object.position - lamp).length() < 0.5) {
            let bottom = object.position.y - if mesh == "ball" { f64::from(object.scale.y) } else { 0.0 };
            assert!(bottom > lamp.y, "{mesh}");
        }
    }
}

#[test]
fn panes_overlap_and_fire_and_smoke_are_blended() {
    let scene = colonnade().unwrap();
    let material = |object: &RenderObject| scene.assets().get(object.material).unwrap();
    let panes: Vec<_> = of_mesh(&scene, "pane").collect();
    for pane in &panes {
        let glass = material(pane);
        assert!(glass.blend == Blend::Alpha && glass.double_sided && glass.opacity < 0.5, "{}", glass.name);
    }
    let mut glasses: Vec<_> = panes.iter().map(|pane| material(pane).name.clone()).collect();
    glasses.sort_unstable();
    glasses.dedup();
    assert!(glasses.len() >= 4, "{glasses:?}");
    // The number of panes that a ray to the centre of each one passes.
    let eye = scene.cameras[0].position;
    let depths = panes.iter().map(|target| {
        let towards = (target.position - eye).as_vec3();
        let is_passed = |pane: &&RenderObject| {
            let into = |vector: Vec3| pane.orientation.inverse() * vector / pane.scale;
            let [from, along] = [into((eye - pane.position).as_vec3()), into(towards)];
            let hit = from - along * (from.z / along.z);
            hit.x.abs() < 0.5 && hit.y.abs() < 0.5
        };
        panes.iter().filter(is_passed).count()
    });
    let deepest = depths.max();
    assert!(deepest >= Some(3), "{deepest:?} panes, one behind the other");

    for (mesh, blend, least) in
        [("flame", Blend::Additive, 12), ("spark", Blend::Additive, 200), ("puff", Blend::Subtractive, 12)]
    {
        let objects: Vec<_> = of_mesh(&scene, mesh).collect();
        assert!(objects.len() >= least, "{} of {mesh}", objects.len());
        for object in &objects {
            let made_of = material(object);
            assert_eq!(made_of.blend, blend, "{mesh}");
            // It only emits.
            assert!(made_of.diffuse == Vec3::ZERO && made_of.emission != Vec3::ZERO, "{mesh}");
        }
    }
}

#[test]
fn every_call_returns_the_same_scene() {
    let [one, other] = [colonnade().unwrap(), colonnade().unwrap()];
    assert_eq!(one.as_scene_ref().positions, other.as_scene_ref().positions);
    assert_eq!(one.as_scene_ref().orientations, other.as_scene_ref().orientations);
    assert_eq!(one.lights, other.lights);
    let vertices = |scene: &Scene| scene.assets().iter::<Mesh>().map(|(_, mesh)| mesh.vertices().to_vec()).collect();
    let [one, other]: [Vec<_>; 2] = [vertices(&one), vertices(&other)];
    assert_eq!(one, other);
}
