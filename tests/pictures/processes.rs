//! Processes of an engine: shaders, raw passes and errors.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::backend::BackendError;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Exposure, Format, FullScreen, GeometryBuffer, GeometryFormats,
    RawPass, RawPassResources, RenderProcess, ToneMapping,
};
use drawloom::scene::{Blend, Camera, Material, RenderObject, Scene, Topology};
use drawloom::{FrameError, wgpu};
use drawloom_testing::scenes::{field, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::{assert_color, tone_mapped};

pub const CASES: &[Case] = &[
    ("an_engine_can_have_its_own_pipeline", own_pipeline),
    ("blended_objects_are_drawn_back_to_front", back_to_front),
    ("parameters_change_from_frame_to_frame", parameters),
    ("a_raw_pass_writes_a_target", raw_pass),
    ("the_draws_of_a_process_may_change_from_frame_to_frame", other_draws),
    ("a_full_screen_pass_that_tests_depth_fills_the_background", behind_everything),
    ("blended_objects_hide_nothing_behind_them", blended_leaves_depth),
    ("exposure_scales_radiance", exposure),
    ("a_shader_that_does_not_compile_is_named", broken_shader),
    ("a_shader_without_its_entry_point_is_named_in_every_frame", missing_entry_point),
    ("too_few_parameters_are_named", short_parameters),
    ("a_pass_that_the_device_refuses_is_named", refused_pass),
    ("a_raw_pass_that_fails_or_panics_is_named", failing_raw_pass),
];

/// A process defined by its fields.
struct DataProcess {
    name: &'static str,
    declare: fn(&mut Declare),
    draws: fn() -> Draws<'static>,
}

impl RenderProcess for DataProcess {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        (self.declare)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        (self.draws)()
    }
}

const PLAIN_COLOR: &str = "
    struct Plain {
        @builtin(position) clip: vec4<f32>,
        @location(0) @interpolate(flat) material: u32,
    }

    @vertex
    fn vertex(in: VertexInput) -> Plain {
        let object = drawn_object(in.instance);
        return Plain(clip_position(relative_position(object, in.position)), object.material);
    }

    @fragment
    fn fragment(in: Plain) -> @location(0) vec4<f32> {
        let material = materials[in.material];
        return vec4<f32>(material.diffuse, material.opacity);
    }
";

fn plain_color(selection: Selection) -> Draws<'static> {
    Draws::Commands(CommandDraws { shader: PLAIN_COLOR, selection, ..CommandDraws::default() })
}

const PLAIN: DataProcess = DataProcess {
    name: "plain colour",
    declare: |declare| {
        declare.clears_color("plain", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 1.0, 1.0]));
        declare.clears_depth("plain depth", Format::Depth32Float);
    },
    draws: || plain_color(Selection::ALL),
};

fn panes(depths_and_blends: &[(f64, Vec3, Blend)]) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [32, 32])];
    let mesh = scene.add(square(Topology::TriangleList))?;
    for &(z, diffuse, blend) in depths_and_blends {
        let material = scene.add(Material { diffuse, blend, opacity: 0.5, ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::Z * z))?;
    }
    Ok(scene)
}

fn own_pipeline() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(PLAIN).output("plain"))?;
    let scene = panes(&[(0.0, Vec3::new(1.0, 0.5, 0.25), Blend::None)])?;
    let recorded = fixture.record(&scene)?;
    let picture = fixture.submit(recorded)?.read(0, "plain")?;
    assert_color(pixel(&picture, 16, 16), [255, 128, 64])?;
    assert_color(pixel(&picture, 0, 0), [0, 0, 255])
}

