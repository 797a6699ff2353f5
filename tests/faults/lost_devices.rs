//! Devices of wgpu are lost, at any call of a frame and with frames in flight, and others take their place.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{BackendError, WgpuBackend, WgpuSubmission};
use drawloom::glam::Vec3;
use drawloom::process::Deferred;
use drawloom::scene::{
    Changes, IndexBuffer, Mesh, MeshBuffers, Scene, StreamAttribute, StreamLayout, Topology, VertexStream,
};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::wgpu::util::DeviceExt;
use drawloom::{FrameError, Renderer, SubmitError, Submitter, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::Case;
use crate::calls::expect;
use crate::fixture::{Fixture, Refusal, Setting, two_scenes};

pub const CASES: &[Case] = &[
    ("a_device_of_noop_that_is_lost_in_any_call_is_told", lost_in_any_call_of_noop),
    ("frames_of_noop_in_flight_are_lost_with_their_device_and_no_others", || in_flight(&adapter::noop_device)),
];

pub const CASES_OF_ADAPTERS: &[Case] = &[
    ("a_device_that_is_lost_in_any_kind_of_call_is_told_and_the_next_one_draws_the_same", lost_in_any_kind_of_call),
    ("frames_in_flight_are_lost_with_their_device_and_no_others", || in_flight(&adapter::device)),
    ("meshes_in_buffers_of_the_lost_device_are_named_until_the_engine_replaces_them", meshes_in_buffers),
    ("a_wait_that_is_too_short_says_so_and_the_next_one_succeeds", timeout),
];

type OpenDevice = dyn Fn() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>>;

fn open(open_device: &OpenDevice) -> Result<(WgpuBackend, wgpu::Device), Failed> {
    let (device, queue) = open_device().map_err(|error| error.to_string())?;
    Ok((WgpuBackend::new(device.clone(), queue)?, device))
}

fn is_loss(error: Option<&BackendError>) -> bool {
    matches!(error, Some(BackendError::DeviceLost { .. }))
}

fn lost_in_any_call_of_noop() -> Result<(), Failed> {
    for joins_passes in [false, true] {
        lost_in_calls(&adapter::noop_device, Setting { joins_passes, ..Setting::FULL }, &|_| true)?;
    }
    Ok(())
}

fn lost_in_any_kind_of_call() -> Result<(), Failed> {
    lost_in_calls(&adapter::device, Setting::FULL, &|index| index == 0 || index == 5)
}

/// Loses a device at each call that is chosen by its index. Each time another device takes its place.
fn lost_in_calls(open_device: &OpenDevice, setting: Setting, is_chosen: &dyn Fn(usize) -> bool) -> Result<(), Failed> {
    let (scenes, moved) = two_scenes()?;
    let scheduler = Arc::new(Scheduler::new(setting.workers)?);
    let mut expected = Vec::new();
    let (backend, mut device) = open(open_device)?;
    let mut fixture = Fixture::on(backend, Arc::clone(&scheduler), setting)?;
    for scene in &scenes {
        expected.push(fixture.picture(scene, Changes::Unknown)?);
    }
    let mut turn = 0;
    for kind in CallKind::ALL {
        fixture.renderer.backend().clear();
        fixture.picture(&scenes[(turn + 1) % 2], Changes::Objects(&moved))?;
        let calls = fixture.renderer.backend().calls(kind);
        for index in (0..calls).filter(|index| is_chosen(*index)) {
            let (scene, expected) = (&scenes[turn % 2], &expected[turn % 2]);
            turn += 1;
            let lose = device.clone();
            fixture.renderer.backend().inject(kind, index, Fault::After(Arc::new(move || lose.destroy())));
            let refusal = fixture.draw(scene, Changes::Objects(&moved))?.err();
            let error = match &refusal {
                Some(Refusal::Frame(error)) => error.backend_error(),
                Some(Refusal::Submission(error)) => error.backend_error(),
                None => None,
            };
            expect(is_loss(error), || format!("{kind:?} {index}: {refusal:?}"))?;
            let again = fixture.draw(scene, Changes::NONE)?.err();
            let is_told = matches!(&again, Some(Refusal::Frame(error)) if is_loss(error.backend_error()));
            expect(is_told, || format!("{kind:?} {index}, then: {again:?}"))?;

            let backend;
            (backend, device) = open(open_device)?;
            let backend = FaultyBackend::new(backend);
            let backend = if setting.joins_passes { backend.joining_passes() } else { backend };
            fixture.submitter = fixture.renderer.replace_backend(backend);
            let picture = fixture.picture(scene, Changes::NONE)?;
            expect(picture == *expected, || format!("{kind:?} {index}: the next picture is another one"))?;
        }
    }
    Ok(())
}

type WgpuRenderer = (Renderer<WgpuBackend>, Submitter<WgpuBackend>);

fn renderer_on(backend: WgpuBackend) -> Result<WgpuRenderer, Failed> {
    Ok(Renderer::builder(backend).pipeline(Deferred::to_picture()).build(Arc::new(Scheduler::new(2)?))?)
}

fn draw((renderer, submitter): &mut WgpuRenderer, scene: &Scene) -> Result<WgpuSubmission, Failed> {
    Ok(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission)
}

fn in_flight(open_device: &OpenDevice) -> Result<(), Failed> {
    let scene = everything();
    let (backend, device) = open(open_device)?;
    let mut renderer = renderer_on(backend)?;
    let drawn = draw(&mut renderer, &scene)?;
    drawn.wait()?;
    let read_back_of = |renderer: &mut WgpuRenderer| -> Result<_, Failed> {
        let mut recorded = renderer.0.record(scene.as_scene_ref())?;
        let read_back = recorded.read_back(0, "picture", [0, 0], [4, 4])?;
        Ok((recorded, read_back))
    };
    let (recorded, read_of_drawn) = read_back_of(&mut renderer)?;
    renderer.1.submit(recorded)?.submission.wait()?;
    read_of_drawn.read()?;
    let (in_flight, read_of_lost) = read_back_of(&mut renderer)?;
    device.destroy();

    let refused = renderer.1.submit(in_flight).err();
    let is_told = matches!(&refused, Some(error @ SubmitError::Backend(_)) if is_loss(error.backend_error()));
    expect(is_told, || format!("submitted to a lost device: {refused:?}"))?;
    // Its frame was refused, so nobody has submitted it.
    let read = read_of_lost.read();
    expect(matches!(read, Err(BackendError::NotSubmitted | BackendError::DeviceLost { .. })), || format!("{read:?}"))?;
    drawn.wait().map_err(|error| format!("a frame that was drawn before: {error}"))?;
    let read = drawn.read(0, "picture");
    expect(is_loss(read.as_ref().err()), || format!("the targets of a lost device are read: {read:?}"))?;
    match renderer.0.record(scene.as_scene_ref()).err() {
        Some(error @ FrameError::Backend(_)) if is_loss(error.backend_error()) => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

/// The mesh in buffers of a device.
fn in_buffers(device: &wgpu::Device, mesh: &Mesh) -> Result<Mesh, Failed> {
    let buffer = |contents: &[u8], usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    let stream = |bytes: &[u8], attribute, stride| VertexStream {
        buffer: buffer(bytes, wgpu::BufferUsages::VERTEX),
        offset: 0,
        layout: StreamLayout { stride, attributes: vec![attribute] },
    };
    let positions: Vec<_> = mesh.vertices().iter().map(|vertex| vertex.position).collect();
    let normals: Vec<_> = mesh.vertices().iter().map(|vertex| vertex.normal).collect();
    let uvs: Vec<_> = mesh.vertices().iter().map(|vertex| vertex.uv).collect();
    let streams = vec![
        stream(bytemuck::cast_slice(&positions), StreamAttribute::position(wgpu::VertexFormat::Float32x3, 0), 12),
        stream(bytemuck::cast_slice(&normals), StreamAttribute::normal(wgpu::VertexFormat::Float32x3, 0), 12),
        stream(bytemuck::cast_slice(&uvs), StreamAttribute::uv(wgpu::VertexFormat::Float32x2, 0), 8),
    ];
    let indices: Vec<u32> = mesh.triangles().flatten().collect();
    let indices = IndexBuffer {
        buffer: buffer(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
        offset: 0,
        format: wgpu::IndexFormat::Uint32,
        count: indices.len() as u32,
    };
    let buffers = MeshBuffers { streams, vertex_count: positions.len() as u32, indices: Some(indices) };
    let box_of = |combine: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().map(Vec3::from).reduce(combine);
    let bounds = [box_of(Vec3::min), box_of(Vec3::max)].map(Option::unwrap_or_default);
    Ok(Mesh::from_buffers(mesh.name(), Topology::TriangleList, bounds, buffers)?)
}

fn meshes_in_buffers() -> Result<(), Failed> {
    let [first, second] = adapter::two_devices().map_err(|error| error.to_string())?;
    let mut scene = everything();
    let original: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
    let (handle, mesh) = original.last().ok_or("the scene has no meshes")?;
    scene.replace(*handle, in_buffers(&first.0, mesh)?)?;
    let mut renderer = renderer_on(WgpuBackend::new(first.0.clone(), first.1)?)?;
    let expected = draw(&mut renderer, &scene)?.read(0, "picture")?;

    first.0.destroy();
    renderer.1 = renderer.0.replace_backend(WgpuBackend::new(second.0.clone(), second.1)?);
    for _ in 0..2 {
        let recorded = renderer.0.record(scene.as_scene_ref())?;
        let found = &recorded.statistics().scene_issues;
        let is_it = |known: &SceneIssue| {
            (known.reason, known.name.as_deref()) == (IssueReason::UndrawableMesh, Some(mesh.name()))
        };
        expect(found.iter().any(is_it), || format!("{found:?}"))?;
        renderer.1.submit(recorded)?;
    }
    scene.replace(*handle, in_buffers(&second.0, mesh)?)?;
    let picture = draw(&mut renderer, &scene)?.read(0, "picture")?;
    expect(picture == expected, || "the next picture is another one".to_owned())
}

fn timeout() -> Result<(), Failed> {
    let (backend, _) = open(&adapter::device)?;
    let mut renderer = renderer_on(backend)?;
    let mut scene = everything();
    // A device takes longer for it than a thread takes to ask.
    scene.cameras[0].size = [1024, 768];
    for _ in 0..10 {
        let submission = draw(&mut renderer, &scene)?;
        match submission.wait_timeout(Duration::ZERO) {
            Err(BackendError::Timeout { timeout: Duration::ZERO }) => {
                submission.wait()?;
                return Ok(submission.wait_timeout(Duration::ZERO)?);
            }
            // A thread may stand still for as long as the device draws.
            Ok(()) => {}
            Err(other) => return Err(other.into()),
        }
    }
    Err("no wait is ever too short".into())
}
