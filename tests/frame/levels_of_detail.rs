//! Objects are drawn at the coarsest level of detail whose error is small enough in the picture, and keep it for a
//! while.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::{Batch, DrawList};
use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, DepthCurve, DepthPrecision, Quality};
use drawloom::scene::{
    Blend, Camera, Changes, Light, Material, Mesh, Projection, RenderObject, Scene, SceneRef, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Granularity, LevelStatistics, Renderer};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::leveled::{globe, halved, whole};
use drawloom_testing::scenes::{cube, culled, sized, with_meshes};

/// Globes and cubes of many sizes around the origin, some of them blended or mirrored, seen by a camera of each
/// projection: a main one off centre, a parallel one, and a shadow camera of each kind.
fn globes(count: usize) -> Scene {
    let mut scene = Scene::new();
    let meshes = [scene.add(globe()).unwrap(), scene.add(cube()).unwrap(), scene.add(globe()).unwrap()];
    let stone = scene.add(Material::default()).unwrap();
    let glass = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() }).unwrap();
    let mut random = Random::new();
    for index in 0..count {
        let position = DVec3::from([0; 3].map(|_| random.between(-30.0, 30.0)));
        let scale = Vec3::from([0; 3].map(|_| random.between(0.2, 1.5) as f32));
        let scale = if index % 7 == 0 { scale * Vec3::new(-1.0, 1.0, 1.0) } else { scale };
        let orientation = Quat::from_rotation_x(random.between(0.0, 6.0) as f32);
        let material = if index % 5 == 0 { glass } else { stone };
        let object = RenderObject::new(meshes[index % 3], material, position);
        scene.add_object(RenderObject { scale, orientation, ..object }).unwrap();
    }
    let camera = |name: &str, kind, projection, far| Camera {
        kind,
        projection,
        far,
        ..sized(Camera::looking_at(name, DVec3::new(0.0, 12.0, 34.0), DVec3::ZERO), [64; 2])
    };
    let perspective = Projection::Perspective { field_of_view: 1.2 };
    let main = camera("main", ViewKind::Main, perspective, f32::INFINITY);
    scene.cameras = vec![
        Camera { size: [320, 180], shift: Vec2::new(0.3, -0.1), ..main },
        camera("plan", ViewKind::Main, Projection::Orthographic { height: 40.0 }, 90.0),
        camera("spot", ViewKind::Shadow, perspective, 80.0),
        camera("lamp", ViewKind::Shadow, Projection::Paraboloid, 80.0),
    ];
    scene.lights = vec![Light::Spot {
        position: DVec3::Y * 50.0,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        range: 60.0,
        inner_angle: 0.3,
        outer_angle: 0.5,
        casts_shadow: true,
    }];
    scene
}

fn quality(level_of_detail: f32) -> Quality {
    let mut quality = Quality { level_of_detail, ..Quality::balanced() };
    quality.shadows.side = 64;
    quality
}

fn renderer_of(quality: Quality, workers: usize, granularity: Granularity) -> Renderer<NullBackend> {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    builder.granularity(granularity).build(scheduler).unwrap().0
}

fn renderer(level_of_detail: f32) -> Renderer<NullBackend> {
    renderer_of(quality(level_of_detail), 2, Granularity::default())
}

/// The levels of the objects that each view draws, by the view's name.
type Levels = BTreeMap<(String, u32), u32>;

/// The levels that all processes draw objects at.
fn levels_of(renderer: &Renderer<NullBackend>, views: &[String]) -> Levels {
    let mut levels = Levels::new();
    for (index, name) in views.iter().enumerate() {
        for process in ["geometry buffer", "transparency", "shadow casters"] {
            let Some(list) = renderer.draw_list(process, index) else { continue };
            for (object, level) in drawn(&list) {
                let before = levels.insert((name.clone(), object), level);
                assert!(before.is_none_or(|before| before == level), "one level in a view");
            }
        }
    }
    levels
}

