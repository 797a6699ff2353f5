//! Targets of other sizes, and what a target held in the frame before.

use std::sync::Arc;

use drawloom::backend::{Backend, Picture, SoftwareBackend};
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess, TargetSize,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::scenes::field;
use drawloom_testing::tinted::{TINT, Tinted};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] = &[
    ("a_target_keeps_the_frame_before_and_a_dropped_frame_leaves_none", history),
    ("another_view_or_size_has_no_history", another_history),
    ("frames_that_are_forgotten_leave_no_history", forgotten),
    ("a_frame_whose_scene_cannot_be_drawn_loses_no_history", impossible),
    ("software_keeps_the_frame_before_as_wgpu_does", history_in_software),
    ("a_history_ends_within_the_loss_of_its_format_over_the_share_of_a_frame", mean),
    ("targets_may_be_parts_of_the_picture_or_of_a_size_of_their_own", sizes),
    ("objects_are_drawn_into_smaller_targets_as_into_smaller_pictures", smaller_objects),
];

/// Adds 32/255 to the red that its target had in the frame before, and sets green where there was one.
#[derive(Clone, Copy)]
pub struct Accumulate;

const STEP: f64 = 32.0 / 255.0;

impl RenderProcess for Accumulate {
    fn name(&self) -> &str {
        "accumulate"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_previous("sum");
        declare.clears_color("sum", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var before: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let sum = textureLoad(before, vec2<i32>(in.position.xy), 0);
                return vec4<f32>(sum.r + 32.0 / 255.0, sum.a, 0.0, 1.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Accumulate {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let sum = pass.sampled[0].load(pixel.coordinates, 0);
        targets[0] = Vector([sum[0] + R::of(STEP), sum[3], R::zero(), R::one()]);
        true
    }
}

fn scene() -> Scene {
    let mut scene = field(10);
    for camera in &mut scene.cameras {
        camera.size = [80, 70];
    }
    scene
}

/// With a process that adds to the target `sum` in each frame.
pub fn accumulates<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    builder.process(Accumulate).output("sum")
}

fn history() -> Result<(), Failed> {
    let (mut fixture, scene) = (Fixture::with(2, accumulates)?, scene());
    let sums = [32, 64, 96, 128];
    for (frame, sum) in sums.into_iter().enumerate() {
        let recorded = fixture.record(&scene)?;
        if frame == 2 {
            drop(fixture.record(&scene)?);
        }
        let submission = fixture.submit(recorded)?;
        let green = if frame == 0 { 0 } else { 255 };
        for view in 0..2 {
            let picture = submission.read(view, "sum")?;
            assert_color(pixel(&picture, 79, 69), [sum, green, 0])?;
            // The copy that the next frame reads.
            if picture.bytes != submission.read(view, "sum of the frame before")?.bytes {
                return Err("the history is not that of the frame".into());
            }
        }
    }
    // Frames in flight read what was submitted before them, whenever they were recorded.
    let in_flight = [fixture.record(&scene)?, fixture.record(&scene)?];
    for (recorded, sum) in in_flight.into_iter().zip([160, 192]) {
        assert_color(pixel(&fixture.submit(recorded)?.read(0, "sum")?, 3, 3), [sum, 255, 0])?;
    }
    Ok(())
}

fn another_history() -> Result<(), Failed> {
    let (mut fixture, mut scene) = (Fixture::with(2, accumulates)?, scene());
    let mut sums = |scene: &Scene| {
        let recorded = fixture.record(scene)?;
        let submission = fixture.submit(recorded)?;
        let red = |view| Ok::<_, Failed>(pixel(&submission.read(view, "sum")?, 1, 1)[0]);
        Ok::<_, Failed>([red(0)?, red(1)?])
    };
    let mut found = vec![sums(&scene)?, sums(&scene)?];
    scene.cameras[1].name.push_str(", turned");
    found.push(sums(&scene)?);
    scene.cameras[0].size = [70, 80];
    found.push(sums(&scene)?);
    scene.cameras.swap(0, 1);
    found.push(sums(&scene)?);
    found.push(sums(&scene)?);
    // The order of the cameras does not matter.
    let expected = [[32, 32], [64, 64], [96, 32], [32, 64], [96, 64], [128, 96]];
    if found == expected { Ok(()) } else { Err(format!("{found:?} instead of {expected:?}").into()) }
}

fn history_in_software() -> Result<(), Failed> {
    let (mut by_wgpu, mut scene) = (Fixture::with(2, accumulates)?, scene());
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = accumulates(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))));
    let (mut renderer, submitter) = builder.build(scheduler)?;
    for frame in 0..8 {
        // Another view, and another size.
        match frame {
            3 => scene.cameras[0].name.push_str(", turned"),
            5 => scene.cameras[0].size = [64, 70],
            _ => {}
        }
        let recorded = by_wgpu.record(&scene)?;
        let expected = by_wgpu.submit(recorded)?.read(0, "sum")?;
        let found = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "sum")?;
        if found != expected {
            return Err(format!("frame {frame} differs").into());
        }
    }
    Ok(())
}

