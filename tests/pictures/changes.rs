//! Scenes, sizes and assets that change between frames.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Blend, Material, Mesh, RenderObject, Scene, Texture, Topology};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{cube, field, square, textured};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw};
use crate::image_distance::assert_different;

pub const CASES: &[Case] = &[
    ("a_resized_view_draws_what_a_new_one_draws", resized),
    ("objects_come_and_go", objects_come_and_go),
    ("assets_are_added_changed_and_removed", assets_change),
    ("a_frame_in_flight_is_not_affected_by_the_next", frames_in_flight),
    ("a_frame_that_is_dropped_leaves_no_trace", dropped),
    ("another_scene_replaces_the_first", another_scene),
    ("views_come_and_go", views_come_and_go),
    ("a_removed_texture_is_counted_in_every_frame", removed_texture),
];

fn resized() -> Result<(), Failed> {
    let mut scene = field(200);
    let mut fixture = Fixture::new()?;
    let first = fixture.draw(&scene)?;
    for size in [[100, 300], [333, 77], [1, 1]] {
        scene.cameras[0].size = size;
        if fixture.draw(&scene)? != draw(&scene)? {
            return Err(format!("{size:?}").into());
        }
    }
    scene.cameras[0].size = field(0).cameras[0].size;
    if fixture.draw(&scene)? == first { Ok(()) } else { Err("back at the first size it differs".into()) }
}

fn objects_come_and_go() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for count in [10, 3000, 0, 257, 256] {
        if fixture.draw(&field(count))? != draw(&field(count))? {
            return Err(format!("{count} objects").into());
        }
    }
    Ok(())
}

fn assets_change() -> Result<(), Failed> {
    let mut scene = field(100);
    let mut fixture = Fixture::new()?;
    let mut previous = fixture.draw(&scene)?;
    let (mesh, material) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);

    let checker = [[255, 0, 0, 255], [0, 0, 255, 255]].concat().repeat(8);
    let texture = scene.add(Texture::new("stripes", 4, 4, checker)?)?;
    type Change<'a> = &'a dyn Fn(&mut Scene) -> Result<(), Failed>;
    let changes: [(&str, Change<'_>); 6] = [
        ("material", &|scene| {
            Ok(scene.replace(material, Material { diffuse: Vec3::new(1.0, 0.1, 0.1), ..Material::default() })?)
        }),
        ("texture", &|scene| Ok(scene.replace(material, Material { texture: Some(texture), ..Material::default() })?)),
        ("pixels", &|scene| Ok(scene.replace(texture, Texture::new("green", 1, 1, vec![0, 255, 0, 255])?)?)),
        ("mesh", &|scene| Ok(scene.replace(mesh, square(Topology::TriangleList))?)),
        ("blending", &|scene| Ok(scene.replace(material, Material { blend: Blend::Alpha, ..Material::default() })?)),
        ("removed mesh", &|scene| {
            let other = scene.as_scene_ref().meshes[1];
            scene.remove(other)?;
            Ok(())
        }),
    ];
    for (name, change) in changes {
        change(&mut scene)?;
        let picture = fixture.draw(&scene)?;
        assert_different(&picture, &previous).map_err(|_| format!("{name}: nothing changed"))?;
        if picture != draw(&scene)? {
            return Err(format!("{name}: a new renderer draws something else").into());
        }
        previous = picture;
    }
    // More meshes than the first pages hold.
    for _ in 0..400 {
        let new = scene.add(cube())?;
        let material = scene.add(Material::default())?;
        scene.add_object(RenderObject::new(new, material, DVec3::new(0.0, 0.0, -500.0)))?;
    }
    if fixture.draw(&scene)? == draw(&scene)? { Ok(()) } else { Err("after the move it differs".into()) }
}

fn frames_in_flight() -> Result<(), Failed> {
    let mut scene = field(300);
    let before = draw(&scene)?;
    let mut fixture = Fixture::new()?;
    let first = fixture.record(&scene)?;
    let (mesh, material) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
    scene.replace(mesh, square(Topology::TriangleList))?;
    scene.replace(material, Material { diffuse: Vec3::X, ..Material::default() })?;
    let removed: drawloom::handle::Handle<Mesh> = scene.as_scene_ref().meshes[2];
    scene.remove(removed)?;
    scene.lights.clear();
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        let moved = RenderObject { position: -object.position, ..object };
        if moved.mesh != removed {
            scene.replace_object(handle, moved)?;
        }
    }
    scene.cameras[0].position.y += 3.0;
    let second = fixture.record(&scene)?;
    let after = draw(&scene)?;
    if fixture.submit(first)?.read(0, "picture")? != before {
        return Err("the first frame shows later changes".into());
    }
    if fixture.submit(second)?.read(0, "picture")? != after { Err("the second frame differs".into()) } else { Ok(()) }
}

fn dropped() -> Result<(), Failed> {
    let (one, other) = (field(300), field(50));
    let mut fixture = Fixture::new()?;
    for _ in 0..3 {
        drop(fixture.record(&one)?);
    }
    let recorded = fixture.record(&other)?;
    drop(fixture.record(&one)?);
    let picture = fixture.submit(recorded)?.read(0, "picture")?;
    if picture == draw(&other)? { Ok(()) } else { Err("a dropped frame shows".into()) }
}

fn another_scene() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    fixture.draw(&field(100))?;
    // The same slots, in collections that have changed as often, with other things in them.
    let with = |mesh: Mesh| -> Result<Scene, Failed> {
        let mut scene = field(0);
        let (mesh, material) = (scene.add(mesh)?, scene.add(Material::default())?);
        scene.add_object(RenderObject { scale: Vec3::splat(3.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
        Ok(scene)
    };
    fixture.draw(&with(cube())?)?;
    let scene = with(square(Topology::TriangleList))?;
    if fixture.draw(&scene)? == draw(&scene)? { Ok(()) } else { Err("it is mixed with the first".into()) }
}

fn removed_texture() -> Result<(), Failed> {
    let (mut scene, textures) = textured(3);
    let mut fixture = Fixture::new()?;
    scene.remove(textures[1])?;
    for _ in 0..2 {
        let recorded = fixture.record(&scene)?;
        let scene_issues = recorded.statistics().scene_issues.iter();
        let scene_issues: Vec<_> = scene_issues.map(|issue| (issue.reason, issue.count)).collect();
        if scene_issues != [(IssueReason::StaleTexture, 1)] {
            return Err(format!("{scene_issues:?}").into());
        }
    }
    Ok(())
}

fn views_come_and_go() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let scene = field(100);
    for cameras in [&scene.cameras[..1], &scene.cameras[..], &scene.cameras[1..], &scene.cameras[..]] {
        let mut part = field(100);
        part.cameras = cameras.to_vec();
        if fixture.draw(&part)? != draw(&part)? {
            return Err(format!("{} views", cameras.len()).into());
        }
    }
    Ok(())
}
