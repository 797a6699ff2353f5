//! Data of the engine's own for each object.

use std::sync::Arc;

use drawloom::backend::{Backend, SoftwareBackend, WgpuBackend, WgpuSubmission};
use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, RenderProcess};
use drawloom::scene::{Blend, Camera, Changes, Material, RenderObject, Scene, SceneRef, Topology};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::adapter;
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::scenes::{sized, square};
use drawloom_testing::tinted::{TINT, Tinted};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] = &[
    ("shaders_read_a_column_by_object", by_object),
    ("a_process_that_begins_to_read_a_column_reads_what_changed_before", read_later),
    ("software_reads_columns_as_wgpu_does", as_wgpu),
    ("a_device_without_room_for_a_column_is_refused_by_name", too_few_buffers),
];

fn tinted<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    builder.process(Tinted).output("tinted")
}

/// Two squares side by side.
fn squares() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [64, 32])];
    let (mesh, material) = (scene.add(square(Topology::TriangleList))?, scene.add(Material::default())?);
    for x in [-2.0, 2.0] {
        scene.add_object(RenderObject::new(mesh, material, DVec3::X * x))?;
    }
    Ok(scene)
}

fn by_object() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, tinted)?;
    let scene = squares()?;
    let colors = |submission: WgpuSubmission| {
        let picture = submission.read(0, "tinted")?;
        Ok::<_, Failed>([pixel(&picture, 20, 16), pixel(&picture, 44, 16)])
    };
    let mut tints = [[1.0, 0.5, 0.25, 1.0], [0.0, 1.0, 0.75, 1.0]];
    let recorded = fixture.renderer.record(SceneRef { columns: &[TINT.values(&tints)], ..scene.as_scene_ref() })?;
    let [left, right] = colors(fixture.submit(recorded)?)?;
    assert_color(left, [255, 128, 64])?;
    assert_color(right, [0, 255, 191])?;
    tints[1] = [1.0, 1.0, 1.0, 1.0];
    let (columns, changes) = ([TINT.values(&tints)], Changes::Objects(&[1]));
    let recorded = fixture.renderer.record(SceneRef { columns: &columns, changes, ..scene.as_scene_ref() })?;
    let [left, right] = colors(fixture.submit(recorded)?)?;
    assert_color(left, [255, 128, 64])?;
    assert_color(right, [255, 255, 255])
}

/// Draws blended objects in their tints. The plan has it only while an object is blended.
struct TintedTransparency;

impl RenderProcess for TintedTransparency {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.tests_depth("depth");
        declare.reads_column(TINT);
    }

    fn draws(&self) -> Draws<'_> {
        let Draws::Commands(draws) = Tinted.draws() else { unreachable!("it draws objects") };
        Draws::Commands(CommandDraws { selection: Selection::BLENDED, writes_depth: false, ..draws })
    }
}

fn read_later() -> Result<(), Failed> {
    let with_transparency = |builder: RendererBuilder<WgpuBackend>| {
        builder.pipeline(Deferred::to_picture().replace("transparency", TintedTransparency))
    };
    let mut scene = squares()?;
    let blended = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() })?;
    let opaque = scene.as_scene_ref().materials[0];
    let mut fixture = Fixture::with(2, with_transparency)?;
    let mut tints = [[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.5]];
    let frames = [[blended; 2], [opaque; 2], [blended; 2]];
    for (frame, materials) in frames.iter().enumerate() {
        // While nothing reads the column, it changes.
        tints[0] = [1.0, 0.0, frame.min(1) as f32, 0.5];
        let (columns, changes) = ([TINT.values(&tints)], Changes::Objects(&[0, 1]));
        let changes = if frame == 2 { Changes::Objects(&[1]) } else { changes };
        let materials = if frame == 2 { &[opaque, blended] } else { materials };
        let lent = SceneRef { columns: &columns, changes, materials, ..scene.as_scene_ref() };
        let found = fixture.renderer.record(lent)?;
        let found = fixture.submit(found)?.read(0, "picture")?;
        let mut new = Fixture::with(2, with_transparency)?;
        let expected = new.renderer.record(SceneRef { changes: Changes::Unknown, ..lent })?;
        if found != new.submit(expected)?.read(0, "picture")? {
            return Err(format!("frame {frame} differs from that of a new renderer").into());
        }
    }
    Ok(())
}

fn as_wgpu() -> Result<(), Failed> {
    let mut world = ChangingWorld::new(9, 200);
    for camera in &mut world.scene.cameras {
        camera.size = [240, 135];
    }
    let mut by_wgpu = Fixture::with(2, tinted)?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = tinted(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))));
    let (mut renderer, submitter) = builder.build(scheduler)?;
    for _frame in 0..6 {
        let columns = [world.tints()];
        let scene = SceneRef { columns: &columns, ..world.as_scene_ref() };
        let recorded = by_wgpu.renderer.record(scene)?;
        let expected = by_wgpu.submit(recorded)?.read(0, "tinted")?;
        let found = submitter.submit(renderer.record(scene)?)?.submission.read(0, "tinted")?;
        let differing = expected
            .bytes
            .chunks_exact(4)
            .zip(found.bytes.chunks_exact(4))
            .filter(|(one, other)| one.iter().zip(*other).any(|(one, other)| one.abs_diff(*other) > 1));
        // On an edge, rounding decides which object a pixel shows.
        let (differing, pixels) = (differing.count(), expected.bytes.len() / 4);
        if differing * 500 > pixels {
            return Err(format!("{differing} of {pixels} pixels differ").into());
        }
        world.step()?;
    }
    Ok(())
}

fn too_few_buffers() -> Result<(), Failed> {
    let (device, queue) = adapter::device_with_limits(WgpuBackend::REQUIRED_LIMITS)?;
    let mut fixture = Fixture::on((device, queue), 1, tinted)?;
    let (scene, tints) = (squares()?, [[0.0; 4]; 2]);
    let scene = SceneRef { columns: &[TINT.values(&tints)], ..scene.as_scene_ref() };
    match fixture.renderer.record(scene) {
        Ok(_) => Err("a device with four storage buffers a shader has none for a column".into()),
        Err(error) if error.to_string().contains("\"tinted\"") && error.to_string().contains("torage") => Ok(()),
        Err(error) => Err(format!("the error names neither the process nor the limit: {error}").into()),
    }
}
