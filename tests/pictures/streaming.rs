//! Meshes in pages, textures in arrays that grow, and both streamed: the pictures are those of a new renderer that
//! uploads everything at once.

use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy, StreamingBudget, WgpuBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::process::Deferred;
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::{LevelOfDetail, Material, Mesh, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom::{Renderer, SubmittedFrame};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use drawloom_testing::scenes::leveled::plates;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("meshes_that_come_one_by_one_are_drawn_like_meshes_that_come_at_once", one_by_one),
    ("memory_of_meshes_is_not_written_while_a_recorded_frame_may_read_it", recorded_frames),
    ("memory_of_meshes_and_textures_is_used_again", used_again),
    ("streamed_scenes_look_the_same_once_everything_is_there", streamed),
    ("a_mesh_and_a_texture_larger_than_a_frame_may_upload_arrive_in_parts", parts),
    ("a_streamed_mesh_that_is_replaced_never_vanishes", replaced),
    ("a_mesh_that_is_replaced_while_the_budget_is_full_is_drawn_until_the_next_one_arrives", replaced_when_full),
];

/// Draws with the shipped processes.
fn fixture(backend: WgpuBackend, workers: usize) -> Result<Fixture, Failed> {
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
    let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(workers)?))?;
    Ok(Fixture { renderer, submitter })
}

fn backend(recording: RecordingStrategy) -> Result<WgpuBackend, Failed> {
    let backend = crate::fixture::backend()?.recording_strategy(recording);
    Ok(backend.encoding_strategy(EncodingStrategy::PerPass))
}

/// The pictures of all cameras, drawn by a new renderer.
fn expected(scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let mut fixture = fixture(backend(RecordingStrategy::Direct)?, 2)?;
    let recorded = fixture.record(scene)?;
    pictures(&fixture.submitter.submit(recorded)?, scene)
}

fn pictures(submitted: &SubmittedFrame<WgpuBackend>, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let views = 0..scene.cameras.len();
    views.map(|view| Ok(submitted.submission.read(view, "picture")?)).collect()
}

fn expect_same(found: &[Picture], expected: &[Picture], when: &str) -> Result<(), Failed> {
    match found.iter().zip(expected).position(|(found, expected)| found.bytes != expected.bytes) {
        None => Ok(()),
        Some(view) => Err(format!("{when}: view {view} differs").into()),
    }
}

