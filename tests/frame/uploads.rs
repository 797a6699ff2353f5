//! The number of bytes that a frame uploads, on wgpu's noop backend.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::process::Deferred;
use drawloom::scene::{Changes, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::GpuObject;
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;

#[test]
fn statistics_and_timeline_report_the_uploaded_bytes() {
    let (device, queue) = adapter::noop_device().unwrap();
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap()).deferred(Deferred::to_picture());
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
        // Nothing is known of what changed, so all objects are uploaded. The same objects are seen, so only blended ones may have
        // another order, and only the first frame uploads a four-byte index of every command.
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
