//! Pictures of views that show some objects, against those of scenes that have no others.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{
    Blend, Camera, Light, MaterialPredicate, ObjectHandle, ObjectSet, RenderObject, Scene, ViewFilter,
};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_testing::scenes::{cube, field, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::image_distance::assert_different;
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("a_filtered_view_is_the_picture_of_a_scene_with_only_those_objects", on_the_device),
    ("a_filtered_view_is_that_picture_in_software_too", in_software),
    ("an_object_that_a_view_leaves_out_casts_its_shadow_there", shadow),
];

const OBJECTS: usize = 240;

/// Filters, each with a name and a function that says the same of an object of the [`field`].
type Filters = Vec<(&'static str, ViewFilter, fn(&Scene, usize) -> bool)>;

fn is_opaque(scene: &Scene, object: usize) -> bool {
    let whole = scene.as_scene_ref();
    whole.assets.get(whole.materials[object]).is_ok_and(|material| material.blend == Blend::None)
}

fn filters() -> Filters {
    let opaque = MaterialPredicate::new(|material| material.blend == Blend::None);
    let thirds: ObjectSet = (0..OBJECTS as u32).step_by(3).collect();
    vec![
        ("all", ViewFilter::ALL, |_, _| true),
        ("a third", ViewFilter::only(thirds.clone()), |_, object| object % 3 == 0),
        ("all but a third", ViewFilter::except(thirds.clone()), |_, object| object % 3 != 0),
        ("opaque objects", ViewFilter::ALL.of_materials(opaque.clone()), is_opaque),
        ("opaque ones of a third", ViewFilter::only(thirds).of_materials(opaque), |scene, object| {
            object % 3 == 0 && is_opaque(scene, object)
        }),
        ("five", ViewFilter::only((5..10).collect()), |_, object| (5..10).contains(&object)),
        ("none", ViewFilter::only(ObjectSet::default()), |_, _| false),
    ]
}

/// A field as the first of its cameras sees it.
fn scene() -> Scene {
    let mut scene = field(OBJECTS);
    scene.cameras.truncate(1);
    scene
}

/// A scene with only those objects, in the same order.
fn scene_of(passes: impl Fn(&Scene, usize) -> bool) -> Result<Scene, Failed> {
    let mut scene = scene();
    let handles: Vec<ObjectHandle> = scene.objects().collect();
    let objects = handles.iter().map(|handle| scene.object(*handle)).collect::<Result<Vec<_>, _>>()?;
    let kept: Vec<_> = objects.into_iter().enumerate().filter(|(object, _)| passes(&scene, *object)).collect();
    for handle in handles {
        scene.remove_object(handle)?;
    }
    for (_, object) in kept {
        scene.add_object(object)?;
    }
    Ok(scene)
}

/// Draws each filter with one renderer, twice, and compares the pictures with those of new renderers.
fn check(
    mut draw: impl FnMut(&Scene) -> Result<Picture, Failed>,
    fresh: impl Fn(&Scene) -> Result<Picture, Failed>,
) -> Result<(), Failed> {
    let (mut filtered, mut pictures) = (scene(), Vec::<Picture>::new());
    let filters = filters();
    for (name, filter, passes) in filters.iter().chain(filters.iter().rev()) {
        filtered.cameras[0].filter = filter.clone();
        let (found, expected) = (draw(&filtered)?, fresh(&scene_of(passes)?)?);
        expect(found == expected, || format!("{name}: not the picture of that scene"))?;
        if pictures.len() < filters.len() {
            expect(!pictures.contains(&found), || format!("{name}: a picture of another filter"))?;
            pictures.push(found);
        }
    }
    Ok(())
}

fn on_the_device() -> Result<(), Failed> {
    let of_workers = |workers| Fixture::with(workers, |builder| builder.pipeline(Deferred::to_picture()));
    for workers in [1, 3] {
        let mut fixture = of_workers(workers)?;
        check(|scene| fixture.draw(scene), |scene| of_workers(1)?.draw(scene))?;
    }
    Ok(())
}

fn in_software() -> Result<(), Failed> {
    let renderer = |workers| {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        Ok::<_, Failed>(builder.pipeline(Deferred::to_picture()).build(scheduler)?)
    };
    let draw = |(renderer, submitter): &mut (Renderer<SoftwareBackend>, Submitter<_>), scene: &Scene| {
        Ok(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "picture")?)
    };
    let mut kept = renderer(2)?;
    check(|scene| draw(&mut kept, scene), |scene| draw(&mut renderer(1)?, scene))
}

/// The ground is in the shadow of a cube that the camera leaves out: the picture differs from that without the cube.
fn shadow() -> Result<(), Failed> {
    let mut scene = field(0);
    let (mesh, material) = (scene.add(cube())?, scene.assets().iter().next().ok_or("a material")?.0);
    let ground = RenderObject::new(mesh, material, DVec3::Y * -1.0);
    let ground = RenderObject { scale: (DVec3::new(6.0, 0.2, 6.0)).as_vec3(), ..ground };
    scene.add_object(ground)?;
    let head = scene.add_object(RenderObject::new(mesh, material, DVec3::Y * 1.5))?;
    let direction = DVec3::NEG_Y.as_vec3();
    scene.lights = vec![Light::Directional { direction, illuminance: DVec3::ONE.as_vec3(), casts_shadow: true }];
    let camera = Camera::looking_at("main", DVec3::new(0.0, 6.0, 9.0), DVec3::ZERO);
    let filter = ViewFilter::except(scene.object_set([head])?);
    scene.cameras = vec![Camera { filter, ..sized(camera, [96, 64]) }];
    let mut fixture = Fixture::new()?;
    let left_out = fixture.draw(&scene)?;
    scene.cameras[0].filter = ViewFilter::ALL;
    let visible = fixture.draw(&scene)?;
    scene.remove_object(head)?;
    let removed = fixture.draw(&scene)?;
    assert_different(&left_out, &removed)?;
    assert_different(&left_out, &visible)
}
