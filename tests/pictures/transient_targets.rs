//! Targets that share textures, because their lives do not overlap.

use drawloom::backend::{BackendError, Picture, TargetMemory, WgpuBackend, WgpuSubmission};
use drawloom::glam::DVec3;
use drawloom::process::internal::ViewOrder;
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, Fxaa, RenderProcess, ToneMapping};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, Scene, ViewKind};
use drawloom::{RecordedFrame, RendererBuilder, wgpu};
use drawloom_testing::scenes::{field, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, device};
use crate::imported_targets::{USAGE, texture};
use crate::references::small_colonnade;
use crate::sampled_views::{MIRROR, PLANE, mirror_scene};
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("views_that_share_textures_have_the_same_pictures", colonnade),
    ("mirrors_that_share_textures_show_the_same", mirrors),
    ("what_the_frame_before_held_is_not_shared", history),
    ("small_pictures_of_many_views_are_layers_and_stay_the_same", small_pictures),
    ("imported_targets_are_not_shared", imports),
    ("views_that_are_drawn_process_by_process_share_what_they_can", process_by_process),
    ("transient_targets_that_are_read_are_named", reading),
    ("statistics_have_the_bytes_with_and_without_transient_targets", statistics),
];

/// A renderer with transient targets, and one without.
struct Both([Fixture; 2]);

