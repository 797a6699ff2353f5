//! Raw passes that are encoded in several encoders.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::Picture;
use drawloom::glam::DVec3;
use drawloom::process::{Declare, Draws, Format, RawPass, RawPassResources, RenderProcess};
use drawloom::scene::{Camera, Scene};
use drawloom::view::RenderView;
use drawloom::wgpu;
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};

pub const CASES: &[Case] = &[
    ("encoders_of_a_raw_pass_are_submitted_in_order", in_order),
    ("what_an_encoder_of_a_raw_pass_reports_fails_the_frame_by_name", failing),
    ("a_raw_pass_has_no_more_encoders_than_it_may", too_many),
];

const SIDE: u32 = 16;

/// Encoder `n` writes row `n`, and, over what those before it wrote, the first row.
#[derive(Default)]
struct Rows {
    encoders: AtomicUsize,
    /// The number of an encoder that fails; 0 for none.
    failing: AtomicUsize,
}

#[derive(Clone, Default)]
struct Process(Arc<Rows>);

impl RenderProcess for Process {
    fn name(&self) -> &str {
        "rows"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.writes("rows", Format::Rgba8Unorm);
        declare.mipmapped("rows");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(&*self.0)
    }
}

impl RawPass for Rows {
    fn encoder_count(&self, view: &RenderView) -> usize {
        assert_eq!(view.name(), "main");
        match self.encoders.load(Ordering::Relaxed) {
            usize::MAX => panic!("nobody knows how many"),
            encoders => encoders,
        }
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let (target, index) = (resources.target("rows")?, resources.encoder);
        if index > 0 && index == self.failing.load(Ordering::Relaxed) {
            return Err(format!("encoder {index} gives up").into());
        }
        let row = [index as u8, 255 - index as u8, 7, 255].repeat(SIDE as usize);
        let source = resources.buffer_of("row", wgpu::BufferUsages::COPY_SRC, &row);
        for y in [index as u32 % SIDE, 0] {
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
            let destination =
                wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y, z: 0 }, ..target.as_image_copy() };
            let size = wgpu::Extent3d { width: SIDE, height: 1, depth_or_array_layers: 1 };
            encoder.copy_buffer_to_texture(wgpu::TexelCopyBufferInfo { buffer: &source, layout }, destination, size);
        }
        Ok(())
    }
}

fn fixture(process: &Process, workers: usize) -> Result<(Fixture, Scene), Failed> {
    let fixture = Fixture::with(workers, |builder| builder.process(process.clone()).output("rows"))?;
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), [SIDE, SIDE])];
    Ok((fixture, scene))
}

fn draw(fixture: &mut Fixture, scene: &Scene) -> Result<Picture, Failed> {
    let recorded = fixture.record(scene)?;
    Ok(fixture.submit(recorded)?.read(0, "rows")?)
}

fn check(picture: &Picture, encoders: usize) {
    let value = |encoder: usize| [encoder as u8, 255 - encoder as u8, 7];
    assert_eq!(pixel(picture, 3, 0), value(encoders - 1), "of {encoders}, the last one is submitted last");
    for row in 1..encoders.min(SIDE as usize) {
        let latest = (row..encoders).step_by(SIDE as usize).next_back().unwrap_or(row);
        assert_eq!(pixel(picture, 3, row as u32), value(latest), "row {row} of {encoders}");
    }
}

fn in_order() -> Result<(), Failed> {
    for workers in [1, 3] {
        let process = Process::default();
        let (mut fixture, scene) = fixture(&process, workers)?;
        for encoders in [0, 1, 2, 7, 256, 1, 3] {
            process.0.encoders.store(encoders, Ordering::Relaxed);
            check(&draw(&mut fixture, &scene)?, encoders.max(1));
        }
    }
    Ok(())
}

fn failing() -> Result<(), Failed> {
    let process = Process::default();
    let (mut fixture, scene) = fixture(&process, 2)?;
    process.0.encoders.store(5, Ordering::Relaxed);
    process.0.failing.store(3, Ordering::Relaxed);
    let error = draw(&mut fixture, &scene).err().ok_or("it is drawn")?;
    let message = error.message().unwrap_or_default();
    let is_named = ["rows", "main", "encoder 3 gives up"].iter().all(|part| message.contains(part));
    assert!(is_named, "{message}");
    process.0.failing.store(0, Ordering::Relaxed);
    check(&draw(&mut fixture, &scene)?, 5);
    Ok(())
}

fn too_many() -> Result<(), Failed> {
    let process = Process::default();
    let (mut fixture, scene) = fixture(&process, 2)?;
    for (encoders, expected) in
        [(RawPassResources::MAX_ENCODERS + 1, "MAX_ENCODERS"), (usize::MAX, "nobody knows how many")]
    {
        process.0.encoders.store(encoders, Ordering::Relaxed);
        let error = draw(&mut fixture, &scene).err().ok_or("it is drawn")?;
        let message = error.message().unwrap_or_default();
        assert!(message.contains(expected), "{message}");
    }
    process.0.encoders.store(2, Ordering::Relaxed);
    check(&draw(&mut fixture, &scene)?, 2);
    Ok(())
}