fn back_to_front() -> Result<(), Failed> {
    let glass = [
        (-1.0, Vec3::X, Blend::Alpha),
        (0.0, Vec3::Y, Blend::Alpha),
        (1.0, Vec3::new(0.0, 0.0, 0.5), Blend::Additive),
        (2.0, Vec3::new(0.0, 0.25, 0.0), Blend::Subtractive),
    ];
    // Over blue: half red over it, half green over that, then half a blue added, then a quarter of green subtracted.
    let expected = [64, 128 - 64, 64 + 128];
    for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2]] {
        let mut fixture = Fixture::with(2, |builder| builder.process(PLAIN).output("plain"))?;
        let scene = panes(&order.map(|index: usize| glass[index]))?;
        let recorded = fixture.record(&scene)?;
        let picture = fixture.submit(recorded)?.read(0, "plain")?;
        assert_color(pixel(&picture, 16, 16), expected)
            .map_err(|failed| format!("{order:?}: {}", failed.message().unwrap_or("")))?;
    }
    Ok(())
}

/// Fills a target with a grey value that changes.
struct Grey {
    percent: Arc<AtomicU32>,
}

impl RenderProcess for Grey {
    fn name(&self) -> &str {
        "grey"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("grey", Format::Rgba8Unorm, ClearColor::Background);
    }

    fn draws(&self) -> Draws<'_> {
        let value = self.percent.load(Ordering::Relaxed) as f32 / 100.0;
        Draws::FullScreen(FullScreen {
            shader: "
                @group(2) @binding(0) var<uniform> grey: vec4<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    return grey;
                }
            ",
            parameters: [value; 4].map(f32::to_le_bytes).concat().into(),
            ..FullScreen::default()
        })
    }
}

fn parameters() -> Result<(), Failed> {
    let percent = Arc::new(AtomicU32::new(0));
    let grey = Grey { percent: Arc::clone(&percent) };
    let mut fixture = Fixture::with(2, |builder| builder.process(grey).output("grey"))?;
    let scene = panes(&[])?;
    for value in [0, 20, 100] {
        percent.store(value, Ordering::Relaxed);
        let recorded = fixture.record(&scene)?;
        let picture = fixture.submit(recorded)?.read(0, "grey")?;
        assert_color(pixel(&picture, 3, 3), [(value * 255 / 100) as u8; 3])?;
    }
    Ok(())
}

/// The action of a raw pass in `encode`.
#[derive(Clone, Copy)]
enum Action {
    ClearYellow,
    Fail,
    Panic,
    InvalidCopy,
}

struct RawProcess {
    action: Action,
}

impl RenderProcess for RawProcess {
    fn name(&self) -> &str {
        "raw process"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.writes("raw", Format::Rgba8Unorm);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for RawProcess {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let target = resources.target("raw")?;
        match self.action {
            Action::ClearYellow => {
                let view = target.create_view(&wgpu::TextureViewDescriptor::default());
                let load = wgpu::LoadOp::Clear(wgpu::Color { r: 1.0, g: 1.0, b: 0.0, a: 1.0 });
                encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &view,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
                    })],
                    ..wgpu::RenderPassDescriptor::default()
                });
            }
            Action::Fail => return Err("the well is dry".into()),
            Action::Panic => panic!("the well is poisoned"),
            // Source and destination are the same texture.
            Action::InvalidCopy => {
                encoder.copy_texture_to_texture(target.as_image_copy(), target.as_image_copy(), target.size());
            }
        }
        Ok(())
    }
}

fn raw_pass() -> Result<(), Failed> {
    let mut fixture =
        Fixture::with(2, |builder| builder.process(RawProcess { action: Action::ClearYellow }).output("raw"))?;
    let recorded = fixture.record(&panes(&[])?)?;
    let picture = fixture.submit(recorded)?.read(0, "raw")?;
    assert_color(pixel(&picture, 5, 5), [255, 255, 0])
}

/// Changes the kind of its draws from frame to frame.
struct Changing {
    step: Arc<AtomicU32>,
}

