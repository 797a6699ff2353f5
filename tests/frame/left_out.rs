//! What a backend has no room for is warned of by name, once.

use std::sync::Arc;

use drawloom::Renderer;
#[cfg(feature = "wgpu")]
use drawloom::backend::{BackendError, WgpuBackend};
use drawloom::backend::{NullBackend, SceneLimits};
#[cfg(feature = "wgpu")]
use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
#[cfg(feature = "wgpu")]
use drawloom::process::{CommandDraws, Declare, Draws, RenderProcess, StorageBuffer};
use drawloom::quality::{Quality, RadianceSum};
#[cfg(feature = "wgpu")]
use drawloom::scene::SceneRef;
use drawloom::scene::{Blend, Material, Mesh, RenderObject, Scene, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
#[cfg(feature = "wgpu")]
use drawloom_testing::adapter;
use drawloom_testing::limited::LimitedBackend;
use drawloom_testing::scenes::field;

use crate::reported;

/// Room for 128 vertices in a buffer, and for 64 objects.
const LIMITS: SceneLimits = SceneLimits { buffer_bytes: 4096, binding_bytes: 4096, ..SceneLimits::NONE };

fn mesh(name: &str, vertices: usize) -> Mesh {
    Mesh::new(name, Topology::TriangleList, vec![Vertex::default(); vertices], vec![0, 1, 2]).unwrap()
}

fn add(scene: &mut Scene, mesh: Mesh) {
    let mesh = scene.add(mesh).unwrap();
    let material = scene.as_scene_ref().materials[0];
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
}

#[test]
fn each_mesh_without_room_is_told_once_with_its_name_and_the_limit() {
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(LimitedBackend::new(NullBackend, LIMITS)).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let mut frames = |scene: &Scene| {
        for _ in 0..3 {
            submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        }
    };
    let mut scene = field(10);
    let told = reported(|| frames(&scene));
    assert!(!told.contains("WARN"), "{told}");
    add(&mut scene, mesh("statue", 129));
    add(&mut scene, mesh("pillar", 128));
    let told = reported(|| frames(&scene));
    for part in ["\"statue\"", "max_limited is 4096", "needs 4128", "count=1", "first=10"] {
        assert!(told.contains(part), "{told}");
    }
    assert!(!told.contains("pillar") && told.matches("WARN").count() == 2, "the mesh, and its object: {told}");
    // A second one is told of, and the first one is not told again.
    add(&mut scene, mesh("line\nfeed \u{1b}[31m", 200));
    let told = reported(|| frames(&scene));
    assert!(told.contains(r#""line\nfeed \u{1b}[31m""#), "names are escaped: {told}");
    assert_eq!(told.matches("objects with this mesh are left out").count(), 1, "{told}");
    assert!(told.contains("count=2"), "{told}");
    // A mesh that no object has is told of as well: it is never uploaded, and never asked for again.
    scene.add(mesh("spare", 300)).unwrap();
    let told = reported(|| frames(&scene));
    assert!(told.contains("\"spare\"") && told.matches("WARN").count() == 1, "{told}");
}

#[test]
fn another_backend_is_asked_anew() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let backend = |limits| LimitedBackend::new(NullBackend, limits);
    let builder = Renderer::builder(backend(LIMITS)).pipeline(Deferred::to_picture());
    let (mut renderer, mut submitter) = builder.build(scheduler).unwrap();
    let mut scene = field(70);
    add(&mut scene, mesh("statue", 129));
    let room_for_more = SceneLimits { binding_bytes: 1 << 20, ..LIMITS };
    for (limits, expected) in
        [(LIMITS, (7, 64)), (room_for_more, (1, 70)), (SceneLimits::NONE, (0, 0)), (LIMITS, (7, 64))]
    {
        submitter = renderer.replace_backend(backend(limits));
        for _ in 0..2 {
            let statistics = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap().statistics;
            let found = statistics.scene_issues.first().map_or((0, 0), |known| (known.count, known.first));
            assert_eq!(found, expected, "{limits:?}: {:?}", statistics.scene_issues);
        }
    }
    drop(submitter);
}

#[test]
fn an_object_without_room_is_not_counted_as_drawn_in_half_floats() {
    let backend = LimitedBackend::new(NullBackend, LIMITS).without_float_blending();
    let quality = Quality { radiance_sum: RadianceSum::Float, ..Quality::balanced() };
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let mut scene = field(70);
    let stone = scene.as_scene_ref().materials[0];
    let glass = scene.add(Material { blend: Blend::Alpha, ..Material::default() }).unwrap();
    let handles: Vec<_> = scene.objects().collect();
    let (last, first_without_room) = (63, 64);
    for blended in [&[69][..], &[69, 3], &[3], &[69, last], &[first_without_room], &[5, 66], &[]] {
        for (object, handle) in handles.iter().enumerate() {
            let material = if blended.contains(&object) { glass } else { stone };
            let object = scene.object(*handle).unwrap();
            scene.replace_object(*handle, RenderObject { material, ..object }).unwrap();
        }
        let statistics = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap().statistics;
        let counted = |reason| statistics.scene_issues.iter().find(|issue| issue.reason == reason);
        assert_eq!(counted(IssueReason::ObjectLimit).map(|found| (found.count, found.first)), Some((6, 64)));
        let expected = blended.iter().copied().find(|object| *object < first_without_room).map(|first| (1, first));
        let found = counted(IssueReason::HalfFloatBlending).map(|found| (found.count, found.first));
        assert_eq!(found, expected, "{blended:?}");
    }
}

/// In the place of transparency: its buffer is larger than any of the noop device.
#[cfg(feature = "wgpu")]
struct TooMuch;

#[cfg(feature = "wgpu")]
impl RenderProcess for TooMuch {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.tests_depth("depth");
        declare.changes_buffer(HUGE);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(0) var<storage, read_write> huge: array<vec4<f32>>;
            @vertex fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> { return vec4<f32>(in.position, 1.0); }
            @fragment fn fragment() -> @location(0) vec4<f32> { return huge[0]; }
        ";
        Draws::Commands(CommandDraws { shader, selection: Selection::BLENDED, ..CommandDraws::default() })
    }
}

#[cfg(feature = "wgpu")]
const HUGE: StorageBuffer<[f32; 4]> = StorageBuffer::new("huge", 1 << 27);

#[cfg(feature = "wgpu")]
#[test]
fn a_frame_that_a_limit_refuses_does_not_cost_the_meshes_on_the_device() {
    let (device, queue) = adapter::noop_device().unwrap();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap());
    let builder = builder.pipeline(Deferred::to_picture().replace("transparency", TooMuch));
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let mut scene = field(50);
    add(&mut scene, mesh("statue", 100_000));
    let mesh_bytes = 100_000 * size_of::<Vertex>() as u64;
    let [opaque, blended] = [0, 2].map(|object| scene.as_scene_ref().materials[object]);
    let materials = |is_blended: bool| {
        let blended_object = |object: usize| is_blended && object == 3;
        (0..51).map(|object| if blended_object(object) { blended } else { opaque }).collect::<Vec<_>>()
    };
    let [only_opaque, with_blended] = [false, true].map(materials);
    let uploaded: Vec<_> = [&only_opaque, &with_blended, &only_opaque, &with_blended, &only_opaque]
        .into_iter()
        .filter_map(|materials| {
            let recorded = renderer.record(SceneRef { materials, ..scene.as_scene_ref() });
            let is_refused = std::ptr::eq(materials, &with_blended);
            match recorded {
                Ok(recorded) => {
                    assert!(!is_refused);
                    Some(submitter.submit(recorded).unwrap().statistics.uploaded)
                }
                Err(error) => {
                    assert!(is_refused && matches!(error.backend_error(), Some(BackendError::Limit { .. })), "{error}");
                    None
                }
            }
        })
        .collect();
    assert!(uploaded[0] >= mesh_bytes && uploaded[1..].iter().all(|later| *later < mesh_bytes), "{uploaded:?}");
}