fn forgotten() -> Result<(), Failed> {
    let (mut by_wgpu, scene) = (Fixture::with(2, accumulates)?, scene());
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = accumulates(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))));
    let (mut by_software, submitter) = builder.build(scheduler)?;
    // A frame in flight is not affected.
    let first = by_wgpu.record(&scene)?;
    by_wgpu.submit(first)?;
    let in_flight = by_wgpu.record(&scene)?;
    by_wgpu.renderer.forget_previous_frames();
    assert_color(pixel(&by_wgpu.submit(in_flight)?.read(0, "sum")?, 1, 1), [64, 255, 0])?;
    for sum in [32, 64, 32, 64, 96] {
        if sum == 32 {
            by_wgpu.renderer.forget_previous_frames();
            by_software.forget_previous_frames();
        }
        let recorded = by_wgpu.record(&scene)?;
        let green = if sum == 32 { 0 } else { 255 };
        assert_color(pixel(&by_wgpu.submit(recorded)?.read(0, "sum")?, 1, 1), [sum, green, 0])?;
        let submission = submitter.submit(by_software.record(scene.as_scene_ref())?)?.submission;
        assert_color(pixel(&submission.read(0, "sum")?, 1, 1), [sum, green, 0])?;
    }
    Ok(())
}

fn impossible() -> Result<(), Failed> {
    let (mut fixture, mut scene) = (Fixture::with(2, accumulates)?, scene());
    let (position, size) = (scene.cameras[1].position, scene.cameras[1].size);
    for sum in [32, 64, 96, 128] {
        let recorded = fixture.record(&scene)?;
        let green = if sum == 32 { 0 } else { 255 };
        assert_color(pixel(&fixture.submit(recorded)?.read(0, "sum")?, 1, 1), [sum, green, 0])?;
        match sum {
            32 => scene.cameras[1].position.x = 1e300,
            64 => scene.cameras[1].size = [1 << 20, 70],
            _ => continue,
        }
        if fixture.renderer.record(scene.as_scene_ref()).is_ok() {
            return Err("an impossible frame is recorded".into());
        }
        (scene.cameras[1].position, scene.cameras[1].size) = (position, size);
    }
    Ok(())
}

