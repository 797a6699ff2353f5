//! Streaming on wgpu's noop backend: budgets, order, and what makes room.

use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{BackendError, StreamingBudget, StreamingStatistics, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::handle::Handle;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_testing::adapter;

use crate::reported;

/// The bytes of each mesh of the world: in a page of 64 KiB are two.
const VERTICES: usize = 1000;
const BYTES: u64 = VERTICES as u64 * 32 + 3 * 4;

struct World {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    scene: Scene,
    meshes: Vec<Handle<Mesh>>,
}

fn mesh(number: usize) -> Mesh {
    sized_mesh(&number.to_string(), VERTICES)
}

fn sized_mesh(name: &str, vertices: usize) -> Mesh {
    let vertex = |index| Vertex { position: [(index % 2) as f32, (index % 3) as f32, 0.0], ..Vertex::default() };
    let vertices = (0..vertices).map(vertex).collect();
    Mesh::new(name, Topology::TriangleList, vertices, vec![0, 1, 2]).unwrap()
}

impl World {
    /// A row of objects along x, 10 m apart, each with a mesh of its own, in front of a camera that sees one or two of
    /// them. There is one worker, so that what happens does not depend on time.
    fn new(count: usize, budget: StreamingBudget) -> Self {
        let (device, queue) = adapter::noop_device().unwrap();
        let backend = WgpuBackend::new(device, queue).unwrap().stream_resources(budget).unwrap();
        let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let mut scene = Scene::new();
        let material = scene.add(Material::default()).unwrap();
        let meshes: Vec<_> = (0..count).map(|number| scene.add(mesh(number)).unwrap()).collect();
        for (number, mesh) in meshes.iter().enumerate() {
            let position = DVec3::X * number as f64 * 10.0;
            scene.add_object(RenderObject::new(*mesh, material, position)).unwrap();
        }
        let mut world = Self { renderer, submitter, scene, meshes };
        world.look_at(0.0);
        world
    }

    /// Adds an object with a mesh of its own, in the row or beyond its end.
    fn add(&mut self, mesh: Mesh, place: f64) -> Handle<Mesh> {
        let mesh = self.scene.add(mesh).unwrap();
        let material = self.scene.assets().iter::<Material>().next().unwrap().0;
        self.scene.add_object(RenderObject::new(mesh, material, DVec3::X * place * 10.0)).unwrap();
        mesh
    }

    /// The number of frames until nothing that is in sight is missing.
    fn frames_until_complete(&mut self, at_most: usize) -> usize {
        (0..at_most).find(|_| self.missing() == 0).unwrap_or(at_most)
    }

    fn statistics(&self) -> StreamingStatistics {
        self.renderer.backend().streaming_statistics().unwrap()
    }

    fn look_at(&mut self, object: f64) {
        let target = DVec3::new(object * 10.0 + 0.5, 1.0, 0.0);
        self.scene.cameras = vec![Camera::looking_at("main", target + DVec3::Z * 5.0, target)];
    }

    fn frame(&mut self) -> (FrameStatistics, StreamingStatistics) {
        let recorded = self.renderer.record(self.scene.as_scene_ref()).unwrap();
        let statistics = self.submitter.submit(recorded).unwrap().statistics;
        (statistics, self.renderer.backend().streaming_statistics().unwrap())
    }

    /// The number of objects that the next frame leaves out.
    fn missing(&mut self) -> usize {
        let (statistics, _) = self.frame();
        let missing = statistics.scene_issues.iter().find(|issue| issue.reason == IssueReason::NotResident);
        missing.map_or(0, |missing| missing.count)
    }

    fn frames(&mut self, count: usize) -> StreamingStatistics {
        (0..count).map(|_| self.frame().1).last().unwrap()
    }
}

fn budget(meshes: u64) -> StreamingBudget {
    StreamingBudget {
        mesh_bytes: meshes,
        texture_bytes: StreamingBudget::MIN_BYTES,
        upload_bytes_per_frame: 70_000,
        upload_time_per_frame: Duration::from_secs(10),
    }
}

#[test]
fn a_budget_that_is_too_small_is_refused_by_name() {
    let good = StreamingBudget::default();
    good.check().unwrap();
    let cases = [
        ("mesh_bytes", StreamingBudget { mesh_bytes: 1000, ..good }),
        ("texture_bytes", StreamingBudget { texture_bytes: 0, ..good }),
        ("upload_bytes_per_frame", StreamingBudget { upload_bytes_per_frame: 100, ..good }),
        ("upload_time_per_frame", StreamingBudget { upload_time_per_frame: Duration::ZERO, ..good }),
    ];
    for (name, budget) in cases {
        let (device, queue) = adapter::noop_device().unwrap();
        match WgpuBackend::new(device, queue).unwrap().stream_resources(budget) {
            Err(BackendError::InvalidStreamingBudget { field, .. }) => assert_eq!(field, name),
            other => panic!("{name}: {:?}", other.err()),
        }
    }
}

#[test]
fn what_is_in_sight_comes_first_then_what_has_a_higher_priority() {
    let mut world = World::new(40, budget(8 << 20));
    // The first frame knows what is in sight only when it is recorded.
    world.look_at(30.0);
    assert!(world.missing() >= 1);
    for (number, mesh) in world.meshes.clone().into_iter().enumerate() {
        world.scene.set_priority(mesh, if number == 20 { 5 } else { 0 }).unwrap();
    }
    // Two frames of uploads wait at most, then comes what is in sight.
    let arrived = (1..10).find(|_| world.missing() == 0).unwrap();
    assert!(arrived <= 5, "{arrived} frames");
    world.look_at(20.0);
    assert_eq!(world.missing(), 0, "it has the highest priority");
    let resident = world.frames(60);
    assert_eq!((resident.requested, resident.in_flight, resident.meshes), (0, 0, 40));
    for object in 0..40 {
        world.look_at(f64::from(object));
        assert_eq!(world.missing(), 0);
    }
}

#[test]
fn budgets_hold_in_every_frame_of_a_flight_and_what_is_in_sight_arrives() {
    let budget = budget(1 << 20);
    let mut world = World::new(200, budget);
    let (mut uploaded, mut arrived) = (0, 0);
    for step in 0..1600 {
        world.look_at(f64::from(step) / 8.0);
        let (statistics, streaming) = world.frame();
        assert!(streaming.mesh_bytes <= budget.mesh_bytes, "{streaming:?}");
        assert!(streaming.uploaded_bytes - uploaded <= budget.upload_bytes_per_frame, "{streaming:?}");
        assert_eq!(streaming.over_budget, 0);
        uploaded = streaming.uploaded_bytes;
        arrived += usize::from(statistics.scene_issues.is_empty());
    }
    let streaming = world.frames(1);
    assert!(streaming.evictions > 150 && streaming.uploaded_bytes > 180 * BYTES, "{streaming:?}");
    assert!(arrived > 600, "{arrived} of 1600 frames were complete");
    world.frames(12);
    assert_eq!(world.missing(), 0);
}

#[test]
fn what_was_seen_longest_ago_makes_room() {
    // Room for 30 meshes, more or less.
    let mut world = World::new(60, budget(StreamingBudget::MIN_BYTES));
    // All others are less important than what was seen, so that they do not fill the room.
    let visit = |world: &mut World, objects: &[usize]| {
        for &object in objects {
            world.look_at(object as f64);
            world.frames(12);
            assert_eq!(world.missing(), 0, "object {object}");
        }
    };
    let first: Vec<_> = (0..12).collect();
    let second: Vec<_> = (20..32).collect();
    visit(&mut world, &first);
    visit(&mut world, &second);
    // The second ones were seen last. Those of neither are still to come or were never seen.
    visit(&mut world, &[50, 52]);
    for object in second {
        world.look_at(object as f64);
        assert_eq!(world.missing(), 0, "object {object}");
    }
}

#[test]
fn a_full_budget_makes_room_for_as_many_meshes_a_frame_as_may_be_uploaded() {
    const SMALL: usize = 100;
    let mut world = World::new(0, budget(StreamingBudget::MIN_BYTES));
    // Two clusters, of which only one fits.
    for number in 0..500 {
        let cluster = number / 250;
        let place = f64::from(cluster) * 100.0 + f64::from(number % 250) * 0.0001;
        world.add(sized_mesh(&number.to_string(), SMALL), place);
    }
    assert!(world.frames_until_complete(60) < 60);
    world.frames(60);
    let full = world.statistics();
    assert!(full.requested > 150, "the budget is full: {full:?}");
    world.look_at(100.0);
    world.frame();
    let missing = world.missing();
    let frames = world.frames_until_complete(missing);
    assert!(missing > 150 && frames < missing / 8, "{frames} frames for {missing} meshes");
    let after = world.statistics();
    assert!(after.evictions as usize <= missing, "one makes room for one as large: {after:?}");
}

/// A world whose budget is full, and in which every other mesh of the row was seen later than those between.
fn fragmented_world() -> World {
    let mut world = World::new(30, budget(StreamingBudget::MIN_BYTES));
    world.frames(60);
    for first in [0, 1] {
        for object in (first..30).step_by(2) {
            world.look_at(f64::from(object));
            world.frame();
            world.frame();
        }
    }
    assert_eq!((world.missing(), world.statistics().meshes, world.statistics().evictions), (0, 30, 0));
    world
}

#[test]
fn room_is_made_where_a_mesh_fits() {
    // In each page are two meshes that were seen at different times. The new one takes more than one of them, and less
    // than a page.
    let mut world = fragmented_world();
    world.add(sized_mesh("large", 1500), 100.0);
    world.look_at(100.0);
    let frames = world.frames_until_complete(40);
    let after = world.frames(40);
    assert!(frames < 8 && after.evictions == 2, "{frames} frames, {after:?}");
    assert_eq!((after.wanted, after.over_budget), (0, 0));
}

#[test]
fn whole_pages_make_room_for_a_mesh_that_is_larger_than_a_page() {
    let mut world = fragmented_world();
    // Three pages and a little.
    world.add(sized_mesh("larger", 6200), 100.0);
    world.look_at(100.0);
    let frames = world.frames_until_complete(40);
    let after = world.frames(40);
    assert!(frames < 16 && (7..=8).contains(&after.evictions), "{frames} frames, {after:?}");
    assert!(after.mesh_bytes <= StreamingBudget::MIN_BYTES, "{after:?}");
}

#[test]
fn a_mesh_that_has_no_room_costs_no_evictions_and_arrives_when_it_has() {
    // The first of the two meshes in each page is in sight all the time.
    let mut world = fragmented_world();
    let places: Vec<_> = (0..30).step_by(2).collect();
    world.add(sized_mesh("large", 1500), 14.0);
    let far = DVec3::new(145.0, 1.0, 260.0);
    world.scene.cameras = vec![Camera::looking_at("main", far, DVec3::new(145.0, 1.0, 0.0))];
    for mesh in places.iter().map(|place| world.meshes[place + 1]).collect::<Vec<_>>() {
        let objects: Vec<_> = world.scene.objects().collect();
        let object = objects.into_iter().find(|object| world.scene.object(*object).unwrap().mesh == mesh).unwrap();
        let before = world.scene.object(object).unwrap();
        // Out of sight, but used.
        world.scene.replace_object(object, RenderObject { position: DVec3::Y * -5000.0, ..before }).unwrap();
    }
    let before = world.frames(4);
    let after = world.frames(100);
    assert_eq!((after.evictions, after.uploaded_bytes), (before.evictions, before.uploaded_bytes), "{after:?}");
    assert_eq!((after.wanted, after.over_budget, world.missing()), (1, 1, 1), "{after:?}");
    world.look_at(14.0);
    assert!(world.frames_until_complete(20) < 20);
    assert_eq!(world.statistics().evictions, before.evictions + 2);
}

#[test]
fn a_mesh_that_can_never_fit_is_told_once_by_name_and_evicts_nothing() {
    let budget = budget(StreamingBudget::MIN_BYTES);
    let mut world = World::new(30, budget);
    world.frames(60);
    let bytes = 40_000 * 32 + 3 * 4;
    let large = world.add(sized_mesh("mountain", 40_000), 0.0);
    let told = reported(|| {
        let after = world.frames(50);
        assert_eq!((after.too_large, after.requested, after.wanted, after.evictions), (1, 0, 0, 0), "{after:?}");
    });
    assert_eq!(told.matches("mountain").count(), 1, "{told}");
    assert!(told.contains(&format!("bytes={bytes}")) && told.contains("allowed=1048576"), "{told}");
    assert_eq!(world.missing(), 1, "its object is left out");
    // What replaces it is something else.
    world.scene.replace(large, sized_mesh("hill", 2_000)).unwrap();
    assert!(world.frames_until_complete(20) < 20);
    assert_eq!(world.statistics().too_large, 0);
    let told = reported(|| {
        world.scene.replace(large, sized_mesh("summit", 50_000)).unwrap();
        world.frames(5);
    });
    assert_eq!(told.matches("summit").count(), 1, "{told}");
    world.scene.remove(large).unwrap();
    assert_eq!(world.frames(2).too_large, 0);
}

#[test]
fn frames_that_draw_more_than_the_budget_keep_what_they_have_and_count_the_rest() {
    let budget = budget(StreamingBudget::MIN_BYTES);
    let mut world = World::new(100, budget);
    let far = DVec3::new(500.0, 1.0, 900.0);
    world.scene.cameras = vec![Camera::looking_at("main", far, DVec3::new(500.0, 1.0, 0.0))];
    let before = world.frames(80);
    assert!(before.over_budget > 0 && before.meshes > 20, "{before:?}");
    assert!(world.missing() > 40);
    let after = world.frames(40);
    assert_eq!((after.evictions, after.uploaded_bytes), (before.evictions, before.uploaded_bytes), "nothing thrashes");
    // What is more important replaces what is less.
    let important = world.meshes[99];
    world.scene.set_priority(important, 1).unwrap();
    world.frames(20);
    world.look_at(99.0);
    assert_eq!(world.missing(), 0);
}

#[test]
fn the_timeline_counts_what_is_on_the_device_and_what_is_requested() {
    let mut world = World::new(10, budget(1 << 20));
    world.renderer.scheduler().timeline().start();
    let last = world.frames(30);
    let log = world.renderer.scheduler().timeline().take();
    let latest = |name: &str| log.counters.iter().rfind(|counter| counter.name == name).map(|counter| counter.value);
    assert_eq!(latest("bytes resident"), Some(last.resident_bytes() as f64));
    assert_eq!((latest("streaming requests"), latest("streaming evictions")), (Some(0.0), Some(0.0)));
    let first = log.counters.iter().find(|counter| counter.name == "streaming requests");
    assert!(first.is_some_and(|counter| counter.value >= 9.0), "{first:?}");
}

#[test]
fn what_no_longer_exists_is_freed_and_its_uploads_are_dropped() {
    let mut world = World::new(40, budget(8 << 20));
    world.frames(3);
    for mesh in world.meshes.clone() {
        world.scene.remove(mesh).unwrap();
    }
    let streaming = world.frames(4);
    assert_eq!((streaming.meshes, streaming.mesh_bytes, streaming.requested, streaming.in_flight), (0, 0, 0, 0));
}

#[test]
fn textures_of_several_sizes_share_their_budget() {
    let layer = |side: u64| side * side * 4 * 4 / 3;
    let budget = StreamingBudget { texture_bytes: 24 * layer(256), ..budget(1 << 20) };
    let mut world = World::new(64, StreamingBudget { upload_bytes_per_frame: 1 << 20, ..budget });
    world.scene = Scene::new();
    let mesh = world.scene.add(mesh(0)).unwrap();
    for number in 0..64 {
        let side = if number < 40 { 64 } else { 512 };
        let texture = Texture::new("plain", side, side, vec![200; (side * side * 4) as usize]).unwrap();
        let texture = world.scene.add(texture).unwrap();
        let material = world.scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        let position = DVec3::X * f64::from(number) * 10.0;
        world.scene.add_object(RenderObject::new(mesh, material, position)).unwrap();
    }
    for pass in [0, 1] {
        for step in 0..64 {
            // To and fro.
            let object = if pass == 0 { step } else { 63 - step };
            world.look_at(f64::from(object));
            let streaming = world.frames(12);
            assert!(streaming.texture_bytes <= budget.texture_bytes, "{streaming:?}");
            let (statistics, _) = world.frame();
            assert_eq!(statistics.scene_issues, [], "object {object} in pass {pass}");
        }
    }
}

#[test]
fn textures_beyond_the_layers_of_an_array_are_in_another_one() {
    let layers = adapter::noop_device().unwrap().0.limits().max_texture_array_layers;
    let budget = StreamingBudget {
        texture_bytes: 1 << 30,
        upload_bytes_per_frame: 64 << 20,
        upload_time_per_frame: Duration::from_secs(100),
        ..budget(1 << 20)
    };
    let mut world = World::new(1, budget);
    let mesh = world.meshes[0];
    let mut add = |side: u32, place: f64| {
        let texture = Texture::new("plain", side, side, vec![200; (side * side * 4) as usize]).unwrap();
        let texture = world.scene.add(texture).unwrap();
        let material = world.scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        world.scene.add_object(RenderObject::new(mesh, material, DVec3::X * place * 10.0)).unwrap();
    };
    (0..4).for_each(|_| add(512, 0.0));
    (0..layers + 3).for_each(|number| add(1, 100.0 + f64::from(number) * 0.0001));
    world.frames(4);
    world.look_at(100.0);
    world.frames(8);
    let (statistics, streaming) = world.frame();
    assert_eq!(statistics.scene_issues, []);
    assert_eq!((streaming.over_budget, streaming.evictions, streaming.textures), (0, 0, layers as usize + 7));
}

#[test]
fn a_mesh_that_is_replaced_while_the_budget_is_full_is_drawn_in_every_frame() {
    let budget = StreamingBudget { upload_bytes_per_frame: StreamingBudget::MIN_UPLOAD_BYTES, ..budget(1 << 20) };
    let mut world = World::new(40, budget);
    let replaced = world.add(sized_mesh("first", 6_000), 5.0);
    world.look_at(5.0);
    assert!(world.frames_until_complete(40) < 40);
    for (number, vertices) in [6_500, 4_000, 7_000, 100, 8_000].into_iter().enumerate() {
        world.frames(60);
        assert!(world.statistics().requested > 0, "the budget is full");
        world.scene.replace(replaced, sized_mesh(&number.to_string(), vertices)).unwrap();
        let uploaded = world.statistics().uploaded_bytes;
        let frames = (0..40).take_while(|_| {
            assert_eq!(world.missing(), 0, "{number}");
            world.statistics().wanted + world.statistics().in_flight > 0
        });
        assert!(frames.count() < 40);
        // Small ones are uploaded by the frame, if there is room.
        assert!(vertices < 1_000 || world.statistics().uploaded_bytes - uploaded >= vertices as u64 * 32);
    }
}

#[test]
fn a_mesh_that_is_replaced_in_every_frame_keeps_up() {
    let budget = StreamingBudget { upload_bytes_per_frame: 1 << 20, ..budget(1 << 20) };
    let mut world = World::new(40, budget);
    let replaced = world.add(sized_mesh("first", 6_000), 5.0);
    world.look_at(5.0);
    assert!(world.frames_until_complete(40) < 40);
    world.frames(60);
    let before = world.statistics().uploaded_bytes;
    for frame in 0..30 {
        world.scene.replace(replaced, sized_mesh(&frame.to_string(), 7_000 + frame)).unwrap();
        assert_eq!(world.missing(), 0);
    }
    assert!(world.statistics().uploaded_bytes - before > 10 * 7_000 * 32);
}

#[test]
fn meshes_that_are_replaced_together_do_not_all_arrive_with_the_frame() {
    let budget = StreamingBudget { upload_bytes_per_frame: 1 << 18, ..budget(32 << 20) };
    let mut world = World::new(0, budget);
    let meshes: Vec<_> =
        (0..10).map(|number| world.add(sized_mesh("first", 4_000), f64::from(number) * 0.01)).collect();
    assert!(world.frames_until_complete(40) < 40);
    for mesh in meshes {
        world.scene.replace(mesh, sized_mesh("second", 4_000)).unwrap();
    }
    assert_eq!(world.missing(), 0);
    assert_eq!(world.statistics().requested, 8, "of 10 meshes of 125 KiB each: two fit into 256 KiB");
    assert!(world.frames_until_complete(40) < 40);
}

#[test]
fn a_mesh_that_has_no_room_beside_the_one_it_replaces_takes_its_place() {
    let mut world = World::new(0, budget(StreamingBudget::MIN_BYTES));
    let replaced = world.add(sized_mesh("first", 20_000), 0.0);
    assert!(world.frames_until_complete(40) < 40);
    world.scene.replace(replaced, sized_mesh("second", 25_000)).unwrap();
    world.frame();
    world.frame();
    assert!(world.frames_until_complete(40) < 40);
    assert_eq!((world.statistics().evictions, world.statistics().requested), (1, 0));
}

#[test]
fn a_texture_that_goes_before_it_is_on_the_device_is_told_as_gone() {
    let mut world = World::new(1, budget(8 << 20));
    let texture = Texture::new("gone", 2, 2, vec![255; 16]).unwrap();
    let texture = world.scene.add(texture).unwrap();
    let material = world.scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
    world.scene.add_object(RenderObject::new(world.meshes[0], material, DVec3::ZERO)).unwrap();
    let reasons =
        |world: &mut World| -> Vec<_> { world.frame().0.scene_issues.iter().map(|issue| issue.reason).collect() };
    assert!(reasons(&mut world).contains(&IssueReason::TextureNotResident));
    world.scene.remove(texture).unwrap();
    let after = reasons(&mut world);
    assert!(after.contains(&IssueReason::StaleTexture), "{after:?}");
    assert!(!after.contains(&IssueReason::TextureNotResident), "{after:?}");
}