impl RenderProcess for Changing {
    fn name(&self) -> &str {
        "changing"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("changing", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.5, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        let red =
            "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4(1.0, 0.0, 0.0, 0.5); }";
        let green =
            "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4(0.0, 1.0, 0.0, 0.5); }";
        match self.step.load(Ordering::Relaxed) {
            0 => Draws::FullScreen(FullScreen { shader: red, ..FullScreen::default() }),
            1 => Draws::FullScreen(FullScreen { shader: green, ..FullScreen::default() }),
            2 => Draws::FullScreen(FullScreen { shader: red, blend: Blend::Additive, ..FullScreen::default() }),
            _ => plain_color(Selection::OPAQUE),
        }
    }
}

fn other_draws() -> Result<(), Failed> {
    let step = Arc::new(AtomicU32::new(0));
    let changing = Changing { step: Arc::clone(&step) };
    let mut fixture = Fixture::with(2, |builder| builder.process(changing).output("changing"))?;
    let scene = panes(&[(0.0, Vec3::ONE, Blend::None)])?;
    let expected = [
        ([255, 0, 0], [255, 0, 0]),
        ([0, 255, 0], [0, 255, 0]),
        ([255, 0, 128], [255, 0, 128]),
        ([255; 3], [0, 0, 128]),
    ];
    for (index, (middle, corner)) in
        [(0, expected[0]), (1, expected[1]), (2, expected[2]), (3, expected[3]), (0, expected[0])]
    {
        step.store(index, Ordering::Relaxed);
        let recorded = fixture.record(&scene)?;
        let picture = fixture.submit(recorded)?.read(0, "changing")?;
        assert_color(pixel(&picture, 16, 16), middle)?;
        assert_color(pixel(&picture, 0, 0), corner)?;
    }
    Ok(())
}

fn behind_everything() -> Result<(), Failed> {
    let sky = DataProcess {
        name: "sky",
        declare: |declare| {
            declare.draws_over("plain");
            declare.tests_depth("plain depth");
        },
        draws: || {
            Draws::FullScreen(FullScreen {
                shader: "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4(1.0); }",
                ..FullScreen::default()
            })
        },
    };
    let mut fixture = Fixture::with(2, |builder| builder.process(PLAIN).process(sky).output("plain"))?;
    let recorded = fixture.record(&panes(&[(0.0, Vec3::X, Blend::None)])?)?;
    let picture = fixture.submit(recorded)?.read(0, "plain")?;
    assert_color(pixel(&picture, 16, 16), [255, 0, 0])?;
    assert_color(pixel(&picture, 0, 0), [255; 3])
}

fn blended_leaves_depth() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(PLAIN).output("plain depth").output("plain"))?;
    let recorded = fixture.record(&panes(&[(0.0, Vec3::X, Blend::Alpha)])?)?;
    let depth = fixture.submit(recorded)?.read(0, "plain depth")?;
    let untouched = depth.bytes.iter().all(|&byte| byte == 0);
    if untouched { Ok(()) } else { Err("glass wrote its depth".into()) }
}

fn exposure() -> Result<(), Failed> {
    let mut scene = panes(&[])?;
    scene.background = Vec3::splat(0.1);
    let exposure = Exposure::new(1.0);
    let tone_mapping = ToneMapping::new(exposure.clone());
    let mut alone = Fixture::with(2, |builder| {
        builder.process(GeometryBuffer::new(GeometryFormats::default())).process(tone_mapping).output("picture")
    })?;
    let step = ToneMapping::new(exposure.clone());
    let mut deferred = Fixture::with(2, |builder| builder.pipeline(Deferred::new().post(step)))?;
    for value in [0.5, 1.0, 4.0] {
        exposure.set(value);
        let expected = tone_mapped([0.1 * f64::from(value); 3]);
        assert_color(pixel(&alone.draw(&scene)?, 3, 3), expected)?;
        assert_color(pixel(&deferred.draw(&scene)?, 3, 3), expected)?;
    }
    Ok(())
}

fn missing_entry_point() -> Result<(), Failed> {
    for draws in
        [(|| Draws::FullScreen(FullScreen { shader: "", ..FullScreen::default() })) as fn() -> Draws<'static>, || {
            let shader = PLAIN_COLOR;
            Draws::Commands(CommandDraws { shader, fragment: Some("fragmnet"), ..CommandDraws::default() })
        }]
    {
        let no_entry_point = DataProcess {
            name: "nameless",
            declare: |declare| declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background),
            draws,
        };
        let error = error_of(Fixture::with(2, |builder| builder.process(no_entry_point).output("picture"))?)?;
        expect_named(&error, "nameless", "entry point")?;
    }
    Ok(())
}