/// Draws the position of each pixel into a target of some size.
struct Gradient(&'static str, TargetSize);

impl RenderProcess for Gradient {
    fn name(&self) -> &str {
        self.0
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(self.0, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.size(self.0, self.1);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(in.clip * 0.5 + 0.5, 0.0, 1.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(GradientCpuShader))
    }
}

struct GradientCpuShader;

impl<R: Real> FullScreenCpuShader<R> for GradientCpuShader {
    fn fragment(&self, _: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let half = R::of(0.5);
        targets[0] = Vector([pixel.clip[0] * half + half, pixel.clip[1] * half + half, R::zero(), R::one()]);
        true
    }
}

fn sizes() -> Result<(), Failed> {
    let sizes = [
        ("whole", TargetSize::Divided(1), [80, 70]),
        ("third", TargetSize::Divided(3), [27, 24]),
        ("thousandth", TargetSize::Divided(1000), [1, 1]),
        ("own", TargetSize::Fixed([7, 200]), [7, 200]),
    ];
    fn with<B: Backend>(
        mut builder: RendererBuilder<B>,
        sizes: &[(&'static str, TargetSize, [u32; 2])],
    ) -> RendererBuilder<B> {
        for &(name, size, _) in sizes {
            builder = builder.process(Gradient(name, size)).output(name);
        }
        builder
    }
    let (mut fixture, scene) = (Fixture::with(2, |builder| with(builder, &sizes))?, scene());
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = with(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))), &sizes);
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    let by_software = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
    for (name, _, [width, height]) in sizes {
        let picture = submission.read(0, name)?;
        if [picture.width, picture.height] != [width, height] {
            return Err(format!("{name} has {}x{} pixels", picture.width, picture.height).into());
        }
        let fraction = |pixel: u32, size: u32| ((f64::from(pixel) + 0.5) / f64::from(size) * 255.0).round() as u8;
        for [x, y] in [[0, 0], [width - 1, 0], [width / 2, height - 1]] {
            let expected = [fraction(x, width), fraction(height - 1 - y, height), 0];
            assert_color(pixel(&picture, x, y), expected)?;
            assert_color(pixel(&by_software.read(0, name)?, x, y), expected)?;
        }
    }
    Ok(())
}

/// [`Tinted`] into targets of half the picture's size.
struct HalfTinted;

impl RenderProcess for HalfTinted {
    fn name(&self) -> &str {
        Tinted.name()
    }

    fn declare(&self, declare: &mut Declare) {
        Tinted.declare(declare);
        for target in ["tinted", "depth of tinted"] {
            declare.size(target, TargetSize::Divided(2));
        }
    }

    fn draws(&self) -> Draws<'_> {
        Tinted.draws()
    }
}

fn smaller_objects() -> Result<(), Failed> {
    let mut scene = scene();
    let tints: Vec<[f32; 4]> = (0..10).map(|object| [object as f32 / 10.0, 0.5, 1.0, 1.0]).collect();
    let columns = [TINT.values(&tints)];
    let draw = |mut fixture: Fixture, scene: &Scene| -> Result<Picture, Failed> {
        let recorded = fixture.renderer.record(SceneRef { columns: &columns, ..scene.as_scene_ref() })?;
        Ok(fixture.submit(recorded)?.read(0, "tinted")?)
    };
    let found = draw(Fixture::with(2, |builder| builder.process(HalfTinted).output("tinted"))?, &scene)?;
    for camera in &mut scene.cameras {
        camera.size = [40, 35];
    }
    let expected = draw(Fixture::with(2, |builder| builder.process(Tinted).output("tinted"))?, &scene)?;
    if found == expected { Ok(()) } else { Err("the pictures differ".into()) }
}

/// Mixes a constant into its own target of the frame before.
struct Mix {
    format: Format,
}

/// The share of a frame.
const SHARE: f64 = 1.0 / 64.0;

/// What is mixed in; the history begins with half of it.
const MIXED: f64 = 0.7;

impl RenderProcess for Mix {
    fn name(&self) -> &str {
        "mix"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_previous("mean");
        declare.clears_color("mean", self.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var before: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let mean = textureLoad(before, vec2<i32>(in.position.xy), 0);
                return vec4<f32>(select(0.35, mix(mean.r, 0.7, 1.0 / 64.0), mean.a == 1.0), 0.0, 0.0, 1.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// Each frame leaves a share of the distance, and adds what a write loses: in the end the sum of a geometric series.
fn mean() -> Result<(), Failed> {
    let mut scene = scene();
    scene.cameras.truncate(1);
    scene.cameras[0].size = [1, 1];
    for (format, loss) in [(Format::Rgba16Float, 2_f64.powi(-10)), (Format::Rgba32Float, 2_f64.powi(-23))] {
        let mut fixture = Fixture::with(1, |builder| builder.process(Mix { format }).output("mean"))?;
        let mut found = 0.0;
        for frame in 0..900 {
            let recorded = fixture.record(&scene)?;
            let submission = fixture.submit(recorded)?;
            if frame == 899 {
                found = f64::from(submission.read(0, "mean")?.texel([0, 0])[0]);
            }
        }
        // In f32, mixing itself has four roundings.
        let bound = (loss + 4.0 * 2_f64.powi(-24)) / SHARE + 0.5 * (1.0 - SHARE).powi(899);
        let error = (found / MIXED - 1.0).abs();
        if error > bound || (format == Format::Rgba16Float && error < 2_f64.powi(-10)) {
            return Err(format!("{format:?}: an error of {error}, not {bound} at most").into());
        }
    }
    Ok(())
}