/// Each object of a list with its level.
fn drawn(list: &DrawList) -> impl Iterator<Item = (u32, u32)> {
    let objects_of = |batch: &Batch| {
        let level = batch.state.level_of_detail();
        list.objects[batch.first as usize..][..batch.count as usize].iter().map(move |&object| (object, level))
    };
    list.batches.iter().flat_map(objects_of)
}

/// Draws a frame, and returns the levels of its objects.
fn frame(renderer: &mut Renderer<NullBackend>, scene: &SceneRef<'_>) -> Levels {
    let recorded = renderer.record(*scene).unwrap();
    let views: Vec<_> = recorded.statistics().views.iter().map(|view| view.name.clone()).collect();
    drop(recorded);
    levels_of(renderer, &views)
}

/// A naive model of the choice, with the levels of the frames before.
#[derive(Default)]
struct Model {
    before: Levels,
}

impl Model {
    /// The errors of an object's levels in pixels of a camera's picture, those of level 0 first.
    fn errors(scene: &SceneRef<'_>, camera: &Camera, object: usize) -> Vec<f64> {
        let mesh = scene.assets.get(scene.meshes[object]).unwrap();
        let scale = scene.scales[object];
        let largest_scale = f64::from(scale.x.abs().max(scale.y.abs()).max(scale.z.abs()));
        let turn = scene.orientations[object].as_dquat();
        let center = scene.positions[object] + turn * (mesh.bounds().center * scale).as_dvec3();
        let radius = f64::from(mesh.bounds().radius) * largest_scale;
        let in_camera = camera.orientation.as_dquat().inverse() * (center - camera.position);
        let (distance, near) = (in_camera.length(), f64::from(camera.near));
        let height = f64::from(camera.size[1]);
        let pixels_per_metre = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let focal = height / 2.0 / (f64::from(field_of_view) / 2.0).tan();
                let nearest = (-in_camera.z - radius).max(near);
                let corner = |side: u32, shift: f32| f64::from(side) / 2.0 * (1.0 + f64::from(shift.abs()));
                let corner = corner(camera.size[0], camera.shift.x).hypot(corner(camera.size[1], camera.shift.y));
                focal / nearest * (corner.hypot(focal) / focal).min((distance + radius) / nearest)
            }
            Projection::Orthographic { height: metres } => height / f64::from(metres),
            _ => height / 2.0 / (distance - radius).max(near),
        };
        let levels = mesh.levels().iter().map(|level| f64::from(level.error()));
        [0.0].into_iter().chain(levels).map(|error| error * largest_scale * pixels_per_metre).collect()
    }

    /// Checks the levels of a frame. Those that rounding may decide are accepted.
    fn check(&mut self, scene: &SceneRef<'_>, allowed: f64, levels: &Levels) {
        for ((view, object), &level) in levels {
            let Some(camera) = scene.cameras.iter().find(|camera| camera.name == *view) else { continue };
            let allowed = allowed * if camera.kind == ViewKind::Shadow { 2.0 } else { 1.0 };
            let errors = Self::errors(scene, camera, *object as usize);
            let coarsest = |largest: f64| errors.iter().rposition(|error| *error <= largest).unwrap_or(0) as u32;
            let key = (view.clone(), *object);
            let choice = |allowed: f64| match self.before.get(&key) {
                Some(&before) => before.max(coarsest(0.75 * allowed)).min(coarsest(allowed)),
                None => coarsest(allowed),
            };
            let choices = [choice(allowed * (1.0 - 1e-5)), choice(allowed * (1.0 + 1e-5))];
            assert!(
                choices.contains(&level),
                "object {object} in {view}: level {level}, not {choices:?} by {errors:?}"
            );
            self.before.insert(key, level);
        }
    }
}

/// How many objects have each level.
fn histogram(levels: &Levels) -> [usize; 3] {
    let mut counts = [0; 3];
    levels.values().for_each(|&level| counts[level as usize] += 1);
    counts
}