impl Both {
    fn new(build: impl Fn(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>) -> Result<Self, Failed> {
        Ok(Self([Fixture::with_transient_targets(2, &build)?, Fixture::with(2, &build)?]))
    }

    fn record(&mut self, scene: &Scene) -> Result<[RecordedFrame<WgpuBackend>; 2], Failed> {
        let [transient, dedicated] = &mut self.0;
        Ok([transient.record(scene)?, dedicated.record(scene)?])
    }

    fn submit(&self, [transient, dedicated]: [RecordedFrame<WgpuBackend>; 2]) -> Result<[WgpuSubmission; 2], Failed> {
        Ok([self.0[0].submit(transient)?, self.0[1].submit(dedicated)?])
    }

    /// Fails if these targets of views differ, or one has only one colour.
    fn draw_same(&mut self, context: &str, scene: &Scene, targets: &[(usize, &str)]) -> Result<(), Failed> {
        let recorded = self.record(scene)?;
        let submissions = self.submit(recorded)?;
        assert_same(context, &submissions, targets)
    }

    /// Fails unless textures are shared.
    fn assert_shared(&self) -> Result<(), Failed> {
        let memory = self.0.each_ref().map(|fixture| fixture.renderer.backend().resources());
        let is_less = memory[0].target_bytes < memory[1].target_bytes;
        expect(is_less && memory[0].targets < memory[1].targets, || format!("nothing is shared: {memory:?}"))
    }
}

fn assert_same(context: &str, submissions: &[WgpuSubmission; 2], targets: &[(usize, &str)]) -> Result<(), Failed> {
    for &(view, target) in targets {
        let [transient, dedicated] = submissions.each_ref().map(|submission| submission.read(view, target));
        let (transient, dedicated) = (transient?, dedicated?);
        expect(has_content(&dedicated), || format!("{context}: {target} of view {view} is of one colour"))?;
        expect(transient == dedicated, || format!("{context}: {target} of view {view} differs"))?;
    }
    Ok(())
}

fn has_content(picture: &Picture) -> bool {
    let pixels = picture.bytes.chunks_exact(picture.format.bytes());
    pixels.clone().any(|pixel| pixel != &picture.bytes[..picture.format.bytes()])
}

/// Cameras of two sizes at several positions.
fn with_cameras(scene: &mut Scene, sizes: &[[u32; 2]]) {
    let main = scene.cameras[0].clone();
    scene.cameras.clear();
    for (index, size) in sizes.iter().enumerate() {
        let name = format!("camera {index}");
        let position = main.position + DVec3::X * (0.4 * index as f64);
        scene.cameras.push(sized(Camera { name, position, ..main.clone() }, *size));
    }
}

/// A pipeline whose tone mapping and copy have targets of one kind, both in use while the copy is drawn.
fn smooth() -> Deferred {
    let copy = |source: &str, target: &str| Mean { format: Format::Rgba8Srgb, ..Mean::of("copy", source, target) };
    Deferred::new().post(ToneMapping::default()).post(copy).post(Fxaa::default())
}

fn colonnade() -> Result<(), Failed> {
    let quality = Quality::balanced();
    // Some frames draw shadow maps, and the others read those of the frame before.
    let quality = Quality { shadows: ShadowQuality { interval: 2, side: 64, ..quality.shadows }, ..quality };
    let mut both = Both::new(|builder| builder.pipeline(smooth()).quality(quality))?;
    let mut scene = small_colonnade()?;
    let (wide, small) = ([96, 54], [40, 40]);
    for (frame, sizes) in [
        &[wide, small, wide, wide][..],
        &[wide, small, wide, wide],
        &[wide, small, wide, wide],
        &[wide],
        &[small, wide, small],
        &[small, wide, small, wide, small],
    ]
    .into_iter()
    .enumerate()
    {
        if frame > 0 {
            scene.cameras[0].position.x += 0.1;
        }
        with_cameras(&mut scene, sizes);
        let pictures: Vec<_> = (0..sizes.len()).map(|view| (view, "picture")).collect();
        both.draw_same(&format!("frame {frame}"), &scene, &pictures)?;
        both.assert_shared()?;
    }
    Ok(())
}

/// Views come, go and change their order and size, and each frame adds to what its views held before.
fn small_pictures() -> Result<(), Failed> {
    let mut both = Both::new(|builder| builder.pipeline(Deferred::to_picture()))?;
    let mut scene = field(50);
    let camera = scene.cameras[0].clone();
    let mut fewest = usize::MAX;
    for frame in 0..6_usize {
        let numbers = (0..90).filter(|number| !(number + frame).is_multiple_of(4 + frame % 2));
        scene.cameras = numbers
            .map(|number| {
                let position = camera.position + DVec3::X * (number as f64 * 0.05);
                let size = if number == 3 { [12 + frame as u32, 8] } else { [16, 8] };
                sized(Camera { name: format!("camera {number}"), position, ..camera.clone() }, size)
            })
            .collect();
        scene.cameras.rotate_left(7 * frame);
        let targets: Vec<_> = (0..scene.cameras.len()).map(|view| (view, "picture")).collect();
        both.draw_same(&format!("frame {frame}"), &scene, &targets)?;
        fewest = fewest.min(both.0[0].renderer.backend().resources().targets);
    }
    // Of 60 views or more, each with a geometry buffer, radiance and picture.
    expect(fewest < 30, || format!("{fewest} textures"))
}

fn mirrors() -> Result<(), Failed> {
    let mut scene = mirror_scene()?;
    let size = scene.cameras[0].size;
    let other = Camera::looking_at("other", DVec3::new(-0.7, 0.2, 1.5), DVec3::new(0.1, 0.0, -4.0));
    scene.cameras.push(sized(other, size));
    let mut both = Both::new(|builder| builder.pipeline(Deferred::to_picture()).process(MIRROR))?;
    // Without mirrored cameras, with those of one camera, of both, and mirrors in mirrors.
    for index in [None, Some(1), Some(0), Some(2), Some(3)] {
        if let Some(index) = index {
            let camera = scene.cameras[index].reflected("mirror", PLANE);
            scene.cameras.push(camera);
        }
        let main = scene.cameras.iter().enumerate().filter(|(_, camera)| camera.kind == ViewKind::Main);
        let pictures: Vec<_> = main.map(|(view, _)| (view, "picture")).collect();
        both.draw_same(&format!("{} cameras", scene.cameras.len()), &scene, &pictures)?;
        both.assert_shared()?;
    }
    Ok(())
}

/// A full-screen process that copies a target, or draws the mean of it and of what it drew in the frame before.
#[derive(Clone)]
struct Mean {
    name: &'static str,
    source: String,
    target: String,
    format: Format,
    accumulates: bool,
    once_a_frame: bool,
}

impl Mean {
    fn of(name: &'static str, source: &str, target: &str) -> Self {
        let (source, target) = (source.to_owned(), target.to_owned());
        Self { name, source, target, format: Format::Rgba8Unorm, accumulates: false, once_a_frame: false }
    }
}

impl RenderProcess for Mean {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        if self.accumulates {
            declare.samples_previous(&self.target);
        }
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
        if self.once_a_frame {
            declare.once_a_frame();
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = if self.accumulates {
            "
                @group(2) @binding(1) var one: texture_2d<f32>;
                @group(2) @binding(2) var other: texture_2d<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    let pixel = vec2<i32>(in.position.xy);
                    return 0.5 * (textureLoad(one, pixel, 0) + textureLoad(other, pixel, 0));
                }
            "
        } else {
            "
                @group(2) @binding(1) var one: texture_2d<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    return textureLoad(one, vec2<i32>(in.position.xy), 0);
                }
            "
        };
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// Only what shows the history is an output, so nothing but its history keeps the target from being shared.
fn history() -> Result<(), Failed> {
    let trail = Mean { accumulates: true, ..Mean::of("trail", "picture", "trail") };
    let shown = Mean::of("shown", "trail", "shown");
    let build = |builder: RendererBuilder<WgpuBackend>| {
        builder.pipeline(Deferred::to_picture()).process(trail.clone()).process(shown.clone()).output("shown")
    };
    let (mut both, mut scene) = (Both::new(build)?, field(40));
    with_cameras(&mut scene, &[[80, 60]; 3]);
    let targets: Vec<_> = (0..3).flat_map(|view| [(view, "shown"), (view, "trail"), (view, "picture")]).collect();
    for frame in 0..4 {
        scene.cameras.iter_mut().for_each(|camera| camera.position.x += 0.3);
        if frame == 2 {
            // A frame that is dropped leaves no history.
            drop(both.record(&scene)?);
        }
        both.draw_same(&format!("frame {frame}"), &scene, &targets)?;
        both.assert_shared()?;
    }
    Ok(())
}

fn imports() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (mut both, mut scene) = (Both::new(|builder| builder.pipeline(smooth()))?, field(40));
    let size = [80, 60];
    with_cameras(&mut scene, &[size; 3]);
    let pictures = [0, 1, 2].map(|view| (view, "picture"));
    for (frame, imported) in [&[][..], &[0], &[0, 2], &[], &[1], &[0, 1, 2]].into_iter().enumerate() {
        scene.cameras[0].position.x += 0.3;
        let mut radiances = Vec::new();
        for fixture in &both.0 {
            for &view in imported {
                let radiance = texture(&device, size, wgpu::TextureFormat::Rgba16Float, USAGE);
                let name = scene.cameras[view].name.clone();
                fixture.renderer.backend().import_target(name, "radiance", radiance.clone());
                radiances.push(radiance);
            }
        }
        let recorded = both.record(&scene)?;
        let submissions = both.submit(recorded)?;
        let context = format!("frame {frame}");
        assert_same(&context, &submissions, &pictures)?;
        assert_same(&context, &submissions, &imported.iter().map(|view| (*view, "radiance")).collect::<Vec<_>>())?;
        for (&view, radiance) in imported.iter().zip(&radiances) {
            let is_imported = submissions[0].texture(view, "radiance").ok() == Some((radiance, 0));
            expect(is_imported, || format!("{context}: view {view} is drawn into something else"))?;
        }
        both.assert_shared()?;
    }
    Ok(())
}

