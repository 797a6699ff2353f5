//! The number of bytes that a frame uploads, on wgpu's noop backend.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::{Changes, Mesh, Scene, SceneRef, StaticGroup, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::view::internal::GpuObject;
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use drawloom_testing::tinted::TINT;

#[test]
fn statistics_and_timeline_report_the_uploaded_bytes() {
    let (device, queue) = adapter::noop_device().unwrap();
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(Arc::clone(&scheduler)).unwrap();
    let scene = field(600);
    scheduler.timeline().start();
    let mut uploaded = Vec::new();
    for _ in 0..4 {
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        uploaded.push(submitted.statistics);
    }
    let mut used: Vec<_> = scene.as_scene_ref().meshes.to_vec();
    used.sort_unstable_by_key(|mesh| mesh.index());
    used.dedup();
    let meshes = used.into_iter().map(|mesh| scene.assets().get(mesh).unwrap());
    let meshes: usize = meshes.map(|mesh| size_of_val(mesh.vertices()) + size_of_val(mesh.indices())).sum();
    for (frame, statistics) in uploaded.iter().enumerate() {
        // Nothing is known of what changed, so all objects are uploaded. The same objects are seen, so only blended
        // ones may have another order, and only the first frame uploads a four-byte index of every command.
        let commands: usize = statistics.views.iter().map(|view| view.commands).sum();
        let (objects, indices) = ((600 * size_of::<GpuObject>()) as u64, (commands * 4) as u64);
        let [least, most] =
            if frame == 0 { [objects + indices + meshes as u64, u64::MAX] } else { [objects, objects + indices] };
        assert!((least..=most).contains(&statistics.uploaded), "frame {frame}: {}", statistics.uploaded);
    }
    let still = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
    let submitted = submitter.submit(renderer.record(still).unwrap()).unwrap();
    assert_eq!(submitted.statistics.uploaded, 0, "a frame in which nothing changed");
    uploaded.push(submitted.statistics);
    let log = scheduler.timeline().take();
    let counted: Vec<_> = log.counters.iter().map(|counter| (counter.name.as_str(), counter.value)).collect();
    let expected: Vec<_> = uploaded.iter().map(|statistics| ("bytes uploaded", statistics.uploaded as f64)).collect();
    assert_eq!(counted, expected);
}

#[test]
fn a_frame_beside_another_one_in_flight_uploads_all_objects() {
    let (device, queue) = adapter::noop_device().unwrap();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let scene = field(600);
    let mut record = |changes| renderer.record(SceneRef { changes, ..scene.as_scene_ref() }).unwrap();
    let in_flight = [record(Changes::Unknown), record(Changes::NONE), record(Changes::NONE)];
    let objects = (600 * size_of::<GpuObject>()) as u64;
    let uploaded = in_flight.each_ref().map(|frame| frame.statistics().uploaded);
    assert!(uploaded.iter().all(|uploaded| *uploaded >= objects), "{uploaded:?}");
}

#[test]
fn objects_of_static_groups_are_uploaded_once() {
    let (device, queue) = adapter::noop_device().unwrap();
    let backend = WgpuBackend::new(device, queue).unwrap();
    let quality = Quality { occlusion: None, ..Quality::balanced() };
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let scene = field(600);
    let static_groups = [StaticGroup::new("left", (0..200).collect()), StaticGroup::new("right", (200..600).collect())];
    let mut draw = |changes| {
        let lent = SceneRef { changes, static_groups: &static_groups, ..scene.as_scene_ref() };
        let statistics = submitter.submit(renderer.record(lent).unwrap()).unwrap().statistics;
        (statistics.views.iter().map(|view| view.static_groups).sum::<usize>(), statistics.uploaded)
    };
    draw(Changes::Unknown);
    // The frame that records them.
    draw(Changes::NONE);
    let (executed, uploaded) = draw(Changes::NONE);
    assert!(executed > 0 && uploaded > 0, "{executed} static groups, {uploaded} bytes");
    for _ in 0..3 {
        assert_eq!(draw(Changes::NONE), (executed, 0));
    }
}

/// Draws depth, and may declare that it reads the column `tint`.
struct DepthOnly {
    reads_column: bool,
}

impl RenderProcess for DepthOnly {
    fn name(&self) -> &str {
        "depth only"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("depth only", Format::Depth32Float);
        if self.reads_column {
            declare.reads_column(TINT);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @vertex
            fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
                return clip_position(relative_position(drawn_object(in.instance), in.position));
            }
        ";
        Draws::Commands(CommandDraws { shader, fragment: None, ..CommandDraws::default() })
    }
}