#[test]
fn objects_have_the_levels_of_a_naive_model_while_cameras_and_objects_move() {
    let by_depth = DepthPrecision { bits: 12, curve: DepthCurve::Logarithmic };
    for changed in [
        quality(1.0),
        Quality { opaque_order: by_depth, ..quality(1.0) },
        Quality { culling: CullingVolume::None, ..quality(0.6) },
    ] {
        let (mut scene, mut model, mut random) = (globes(300), Model::default(), Random::new());
        let mut renderer = renderer_of(changed, 2, Granularity::default());
        let allowed = f64::from(changed.level_of_detail);
        let mut seen = [0; 3];
        for number in 0..40 {
            let mut moved = Vec::new();
            if number % 4 != 3 {
                for _ in 0..random.between(0.0, 12.0) as usize {
                    let object = scene.objects().nth(random.between(0.0, 299.0) as usize).unwrap();
                    let before = scene.object(object).unwrap();
                    let position = before.position + DVec3::from([0; 3].map(|_| random.between(-4.0, 4.0)));
                    scene.replace_object(object, RenderObject { position, ..before }).unwrap();
                    moved.push(scene.objects().position(|other| other == object).unwrap() as u32);
                }
            }
            if number % 3 == 0 {
                for camera in &mut scene.cameras {
                    camera.position += DVec3::from([0; 3].map(|_| random.between(-1.5, 1.5)));
                }
            }
            // A picture of another size shows the same, with larger errors.
            scene.cameras[0].size = if number % 8 < 6 { [320, 180] } else { [640, 360] };
            // Views get other indices.
            scene.cameras.swap(2, 3);
            moved.sort_unstable();
            moved.dedup();
            let changes = if moved.is_empty() { Changes::NONE } else { Changes::Objects(&moved) };
            let changes = if number == 0 { Changes::Unknown } else { changes };
            let scene = SceneRef { changes, ..scene.as_scene_ref() };
            let levels = frame(&mut renderer, &scene);
            model.check(&scene, allowed, &levels);
            seen = std::array::from_fn(|level| seen[level] + histogram(&levels)[level]);
        }
        assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
    }
}

#[test]
fn at_an_error_of_0_and_without_levels_nothing_is_chosen() {
    let scene = globes(100);
    for (scene, level_of_detail) in [(&scene, 0.0), (&with_meshes(globes(100), whole), 1.0)] {
        let mut renderer = renderer(level_of_detail);
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        assert!(recorded.statistics().views.iter().all(|view| view.levels_of_detail.is_none()));
        drop(recorded);
        assert!(!renderer.stage_graph_to_dot().unwrap().contains("levels"));
        assert_eq!(histogram(&frame(&mut renderer, &scene.as_scene_ref()))[1..], [0, 0]);
    }
    let mut renderer = renderer(1.0);
    let mut still = scene;
    still.cameras.iter_mut().for_each(|camera| camera.level_of_detail_scale = 0.0);
    assert!(histogram(&frame(&mut renderer, &still.as_scene_ref()))[1..] != [0, 0], "lights have cameras of their own");
    let levels = frame(&mut renderer, &still.as_scene_ref());
    assert!(levels.iter().all(|((view, _), level)| *level == 0 || view.starts_with("shadow of")));
    assert!(renderer.stage_graph_to_dot().unwrap().contains("levels"));
}