fn process_by_process() -> Result<(), Failed> {
    let sheet = Mean { once_a_frame: true, ..Mean::of("sheet", "picture", "sheet") };
    let build =
        |builder: RendererBuilder<WgpuBackend>| builder.pipeline(smooth()).process(sheet.clone()).output("sheet");
    let (mut both, mut scene) = (Both::new(build)?, field(40));
    with_cameras(&mut scene, &[[80, 60]; 3]);
    let targets = [(0, "picture"), (1, "picture"), (2, "picture"), (0, "sheet")];
    for frame in 0..3 {
        scene.cameras[1].position.x += 0.3;
        both.draw_same(&format!("frame {frame}"), &scene, &targets)?;
        both.assert_shared()?;
    }
    let mut groups = both.0[0].renderer.plan().view_groups().iter();
    let is_mixed = groups.any(|group| group.kinds == [ViewKind::Main] && group.order == ViewOrder::ProcessByProcess);
    expect(is_mixed, || "views are drawn one after the other".to_owned())
}

fn reading() -> Result<(), Failed> {
    let mut scene = field(40);
    with_cameras(&mut scene, &[[80, 60]; 2]);
    let mut both = Both::new(|builder| builder.pipeline(Deferred::to_picture()))?;
    let mut recorded = both.record(&scene)?;
    let read_back = recorded[0].read_back(1, "radiance", [0, 0], [1, 1]).map(drop);
    let unknown = recorded[0].read_back(1, "unknown", [0, 0], [1, 1]).map(drop);
    let submissions = both.submit(recorded)?;
    let read = submissions[0].read(1, "radiance").map(drop);
    for error in [read_back, read] {
        let Err(BackendError::TransientTarget { view: 1, target }) = &error else {
            return Err(format!("another result: {error:?}").into());
        };
        expect(target == "radiance", || format!("another target: {target}"))?;
    }
    expect(submissions[0].texture(1, "radiance").is_err(), || "the texture is lent".to_owned())?;
    expect(submissions[0].texture(1, "picture").is_ok(), || "the picture is not lent".to_owned())?;
    expect(matches!(unknown, Err(BackendError::UnknownTarget { .. })), || format!("another result: {unknown:?}"))?;
    submissions[1].read(1, "radiance")?;

    // An output keeps a texture of its own.
    let mut both = Both::new(|builder| builder.pipeline(Deferred::to_picture()).output("radiance"))?;
    let targets: Vec<_> = (0..2).flat_map(|view| [(view, "picture"), (view, "radiance")]).collect();
    both.draw_same("with another output", &scene, &targets)?;
    both.assert_shared()
}