#[test]
fn a_column_is_uploaded_where_objects_changed_and_only_if_a_process_reads_it() {
    let scene = field(600);
    let tints = vec![[0.5_f32; 4]; 600];
    let columns = [TINT.values(&tints)];
    let uploads = |reads_column: bool| {
        let (device, queue) = adapter::noop_device().unwrap();
        let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap());
        let builder = builder.process(DepthOnly { reads_column }).output("depth only");
        let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
        let mut uploaded = |changes| {
            let lent = SceneRef { columns: &columns, changes, ..scene.as_scene_ref() };
            submitter.submit(renderer.record(lent).unwrap()).unwrap().statistics.uploaded
        };
        // By the third frame all lists are kept, and the buffers hold everything.
        let before = [Changes::Unknown; 3].map(&mut uploaded);
        assert!(before[0] > before[2]);
        [Changes::NONE, Changes::Objects(&[7, 300]), Changes::Unknown].map(uploaded)
    };
    let (with, without) = (uploads(true), uploads(false));
    let differences = [with[0] - without[0], with[1] - without[1], with[2] - without[2]];
    assert_eq!(differences, [0, 2 * 16, 600 * 16]);
}

/// A mesh whose vertices fill this many bytes.
fn mesh_of(bytes: usize) -> Mesh {
    let vertex = |index| Vertex { position: [index as f32 * 0.01, 0.0, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
    let vertices = (0..bytes / size_of::<Vertex>()).map(vertex).collect();
    Mesh::new("large", Topology::TriangleList, vertices, vec![0, 1, 2]).unwrap()
}

#[test]
fn a_mesh_is_uploaded_in_the_first_frame_in_which_an_object_has_it() {
    let new_renderer = || {
        let (device, queue) = adapter::noop_device().unwrap();
        let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).pipeline(Deferred::to_picture());
        builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap()
    };
    // More than everything else of the scene takes; the second even packed.
    let (large, huge) = (1 << 20, 16 << 20);
    let mut scene = field(600);
    let mut meshes = scene.as_scene_ref().meshes.to_vec();
    let (small, large_mesh, huge_mesh) =
        (meshes[5], scene.add(mesh_of(large)).unwrap(), scene.add(mesh_of(huge)).unwrap());
    let (mut renderer, submitter) = new_renderer();
    let mut uploaded = |scene: &Scene, meshes: &[_], quality: Option<Quality>, changes| {
        quality.into_iter().for_each(|quality| renderer.set_quality(quality).unwrap());
        let lent = SceneRef { meshes, changes, ..scene.as_scene_ref() };
        submitter.submit(renderer.record(lent).unwrap()).unwrap().statistics.uploaded as usize
    };
    // Both are unused.
    let (mut plain, plain_submitter) = new_renderer();
    let without = plain_submitter.submit(plain.record(field(600).as_scene_ref()).unwrap()).unwrap();
    assert_eq!(uploaded(&scene, &meshes, None, Changes::Unknown), without.statistics.uploaded as usize);
    (0..3).for_each(|_| assert!(uploaded(&scene, &meshes, None, Changes::Unknown) < large));
    scene.replace(large_mesh, mesh_of(large)).unwrap();
    assert!(uploaded(&scene, &meshes, None, Changes::NONE) < large);
    // One is used.
    meshes[5] = large_mesh;
    let first = uploaded(&scene, &meshes, None, Changes::Objects(&[5]));
    assert!((large..huge / 4).contains(&first), "{first}");
    // It remains on the device when the object has another one.
    for mesh in [small, large_mesh, small] {
        meshes[5] = mesh;
        assert!(uploaded(&scene, &meshes, None, Changes::Objects(&[5])) < large);
    }
    scene.replace(large_mesh, mesh_of(large)).unwrap();
    let changed = uploaded(&scene, &meshes, None, Changes::NONE);
    assert!((large..huge / 4).contains(&changed), "{changed}");
    // Vertices of another format move to new buffers, those of the unused mesh not among them.
    let packed = Quality { vertices: VertexFormat::Packed, ..Quality::default() };
    let moved = uploaded(&scene, &meshes, Some(packed), Changes::NONE);
    assert!((large / 4..huge / 4).contains(&moved), "{moved}");
    // The other one is, in a frame that is told nothing, and in one that is.
    let before = meshes.clone();
    meshes[599] = huge_mesh;
    let second = uploaded(&scene, &meshes, None, Changes::Unknown);
    assert!(second >= huge / 4, "{second}");
    assert!(uploaded(&scene, &before, None, Changes::Objects(&[599])) < large);
    // A removed mesh leaves its slot to another one, which is unused.
    scene.remove(huge_mesh).unwrap();
    let other = scene.add(mesh_of(huge)).unwrap();
    assert_eq!(other.index(), huge_mesh.index());
    assert!(uploaded(&scene, &before, None, Changes::NONE) < large);
    meshes[599] = other;
    assert!(uploaded(&scene, &meshes, None, Changes::Ranges(&[3..4, 590..600])) >= huge / 4);
}