#[test]
fn a_camera_scales_the_error_and_an_invalid_scale_is_an_error_that_names_it() {
    let mut scene = globes(200);
    let fine = frame(&mut renderer(2.0), &scene.as_scene_ref());
    scene.cameras.iter_mut().for_each(|camera| camera.level_of_detail_scale = 2.0);
    let scaled = frame(&mut renderer(1.0), &scene.as_scene_ref());
    let of_cameras = |levels: &Levels| -> Levels {
        levels.clone().into_iter().filter(|((view, _), _)| !view.starts_with("shadow of")).collect()
    };
    assert_eq!(of_cameras(&fine), of_cameras(&scaled));
    for wrong in [-1.0, f32::NAN, f32::INFINITY] {
        scene.cameras[1].level_of_detail_scale = wrong;
        let error = renderer(1.0).record(scene.as_scene_ref()).err().unwrap();
        assert!(matches!(error, FrameError::Scene(_)));
        let message = error.to_string();
        assert!(message.contains("plan") && message.contains("level_of_detail_scale"), "{message}");
    }
}

#[test]
fn an_object_at_the_border_of_two_levels_changes_its_level_once() {
    let mut scene = globes(0);
    let mesh = scene.assets().iter::<Mesh>().next().unwrap().0;
    let material = scene.assets().iter::<Material>().next().unwrap().0;
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    scene.cameras.truncate(1);
    scene.cameras[0].shift = Vec2::ZERO;
    let at =
        |distance: f64| Camera { ..sized(Camera::looking_at("main", DVec3::Z * distance, DVec3::ZERO), [320, 180]) };
    let level_at = |renderer: &mut Renderer<NullBackend>, distance: f64| {
        let mut cameras = scene.cameras.clone();
        cameras[0] = at(distance);
        let scene = SceneRef { cameras: &cameras, changes: Changes::NONE, ..scene.as_scene_ref() };
        frame(renderer, &scene)[&("main".to_owned(), 0)]
    };
    // Where a new renderer changes from level 0 to level 1.
    let border = (1..2000).map(|step| f64::from(step) * 0.05 + 1.5);
    let border = border.clone().find(|&distance| level_at(&mut renderer(1.0), distance) == 1).unwrap();
    let mut renderer = renderer(1.0);
    assert_eq!(level_at(&mut renderer, border - 1.0), 0);
    let levels: Vec<_> = (0..40).map(|step| level_at(&mut renderer, border + 0.1 * f64::from(step % 3 - 1))).collect();
    assert_eq!(levels, [0; 40], "it stays fine until the margin is passed");
    assert_eq!(level_at(&mut renderer, border * 1.4), 1);
    let levels: Vec<_> = (0..40).map(|step| level_at(&mut renderer, border + 0.1 * f64::from(step % 3))).collect();
    assert_eq!(levels, [1; 40], "it stays coarse until its error is too large");
    assert_eq!(level_at(&mut renderer, border - 0.1), 0);
}

#[test]
fn workers_and_granularity_do_not_change_the_levels() {
    let scene = globes(2_000);
    let lists = |workers, granularity| {
        let mut renderer = renderer_of(quality(1.0), workers, granularity);
        let mut cameras = scene.cameras.clone();
        let mut lists = Vec::new();
        for _ in 0..4 {
            cameras.iter_mut().for_each(|camera| camera.position += DVec3::new(0.3, -0.2, 0.9));
            let scene = SceneRef { cameras: &cameras, ..scene.as_scene_ref() };
            drop(renderer.record(scene).unwrap());
            let views = 0..renderer_views(&renderer);
            lists.extend(views.flat_map(|view| {
                ["geometry buffer", "transparency", "shadow casters"]
                    .map(|process| renderer.draw_list(process, view).map(|list| list.clone()))
            }));
        }
        lists
    };
    let expected = lists(1, Granularity::default());
    for (workers, granularity) in [(2, Granularity::Chunk(7)), (3, Granularity::PerDraw), (2, Granularity::PerCamera)] {
        assert!(lists(workers, granularity) == expected, "{workers} workers");
    }
}

fn renderer_views(renderer: &Renderer<NullBackend>) -> usize {
    (0..)
        .take_while(|&view| {
            ["geometry buffer", "shadow casters"].iter().any(|process| renderer.draw_list(process, view).is_some())
        })
        .count()
}