fn short_parameters() -> Result<(), Failed> {
    let short = DataProcess {
        name: "short",
        declare: |declare| declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background),
        draws: || {
            Draws::FullScreen(FullScreen {
                shader: "
                    @group(2) @binding(0) var<uniform> wide: mat4x4<f32>;

                    @fragment
                    fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                        return wide[3];
                    }
                ",
                parameters: vec![0; 16].into(),
                ..FullScreen::default()
            })
        },
    };
    let error = error_of(Fixture::with(2, |builder| builder.process(short).output("picture"))?)?;
    expect_named(&error, "short", "size")
}

fn error_of(mut fixture: Fixture) -> Result<FrameError, Failed> {
    let mut scene = field(600);
    scene.cameras.truncate(1);
    let first = fixture.renderer.record(scene.as_scene_ref()).err().ok_or("the first frame should fail")?;
    // A second attempt fails the same way, rather than hanging or passing.
    let second = fixture.renderer.record(scene.as_scene_ref()).err().ok_or("the second frame should fail")?;
    if first.to_string() == second.to_string() { Ok(first) } else { Err(format!("{first} / {second}").into()) }
}

fn expect_named(error: &FrameError, process: &str, detail: &str) -> Result<(), Failed> {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    let named = text.contains(process) && text.contains(detail);
    if named { Ok(()) } else { Err(format!("{text:?} should name {process:?} and {detail:?}").into()) }
}

fn broken_shader() -> Result<(), Failed> {
    let broken = DataProcess {
        name: "broken shader",
        declare: |declare| declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background),
        draws: || Draws::FullScreen(FullScreen { shader: "fn fragment( {", ..FullScreen::default() }),
    };
    let error = error_of(Fixture::with(2, |builder| builder.process(broken).output("picture"))?)?;
    expect_named(&error, "broken shader", "fragment")
}

fn refused_pass() -> Result<(), Failed> {
    // It reads the target that it draws into.
    let refused = DataProcess {
        name: "ouroboros",
        declare: |declare| {
            declare.clears_color("tail", Format::Rgba8Unorm, ClearColor::Background);
            declare.samples("tail");
        },
        draws: || {
            Draws::FullScreen(FullScreen {
                shader: "
                    @group(2) @binding(1) var tail: texture_2d<f32>;

                    @fragment
                    fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                        return textureLoad(tail, vec2<i32>(0, 0), 0);
                    }
                ",
                ..FullScreen::default()
            })
        },
    };
    let first_writer = DataProcess {
        name: "head",
        declare: |declare| declare.clears_color("tail", Format::Rgba8Unorm, ClearColor::Background),
        draws: || plain_color(Selection::OPAQUE),
    };
    let fixture = Fixture::with(2, |builder| builder.process(first_writer).process(refused).output("tail"))?;
    expect_named(&error_of(fixture)?, "ouroboros", "finish")?;

    let invalid = RawProcess { action: Action::InvalidCopy };
    let fixture = Fixture::with(2, |builder| builder.process(invalid).output("raw"))?;
    expect_named(&error_of(fixture)?, "raw process", "refused")
}

fn failing_raw_pass() -> Result<(), Failed> {
    let fail = Fixture::with(2, |builder| builder.process(RawProcess { action: Action::Fail }).output("raw"))?;
    let error = error_of(fail)?;
    expect_named(&error, "raw process", "the well is dry")?;
    let FrameError::Failed { source, .. } = &error else { return Err(format!("{error:?}").into()) };
    if source.downcast_ref::<BackendError>().is_none() {
        return Err("the backend's error is lost".into());
    }
    let panics = Fixture::with(2, |builder| builder.process(RawProcess { action: Action::Panic }).output("raw"))?;
    expect_named(&error_of(panics)?, "raw process", "the well is poisoned")
}
