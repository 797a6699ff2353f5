//! The number of bytes that a frame uploads, on wgpu's noop backend.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::scene::{Changes, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::GpuObject;
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use drawloom_testing::tinted::TINT;

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