#[test]
fn statistics_say_how_many_triangles_levels_save() {
    let scene = globes(300);
    let mut renderer = renderer(1.0);
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let statistics = recorded.statistics().clone();
    drop(recorded);
    let triangles_of = |level: u32, is_globe: bool| match (is_globe, level) {
        (false, _) => 12,
        (true, 0) => 960,
        (true, 1) => 224,
        _ => 48,
    };
    for view in 0..2 {
        let mut expected = LevelStatistics::default();
        for process in ["geometry buffer", "transparency"] {
            for (object, level) in drawn(&renderer.draw_list(process, view).unwrap()) {
                expected.triangles += triangles_of(level, object % 3 != 1);
                expected.full_detail_triangles += triangles_of(0, object % 3 != 1);
            }
        }
        assert_eq!(statistics.views[view].levels_of_detail, Some(expected));
        assert!(expected.triangles < expected.full_detail_triangles);
    }
}

#[test]
fn triangles_are_culled_of_the_level_that_is_drawn() {
    let scene = with_meshes(globes(300), culled);
    let mut renderer = renderer(1.0);
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let statistics = recorded.statistics().clone();
    drop(recorded);
    for view in &statistics.views[..2] {
        assert_eq!(view.culled_triangles.triangles, view.levels_of_detail.unwrap().triangles);
        assert!(view.culled_triangles.back_facing > 0);
    }
    let list = renderer.draw_list("geometry buffer", 0).unwrap();
    for (index, batch) in list.batches.iter().enumerate() {
        let mesh = scene.assets().iter::<Mesh>().find(|(handle, _)| handle.index() == batch.mesh).unwrap().1;
        let level = batch.state.level_of_detail() as usize;
        let indices = if level == 0 { mesh.indices() } else { mesh.levels()[level - 1].indices() };
        let remaining = list.remaining(index).unwrap();
        let remaining = &list.remaining_indices()[remaining.start as usize..remaining.end as usize];
        assert!(remaining.chunks_exact(3).all(|triangle| indices.chunks_exact(3).any(|other| other == triangle)));
    }
}

#[test]
fn only_an_object_at_level_0_hides_others() {
    let mut scene = globes(0);
    let mesh = scene.add(halved(&cube())).unwrap();
    let material = scene.assets().iter::<Material>().next().unwrap().0;
    let wall = RenderObject::new(mesh, material, DVec3::ZERO);
    scene.add_object(RenderObject { scale: Vec3::new(9.0, 9.0, 0.1), ..wall }).unwrap();
    scene.add_object(RenderObject::new(mesh, material, DVec3::Z * -9.0)).unwrap();
    scene.cameras.truncate(1);
    scene.cameras[0] = sized(Camera::looking_at("main", DVec3::Z * 20.0, DVec3::ZERO), [320, 180]);
    for (level_of_detail, level, occluded) in [(1.0, 0, 1), (1e4, 1, 0)] {
        let quality = Quality { occlusion: Some(4), ..quality(level_of_detail) };
        let mut renderer = renderer_of(quality, 2, Granularity::default());
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        assert_eq!(recorded.statistics().views[0].occluded, occluded);
        drop(recorded);
        assert!(drawn(&renderer.draw_list("geometry buffer", 0).unwrap()).any(|drawn| drawn == (0, level)));
    }
}

#[test]
fn levels_of_replaced_meshes_are_those_of_the_model() {
    let (mut scene, mut model, mut renderer) = (globes(120), Model::default(), renderer(1.0));
    let handle = scene.assets().iter::<Mesh>().next().unwrap().0;
    for count in [1, 2, 0, 1] {
        let levels = globe().levels()[..count].to_vec();
        scene.replace(handle, globe().with_levels(levels).unwrap()).unwrap();
        let scene = scene.as_scene_ref();
        model.check(&scene, 1.0, &frame(&mut renderer, &scene));
    }
}
