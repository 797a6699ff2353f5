//! Targets with mip levels.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{BackendError, Picture, TargetMemory, WgpuSubmission};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, FullScreen, RawPass, RawPassResources, RenderProcess,
    TargetSize,
};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::wgpu::{CommandEncoder, TextureFormat};
use drawloom::{FrameError, Granularity, Renderer};
use drawloom_testing::mip_levels::{
    ATLAS_FORMATS, ATLAS_SIZES, DrawnFrame, OUTPUTS, Shown, atlas_name, atlas_scene, check, check_atlas, with_atlases,
    with_mip_levels,
};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend};
use crate::imported_targets::{USAGE, texture};
use crate::strategies::{expect, many_batches, strategies};

pub const CASES: &[Case] = &[
    ("mip_levels_are_means_in_every_view_and_frame", own),
    ("mip_levels_are_means_where_targets_are_transient", transient),
    ("mip_levels_are_means_at_every_size_and_in_every_format", atlases),
    ("level_0_is_the_same_and_the_last_level_its_mean_with_every_strategy", same_bytes),
    ("levels_of_what_a_raw_pass_writes_are_generated", raw),
    ("statistics_have_the_bytes_of_mip_levels", memory),
    ("a_target_with_mip_levels_cannot_be_imported", import),
];

/// The pixels of a target with four floats.
fn numbers(submission: &WgpuSubmission, view: usize, target: &str) -> Result<Vec<[f64; 4]>, Failed> {
    let picture = submission.read(view, target)?;
    Ok(picture.bytes.as_chunks().0.iter().map(|pixel: &[u8; 16]| pixel_of(pixel)).collect())
}

fn pixel_of(bytes: &[u8; 16]) -> [f64; 4] {
    std::array::from_fn(|channel| {
        let bytes = &bytes[channel * 4..];
        f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    })
}

fn check_levels(mut fixture: Fixture) -> Result<(), Failed> {
    // Devices have at least 8 bits of a position between pixels, and as many of one between levels.
    let checked = check(3.0 / 256.0, |frame, scene| {
        let recorded = fixture.record(scene).map_err(|error| format!("{error:?}"))?;
        let is_drawn = recorded.statistics().views.iter().map(|view| view.age == 0).collect();
        if frame == 2 {
            // A frame that is dropped leaves nothing.
            drop(fixture.record(scene).map_err(|error| format!("{error:?}"))?);
        }
        let submission = fixture.submit(recorded).map_err(|error| format!("{error:?}"))?;
        let mut outputs = [Vec::new(), Vec::new(), Vec::new()];
        for (pixels, output) in outputs.iter_mut().zip(OUTPUTS) {
            *pixels = numbers(&submission, 0, output).map_err(|error| format!("{error:?}"))?;
        }
        Ok::<_, String>(DrawnFrame { is_drawn, outputs })
    });
    Ok(checked?)
}

fn own() -> Result<(), Failed> {
    check_levels(Fixture::with(2, with_mip_levels)?)
}

fn transient() -> Result<(), Failed> {
    check_levels(Fixture::with_transient_targets(2, with_mip_levels)?)
}

fn atlases() -> Result<(), Failed> {
    // Transient targets of the same format and size would share a texture, and small ones be layers.
    for mut fixture in [Fixture::with(2, with_atlases)?, Fixture::with_transient_targets(2, with_atlases)?] {
        let recorded = fixture.record(&atlas_scene())?;
        let submission = fixture.submit(recorded)?;
        for (view, size) in ATLAS_SIZES.into_iter().enumerate() {
            for format in ATLAS_FORMATS {
                check_atlas(Shown::Rounded, format, size, &numbers(&submission, view, &atlas_name(format))?)?;
            }
        }
    }
    Ok(())
}

/// Draws all objects into a target with mip levels.
struct Objects;