/// A wavy disc of this number of corners around its centre.
pub fn disc(corners: u32, wave: f32) -> Mesh {
    let corner = |number: u32| {
        let angle = number as f32 / corners as f32 * std::f32::consts::TAU;
        let position = [angle.cos(), angle.sin(), (angle * wave).sin() * 0.1];
        Vertex { position, normal: [0.0, 0.0, 1.0], uv: [angle.cos(), angle.sin()] }
    };
    let center = Vertex { position: [0.0, 0.0, 0.2], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
    let vertices = (0..corners).map(corner).chain([center]).collect();
    let indices = (0..corners).flat_map(|first| [first, (first + 1) % corners, corners]).collect();
    Mesh::new("disc", Topology::TriangleList, vertices, indices).unwrap()
}

fn checker(name: &str, side: u32, color: [u8; 3]) -> Texture {
    let pixel = |index: u32| {
        let is_light = (index % side / 4 + index / side / 4).is_multiple_of(2);
        let [red, green, blue] = color.map(|channel| if is_light { channel } else { channel / 3 });
        [red, green, blue, 255]
    };
    Texture::new(name, side, side, (0..side * side).flat_map(pixel).collect()).unwrap()
}

/// Adds an object at one of 64 places in front of both cameras.
fn add(scene: &mut Scene, place: u32, mesh: Handle<Mesh>, material: Handle<Material>) -> Result<(), Failed> {
    let position = DVec3::new(f64::from(place % 8) * 2.5 - 9.0, f64::from(place / 8) * 2.5 - 9.0, -5.0);
    let object = RenderObject { scale: Vec3::splat(1.2), ..RenderObject::new(mesh, material, position) };
    scene.add_object(object)?;
    Ok(())
}

fn materials(scene: &Scene) -> Vec<Handle<Material>> {
    scene.assets().iter::<Material>().map(|(handle, _)| handle).collect()
}

fn one_by_one() -> Result<(), Failed> {
    let strategies = [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles];
    for recording in strategies {
        let mut fixture = fixture(backend(recording)?, 2)?;
        let mut scene = field(40);
        let used = materials(&scene);
        for place in 0..12 {
            // Some are larger than a page at that time, some have levels, some have triangles culled.
            let mesh = disc([40, 3000, 700][place as usize % 3], place as f32);
            let level = LevelOfDetail::new(mesh.indices()[..60].to_vec(), 0.2);
            let mesh = if place % 2 == 0 { mesh.with_levels([level])? } else { mesh };
            let mesh = scene.add(mesh.with_triangle_culling(place % 5 == 4))?;
            add(&mut scene, place * 5, mesh, used[place as usize % used.len()])?;
            let recorded = fixture.record(&scene)?;
            let submitted = fixture.submitter.submit(recorded)?;
            let when = format!("{recording:?}, {place} meshes");
            expect_same(&pictures(&submitted, &scene)?, &expected(&scene)?, &when)?;
        }
    }
    Ok(())
}

fn recorded_frames() -> Result<(), Failed> {
    let mut fixture = fixture(backend(RecordingStrategy::CachedBundles)?, 2)?;
    let (mut scene, mut waiting) = (field(10), Vec::new());
    let material = materials(&scene)[0];
    let before = fixture.renderer.backend().resources().mesh_bytes;
    for round in 0..12 {
        let mesh = scene.add(disc(500, round as f32))?;
        add(&mut scene, round, mesh, material)?;
        let expected = expected(&scene)?;
        waiting.push((fixture.record(&scene)?, scene.cameras.len(), expected));
        // The mesh is gone before the frame is submitted, and the next one takes its place.
        let object = scene.objects().last().ok_or("an object was added")?;
        scene.remove_object(object)?;
        scene.remove(mesh)?;
        if round % 4 == 3 {
            for (recorded, _, expected) in waiting.drain(..) {
                let submitted = fixture.submitter.submit(recorded)?;
                expect_same(&pictures(&submitted, &scene)?, &expected, &format!("round {round}"))?;
            }
        }
    }
    let grown = fixture.renderer.backend().resources().mesh_bytes - before;
    // Four frames in flight need four discs; twelve would need more than twice as much.
    let disc = 501 * 32 + 1500 * 4;
    if grown > 9 * disc { Err(format!("12 discs of {disc} bytes took {grown}").into()) } else { Ok(()) }
}

fn used_again() -> Result<(), Failed> {
    let mut fixture = fixture(backend(RecordingStrategy::Direct)?, 2)?;
    let mut scene = field(10);
    let mut latest = None;
    for round in 0..40 {
        let texture = scene.add(checker("checker", 64, [200, round * 6, 90]))?;
        let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
        let mesh = scene.add(disc(300 + u32::from(round), 3.0))?;
        add(&mut scene, u32::from(round), mesh, material)?;
        if let Some((mesh, material, texture)) = latest.replace((mesh, material, texture)) {
            let object = scene.objects().nth(scene.object_count() - 2).ok_or("there are more")?;
            scene.remove_object(object)?;
            scene.remove(mesh)?;
            scene.remove::<Material>(material)?;
            scene.remove::<Texture>(texture)?;
        }
        let recorded = fixture.record(&scene)?;
        let submitted = fixture.submitter.submit(recorded)?;
        expect_same(&pictures(&submitted, &scene)?, &expected(&scene)?, &format!("round {round}"))?;
        let resources = fixture.renderer.backend().resources();
        if resources.mesh_bytes > 256 << 10 || resources.texture_bytes > 8 * 350_000 {
            return Err(format!("round {round}: {resources:?}").into());
        }
    }
    Ok(())
}

/// Draws until everything that is used is on the device, and returns the last frame.
fn draw_until_resident(fixture: &mut Fixture, scene: &Scene) -> Result<SubmittedFrame<WgpuBackend>, Failed> {
    for _frame in 0..2000 {
        let recorded = fixture.record(scene)?;
        let submitted = fixture.submitter.submit(recorded)?;
        let statistics = fixture.renderer.backend().streaming_statistics().ok_or("it streams")?;
        if (statistics.requested, statistics.in_flight) == (0, 0) {
            return Ok(submitted);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Err("the scene never is on the device".into())
}

fn streamed_fixture(budget: StreamingBudget, workers: usize) -> Result<Fixture, Failed> {
    fixture(backend(RecordingStrategy::CachedBundles)?.stream_resources(budget)?, workers)
}

fn streamed() -> Result<(), Failed> {
    let mut textured = field(20);
    for place in 0..24 {
        let texture =
            textured.add(checker("checker", [16, 256, 300][place as usize % 3], [255, 9 * place as u8, 40]))?;
        let material = textured.add(Material { texture: Some(texture), ..Material::default() })?;
        let mesh = textured.add(disc(50 + 100 * place, 2.0))?;
        add(&mut textured, place * 2, mesh, material)?;
    }
    let budget = StreamingBudget { upload_bytes_per_frame: 1 << 18, ..StreamingBudget::default() };
    for (name, scene) in [("everything", everything()), ("plates", plates()), ("textured", textured)] {
        for workers in [1, 2] {
            let mut fixture = streamed_fixture(budget, workers)?;
            let recorded = fixture.record(&scene)?;
            let reasons: Vec<_> = recorded.statistics().scene_issues.iter().map(|issue| issue.reason).collect();
            if !reasons.contains(&IssueReason::NotResident) {
                return Err(format!("{name}: the first frame has {reasons:?}").into());
            }
            drop(recorded);
            let submitted = draw_until_resident(&mut fixture, &scene)?;
            let missing = submitted
                .statistics
                .scene_issues
                .iter()
                .any(|issue| [IssueReason::NotResident, IssueReason::TextureNotResident].contains(&issue.reason));
            if missing {
                return Err(format!("{name}: {:?}", submitted.statistics.scene_issues).into());
            }
            expect_same(&pictures(&submitted, &scene)?, &expected(&scene)?, name)?;
        }
    }
    Ok(())
}

fn parts() -> Result<(), Failed> {
    let mut scene = field(20);
    let texture = scene.add(checker("large", 512, [90, 200, 255]))?;
    let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
    let mesh = scene.add(disc(20_000, 9.0))?;
    add(&mut scene, 20, mesh, material)?;
    for vertices in [VertexFormat::Full, VertexFormat::Packed] {
        let upload_bytes_per_frame = StreamingBudget::MIN_UPLOAD_BYTES;
        let mut fixture =
            streamed_fixture(StreamingBudget { upload_bytes_per_frame, ..StreamingBudget::default() }, 1)?;
        let quality = Quality { vertices, ..Quality::default() };
        fixture.renderer.set_quality(quality)?;
        let mut uploaded = 0;
        for _frame in 0..200 {
            let recorded = fixture.record(&scene)?;
            fixture.submitter.submit(recorded)?;
            let statistics = fixture.renderer.backend().streaming_statistics().ok_or("it streams")?;
            let in_frame = statistics.uploaded_bytes - uploaded;
            if in_frame > upload_bytes_per_frame {
                return Err(format!("a frame uploaded {in_frame} bytes").into());
            }
            uploaded = statistics.uploaded_bytes;
        }
        if uploaded < 20 * upload_bytes_per_frame {
            return Err(format!("200 frames uploaded {uploaded} bytes").into());
        }
        let submitted = draw_until_resident(&mut fixture, &scene)?;
        let mut plain = self::fixture(backend(RecordingStrategy::Direct)?, 1)?;
        plain.renderer.set_quality(quality)?;
        let recorded = plain.record(&scene)?;
        let expected = pictures(&plain.submitter.submit(recorded)?, &scene)?;
        expect_same(&pictures(&submitted, &scene)?, &expected, &format!("{vertices:?}"))?;
    }
    Ok(())
}

fn replaced() -> Result<(), Failed> {
    let mut scene = field(20);
    let texture = scene.add(checker("first", 64, [255, 200, 20]))?;
    let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
    let mesh = scene.add(disc(100, 1.0))?;
    add(&mut scene, 20, mesh, material)?;
    let mut fixture = streamed_fixture(StreamingBudget::default(), 2)?;
    draw_until_resident(&mut fixture, &scene)?;
    for round in 2..6 {
        scene.replace(mesh, disc(100 * round, round as f32))?;
        let recorded = fixture.record(&scene)?;
        let submitted = fixture.submitter.submit(recorded)?;
        expect_same(&pictures(&submitted, &scene)?, &expected(&scene)?, &format!("mesh {round}"))?;
        scene.replace(texture, checker("next", 64, [20, 40 * round as u8, 200]))?;
        let recorded = fixture.record(&scene)?;
        if recorded.statistics().scene_issues.iter().any(|found| found.reason == IssueReason::TextureNotResident) {
            return Err("the texture before is drawn until the new one arrives".into());
        }
        fixture.submitter.submit(recorded)?;
        let submitted = draw_until_resident(&mut fixture, &scene)?;
        expect_same(&pictures(&submitted, &scene)?, &expected(&scene)?, &format!("texture {round}"))?;
    }
    Ok(())
}

/// Meshes with and without levels and triangle culling replace each other. The one before is drawn with what it has.
fn replaced_when_full() -> Result<(), Failed> {
    let mut scene = field(2);
    let material = materials(&scene)[0];
    let empty = expected(&scene)?;
    let variant = |number: u32| {
        let mesh = disc(3000 + number, 1.0);
        let level = LevelOfDetail::new(mesh.indices()[..6000].to_vec(), 1e-9);
        let mesh = if number.is_multiple_of(2) { mesh.with_levels([level])? } else { mesh };
        Ok::<_, Failed>(mesh.with_triangle_culling(number.is_multiple_of(3)))
    };
    let mesh = scene.add(variant(0)?)?;
    add(&mut scene, 20, mesh, material)?;
    // Out of sight, and more than the budget.
    for number in 0..10 {
        let filler = scene.add(disc(3000, number as f32))?;
        scene.add_object(RenderObject::new(filler, material, DVec3::Y * -1e6))?;
    }
    let budget = StreamingBudget {
        mesh_bytes: StreamingBudget::MIN_BYTES,
        upload_bytes_per_frame: StreamingBudget::MIN_UPLOAD_BYTES,
        ..StreamingBudget::default()
    };
    let mut fixture = streamed_fixture(budget, 1)?;
    let mut frame = |scene: &Scene| -> Result<_, Failed> {
        let recorded = fixture.record(scene)?;
        let submitted = fixture.submitter.submit(recorded)?;
        let is_missing = submitted.statistics.scene_issues.iter().any(|told| told.reason == IssueReason::NotResident);
        let statistics = fixture.renderer.backend().streaming_statistics().ok_or("it streams")?;
        Ok((pictures(&submitted, scene)?, is_missing, statistics))
    };
    for _frame in 0..40 {
        frame(&scene)?;
    }
    for number in 1..7 {
        scene.replace(mesh, variant(number)?)?;
        let mut waited = 0;
        for _frame in 0..30 {
            let (found, is_missing, statistics) = frame(&scene)?;
            if is_missing || found.iter().zip(&empty).all(|(found, empty)| found.bytes == empty.bytes) {
                return Err(format!("mesh {number} vanishes: {statistics:?}").into());
            }
            waited += usize::from(statistics.wanted > 0 || statistics.in_flight > 0);
        }
        let (found, _, statistics) = frame(&scene)?;
        if waited == 0 || statistics.requested == 0 {
            return Err(format!("mesh {number}: the budget is not full: {statistics:?}").into());
        }
        expect_same(&found, &expected(&scene)?, &format!("mesh {number}"))?;
    }
    Ok(())
}