fn statistics() -> Result<(), Failed> {
    let mut scene = field(40);
    let mut both = Both::new(|builder| builder.pipeline(Deferred::to_picture()))?;
    let (wide, small) = ([80, 60], [31, 17]);
    for (sizes, repeated) in [
        (&[wide][..], &[][..]),
        (&[wide, small], &[]),
        (&[wide, small, wide, small, wide], &[wide, small, wide]),
        (&[small, small], &[small]),
    ] {
        with_cameras(&mut scene, sizes);
        let recorded = both.record(&scene)?;
        let [transient, dedicated] = recorded.each_ref().map(|recorded| recorded.statistics().targets);
        // Views of the same size share the normals, both colours before tone mapping, and the depth.
        let saved: u64 = repeated.iter().map(|[width, height]| u64::from(width * height) * (4 + 4 + 8 + 4)).sum();
        let expected = TargetMemory {
            textures: dedicated.textures - 4 * repeated.len(),
            bytes: dedicated.bytes - saved,
            dedicated_bytes: dedicated.bytes,
        };
        expect(transient == expected, || format!("{sizes:?}: {transient:?} instead of {expected:?}"))?;
        expect(dedicated.bytes == dedicated.dedicated_bytes, || format!("{sizes:?}: {dedicated:?}"))?;
        for (fixture, memory) in both.0.iter().zip([transient, dedicated]) {
            let found = fixture.renderer.backend().resources();
            let found = TargetMemory {
                textures: found.targets,
                bytes: found.target_bytes,
                dedicated_bytes: found.dedicated_target_bytes,
            };
            expect(found == memory, || format!("{sizes:?}: {found:?} instead of {memory:?}"))?;
        }
        both.submit(recorded)?;
    }
    Ok(())
}