impl RenderProcess for Objects {
    fn name(&self) -> &str {
        "objects"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("objects", Format::Rgba16Float, ClearColor::Value([0.0, 0.0, 0.5, 1.0]));
        declare.mipmapped("objects");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Vertex {
                @builtin(position) @invariant clip: vec4<f32>,
                @location(0) normal: vec3<f32>,
            }

            @vertex
            fn vertex(in: VertexInput) -> Vertex {
                let object = drawn_object(in.instance);
                return Vertex(clip_position(relative_position(object, in.position)), in.normal);
            }

            @fragment
            fn fragment(in: Vertex) -> @location(0) vec4<f32> {
                return vec4<f32>(abs(in.normal), 1.0);
            }
        ";
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}

/// The mean of all pixels of a target.
struct Mean(&'static str);

impl RenderProcess for Mean {
    fn name(&self) -> &str {
        "mean"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(self.0);
        declare.clears_color("mean", Format::Rgba32Float, ClearColor::Value([0.0; 4]));
        declare.size("mean", TargetSize::Fixed([1, 1]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var shown: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(shown, vec2<u32>(0u), textureNumLevels(shown) - 1u);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// A pass with objects is recorded in several bundles or encoded in several encoders.
fn same_bytes() -> Result<(), Failed> {
    let mut scene = many_batches();
    let mut expected: Option<Picture> = None;
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let builder = Renderer::builder(backend)
            .pipeline(Deferred::to_picture().shadow_maps(None))
            .granularity(Granularity::Chunk(300));
        let builder = builder.process(Objects).process(Mean("objects")).output("mean").output("objects");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut fixture = Fixture { renderer, submitter };
        for size in [[96, 54], [61, 47]] {
            scene.cameras[0].size = size;
            let recorded = fixture.record(&scene)?;
            let submission = fixture.submit(recorded)?;
            let objects = submission.read(0, "objects")?;
            let mean = numbers(&submission, 0, "mean")?[0];
            let half = |bytes: &[u8]| half::f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
            for (channel, mean) in mean.into_iter().enumerate() {
                let sum: f64 = objects.bytes.chunks_exact(8).map(|pixel| half(&pixel[channel * 2..])).sum();
                let exact = sum / f64::from(size[0] * size[1]);
                expect((mean - exact).abs() < 0.004, || {
                    format!("{recording:?}, {encoding:?}: {mean} instead of {exact} in channel {channel}")
                })?;
            }
            let is_same = *expected.get_or_insert_with(|| objects.clone()) == objects || size != [96, 54];
            expect(is_same, || format!("{recording:?}, {encoding:?}: other objects"))?;
            let first = &objects.bytes[..8];
            expect(objects.bytes.chunks_exact(8).any(|pixel| pixel != first), || "no object is drawn".to_owned())?;
        }
    }
    Ok(())
}

/// Copies the target of [`Objects`] into one with mip levels.
struct Copied;

impl RenderProcess for Copied {
    fn name(&self) -> &str {
        "copied"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads("objects");
        declare.writes("copied", Format::Rgba16Float);
        declare.mipmapped("copied");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for Copied {
    fn encode(
        &self,
        encoder: &mut CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let (from, to) = (resources.target("objects")?, resources.target("copied")?);
        encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
        Ok(())
    }
}

fn raw() -> Result<(), Failed> {
    let mut scene = many_batches();
    scene.cameras.truncate(1);
    let means = ["objects", "copied"].map(|shown| {
        let mut fixture = Fixture::with(2, |builder| {
            let builder = builder.pipeline(Deferred::to_picture().shadow_maps(None));
            builder.process(Objects).process(Copied).process(Mean(shown)).output("mean")
        })?;
        let recorded = fixture.record(&scene)?;
        Ok::<_, Failed>(numbers(&fixture.submit(recorded)?, 0, "mean")?[0])
    });
    let [drawn, copied] = means;
    let (drawn, copied) = (drawn?, copied?);
    expect(drawn == copied && drawn[0] > 0.1, || format!("{copied:?} instead of {drawn:?}"))
}

fn memory() -> Result<(), Failed> {
    let mut fixture = Fixture::with(1, with_mip_levels)?;
    let mut scene: Scene = atlas_scene();
    scene.cameras.truncate(1);
    scene.cameras[0].size = [37, 23];
    let recorded = fixture.record(&scene)?;
    let memory = recorded.statistics().targets;
    let levels = [37 * 23, 18 * 11, 9 * 5, 4 * 2, 2, 1].into_iter().sum::<u64>();
    // Half floats with their history, and three outputs of four floats.
    let bytes = 2 * levels * 2 + 3 * 37 * 23 * 16;
    expect(memory == TargetMemory { textures: 5, bytes, dedicated_bytes: bytes }, || {
        format!("{memory:?} instead of {bytes} bytes")
    })?;
    fixture.submit(recorded)?;
    let found = fixture.renderer.backend().resources().target_bytes;
    expect(found == bytes, || format!("{found} instead of {bytes} bytes"))
}

fn import() -> Result<(), Failed> {
    let mut fixture = Fixture::with(1, with_mip_levels)?;
    let mut scene = atlas_scene();
    scene.cameras.truncate(1);
    let camera = &scene.cameras[0];
    let (device, _) = crate::fixture::device()?;
    let imported = texture(&device, camera.size, TextureFormat::R16Float, USAGE);
    fixture.renderer.backend().import_target(camera.name.clone(), "pyramid", imported);
    let error = fixture.renderer.record(scene.as_scene_ref()).map(drop).err();
    let Some(FrameError::Backend(error @ BackendError::InvalidImport { .. })) = &error else {
        return Err(format!("another result: {error:?}").into());
    };
    let message = error.to_string();
    expect(message.contains("pyramid") && message.contains("it has mip levels"), || message.clone())
}
