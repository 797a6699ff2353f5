//! Multisampled targets.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    BlendEquation, ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, FullScreen, ObjectCpuShader,
    ObjectPixel, PassInputs, RawPass, RawPassResources, RenderProcess, ShaderObject, VARYINGS, VertexInput,
    VertexOutput,
};
use drawloom::quality::Quality;
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, Material, Projection, RenderObject, Scene, Topology};
use drawloom::task::Scheduler;
use drawloom::{BuildError, Renderer, wgpu};
use drawloom_testing::scenes::{as_list, culled, field, sized, square, with_meshes};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, pixel};
use crate::strategies::{expect, many_batches, strategies};

pub const CASES: &[Case] = &[
    ("an_edge_through_the_middle_of_pixels_covers_half_of_their_samples", half_covered),
    ("resolved_samples_are_the_mean_of_those_that_shaders_read", mean),
    ("every_strategy_draws_the_same_samples", every_strategy),
    ("culling_leaves_what_covers_a_sample_but_no_centre", between_centres),
    ("targets_that_cannot_be_multisampled_or_resolved_are_named", misdeclared),
    ("a_raw_pass_may_change_a_multisampled_target", raw),
    ("an_import_in_the_place_of_a_resolved_target_is_drawn_into", imported),
    ("the_software_backend_names_processes_with_multisampled_targets", on_software),
];

/// Draws all objects in the colour of their index.
#[derive(Clone, Copy)]
struct Numbered {
    multisampled: bool,
}

impl RenderProcess for Numbered {
    fn name(&self) -> &str {
        "numbered"
    }

    fn declare(&self, declare: &mut Declare) {
        let (black, format) = (ClearColor::Value([0.0, 0.0, 0.0, 1.0]), Format::Rgba8Unorm);
        if self.multisampled {
            declare.clears_color("multisampled colour", format, black);
            declare.clears_depth("multisampled depth", Format::Depth32Float);
            declare.multisampled("multisampled colour");
            declare.multisampled("multisampled depth");
            declare.resolves("multisampled colour", "numbers", format);
        } else {
            declare.clears_color("numbers", format, black);
            declare.clears_depth("depth of numbers", Format::Depth32Float);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) @interpolate(flat) object: u32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), object.index);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return vec4<f32>(1.0, f32(in.object % 16u) / 15.0, f32(in.object / 16u % 16u) / 15.0, 1.0);
            }
        ";
        // So that blended objects cover what they draw, too.
        let blend_equations = vec![BlendEquation::REPLACE];
        Draws::Commands(CommandDraws { shader, selection: Selection::ALL, blend_equations, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Numbered {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, _: &PassInputs<'_, R>, _: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = Vector([R::one(); 4]);
        true
    }
}

/// The mean of the samples, as a shader reads them, and the share of them that have depth.
struct Mean;

impl RenderProcess for Mean {
    fn name(&self) -> &str {
        "mean"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("multisampled colour");
        declare.samples("multisampled depth");
        declare.clears_color("mean", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_color("covered", Format::R8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var samples: texture_multisampled_2d<f32>;
            @group(2) @binding(2) var depths: texture_depth_multisampled_2d;

            struct Colors {
                @location(0) mean: vec4<f32>,
                @location(1) covered: vec4<f32>,
            }

            @fragment
            fn fragment(in: FullScreenPixel) -> Colors {
                let at = vec2<i32>(in.position.xy);
                var sum = vec4<f32>(0.0);
                var covered = 0.0;
                for (var index = 0; index < 4; index++) {
                    sum += textureLoad(samples, at, index);
                    covered += select(0.0, 1.0, textureLoad(depths, at, index) > 0.0);
                }
                return Colors(sum / 4.0, vec4<f32>(covered / 4.0));
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn read<const T: usize>(fixture: &mut Fixture, scene: &Scene, targets: [&str; T]) -> Result<[Picture; T], Failed> {
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    let pictures = targets.map(|target| submission.read(0, target));
    if let Some(error) = pictures.iter().find_map(|picture| picture.as_ref().err()) {
        return Err(error.to_string().into());
    }
    Ok(pictures.map(Result::unwrap))
}

fn fixture(multisampled: bool, quality: Quality) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.process(Numbered { multisampled }).output("numbers").quality(quality))
}

/// A square of 8 × 8 m in an orthographic view in which a pixel is 1 m wide.
fn in_meters(position: DVec3) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let camera = Camera::looking_at("plan", DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO);
    scene.cameras = vec![sized(
        Camera { projection: Projection::Orthographic { height: 16.0 }, near: 0.1, far: 20.0, ..camera },
        [16, 16],
    )];
    let (mesh, material) = (scene.add(square(Topology::TriangleList))?, scene.add(Material::default())?);
    let object = RenderObject::new(mesh, material, position);
    scene.add_object(RenderObject { scale: Vec3::splat(4.0), ..object })?;
    Ok(scene)
}

fn half_covered() -> Result<(), Failed> {
    let mut fixture = fixture(true, Quality::balanced())?;
    let [picture] = read(&mut fixture, &in_meters(DVec3::new(0.5, 0.5, 0.0))?, ["numbers"])?;
    // The square reaches from 4.5 to 12.5 pixels from the left, and from 3.5 to 11.5 from the top.
    let reds = |row: u32| (0..16).map(|column| pixel(&picture, column, row)[0]).collect::<Vec<_>>();
    let mut expected = vec![0; 16];
    expected[5..12].fill(255);
    (expected[4], expected[12]) = (128, 128);
    let close =
        |found: &[u8], expected: &[u8]| found.iter().zip(expected).all(|(one, other)| one.abs_diff(*other) <= 1);
    expect(close(&reds(7), &expected), || format!("{:?}", reds(7)))?;
    let halved: Vec<_> = expected.iter().map(|value| if *value == 255 { 128 } else { *value }).collect();
    let [top, bottom] = [3, 11].map(|row| reds(row)[5..12].to_vec());
    expect(close(&top, &halved[5..12]) && close(&bottom, &halved[5..12]), || format!("{top:?} {bottom:?}"))?;
    expect(reds(2).iter().all(|value| *value == 0), || "above the square".into())
}

fn mean() -> Result<(), Failed> {
    let process = Numbered { multisampled: true };
    let mut fixture = Fixture::with(2, |builder| {
        builder.process(process).process(Mean).output("numbers").output("mean").output("covered")
    })?;
    let [resolved, mean, covered] = read(&mut fixture, &field(150), ["numbers", "mean", "covered"])?;
    let close = |(one, other): (&u8, &u8)| one.abs_diff(*other) <= 1;
    expect(resolved.bytes.iter().zip(&mean.bytes).all(close), || "the mean differs".into())?;
    let shares: Vec<_> = covered.bytes.iter().map(|byte| (f64::from(*byte) / 63.75).round() as usize).collect();
    let count = |share| shares.iter().filter(|found| **found == share).count();
    expect((0..5).all(|share| count(share) > 20), || format!("{:?}", [0, 1, 2, 3, 4].map(count)))?;
    // Where no sample has depth there is the background, and elsewhere red is the share.
    let reds = resolved.bytes.chunks_exact(4).map(|pixel| (f64::from(pixel[0]) / 63.75).round() as usize);
    expect(reds.eq(shares), || "depth and colour cover other samples".into())?;
    let size = fixture.renderer.backend().resources().target_bytes;
    let pixels = 320 * 180 + 200 * 200;
    expect(size == pixels * (4 * 8 + 4 + 4 + 1), || format!("{size} bytes of {pixels} pixels"))
}

fn every_strategy() -> Result<(), Failed> {
    // So many batches that passes are split.
    let mut scene = many_batches();
    scene.cameras.truncate(1);
    let [expected] = read(&mut fixture(true, Quality::balanced())?, &scene, ["numbers"])?;
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let builder = Renderer::builder(backend).process(Numbered { multisampled: true }).output("numbers");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut fixture = Fixture { renderer, submitter };
        for frame in 0..2 {
            let [found] = read(&mut fixture, &scene, ["numbers"])?;
            expect(found == expected, || format!("frame {frame} of {recording:?} and {encoding:?} differs"))?;
        }
    }
    Ok(())
}

/// A wall with a slit that shows no pixel's centre, what is behind it, and squares that are smaller than a pixel.
fn slit(has_back: bool) -> Result<Scene, Failed> {
    let mut scene = in_meters(DVec3::new(-3.45, 0.0, 5.0))?;
    let (mesh, material) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
    let mut add = |x: f64, y: f64, z: f64, scale| {
        let object = RenderObject::new(mesh, material, DVec3::new(x, y, z));
        scene.add_object(RenderObject { scale, ..object }).map(drop)
    };
    add(4.75, 0.0, 5.0, Vec3::splat(4.0))?;
    if has_back {
        add(0.5, 0.0, 0.0, Vec3::new(0.4, 3.0, 1.0))?;
    }
    for number in 0..20 {
        add(-7.9 + 0.31 * f64::from(number), 6.13 + 0.07 * f64::from(number), 8.0, Vec3::splat(0.2))?;
    }
    Ok(with_meshes(scene, as_list))
}

fn between_centres() -> Result<(), Failed> {
    let plain = || Quality { occlusion: None, ..Quality::balanced() };
    let expected = read(&mut fixture(true, plain())?, &slit(true)?, ["numbers"])?;
    let without = read(&mut fixture(true, plain())?, &slit(false)?, ["numbers"])?;
    let reds = |picture: &Picture| picture.bytes.chunks_exact(4).map(|pixel| pixel[0]).collect::<Vec<_>>();
    expect(expected != without && reds(&expected[0]) != reds(&without[0]), || {
        "nothing is seen through the slit".into()
    })?;
    for occlusion in [None, Some(1), Some(16)] {
        let quality = Quality { occlusion, ..plain() };
        let found = read(&mut fixture(true, quality)?, &with_meshes(slit(true)?, culled), ["numbers"])?;
        expect(found == expected, || format!("with occlusion tests of {occlusion:?} it differs"))?;
    }
    Ok(())
}

/// Declares what no plan can have.
struct Declaring(fn(&mut Declare));

impl RenderProcess for Declaring {
    fn name(&self) -> &str {
        "declaring"
    }

    fn declare(&self, declare: &mut Declare) {
        (self.0)(declare);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

/// A raw pass that clears the multisampled colour to green.
struct Green;

impl RenderProcess for Green {
    fn name(&self) -> &str {
        "green"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes("multisampled colour");
        declare.before("mean");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for Green {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let target = resources.target("multisampled colour")?;
        let view = target.create_view(&wgpu::TextureViewDescriptor::default());
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::GREEN), store: wgpu::StoreOp::Store };
        let attachment = wgpu::RenderPassColorAttachment { view: &view, depth_slice: None, resolve_target: None, ops };
        let color_attachments = [Some(attachment)];
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &color_attachments,
            ..wgpu::RenderPassDescriptor::default()
        });
        Ok(())
    }
}

fn raw() -> Result<(), Failed> {
    let numbered = Numbered { multisampled: true };
    let mut fixture =
        Fixture::with(2, |builder| builder.process(numbered).process(Green).process(Mean).output("mean"))?;
    let [mean] = read(&mut fixture, &in_meters(DVec3::ZERO)?, ["mean"])?;
    let is_green = mean.bytes.chunks_exact(4).all(|pixel| pixel == [0, 255, 0, 255]);
    expect(is_green, || "it is not green".into())
}

fn imported() -> Result<(), Failed> {
    let scene = in_meters(DVec3::ZERO)?;
    let mut fixture = fixture(true, Quality::balanced())?;
    let [expected] = read(&mut fixture, &scene, ["numbers"])?;
    let texture = |usage| {
        fixture.renderer.backend().device().create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 16, height: 16, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage,
            view_formats: &[],
        })
    };
    let (copied, drawn) = (wgpu::TextureUsages::COPY_SRC, wgpu::TextureUsages::RENDER_ATTACHMENT);
    let [fits, misfits] = [texture(copied | drawn), texture(copied)];
    fixture.renderer.backend().import_target("plan", "numbers", misfits);
    let refused = fixture.renderer.record(scene.as_scene_ref()).err().map(|error| error.to_string());
    expect(refused.is_some_and(|error| error.contains("lacks the usage")), || "the misfit is taken".into())?;
    fixture.renderer.backend().import_target("plan", "numbers", fits);
    let [found] = read(&mut fixture, &scene, ["numbers"])?;
    expect(found == expected, || "it differs".into())
}

fn misdeclared() -> Result<(), Failed> {
    const FORMAT: Format = Format::Rgba8Unorm;
    fn clears(declare: &mut Declare, target: &str) {
        declare.clears_color(target, FORMAT, ClearColor::Background);
    }
    type Case = (fn(&mut Declare), &'static str);
    let cases: [Case; 11] = [
        (|declare| declare.multisampled("other"), "it does not clear it"),
        (
            |declare| {
                declare.clears_color("one", Format::R32Float, ClearColor::Background);
                declare.multisampled("one");
            },
            "multisamples its format",
        ),
        (
            |declare| {
                clears(declare, "one");
                clears(declare, "two");
                declare.multisampled("two");
            },
            "only one of them",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.multisampled("one");
                declare.samples_previous("one");
            },
            "no history",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.resolves("one", "two", FORMAT);
            },
            "it is not multisampled",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.multisampled("one");
                declare.resolves("one", "two", Format::Rgba16Float);
            },
            "has another format or size",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.multisampled("one");
                declare.resolves("one", "two", FORMAT);
                declare.size("two", drawloom::process::TargetSize::Divided(2));
            },
            "has another format or size",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.multisampled("one");
                declare.resolves("one", "two", FORMAT);
                declare.resolves("one", "three", FORMAT);
            },
            "resolves it twice",
        ),
        (
            |declare| {
                for target in ["one", "other"] {
                    clears(declare, target);
                    declare.multisampled(target);
                    declare.resolves(target, "two", FORMAT);
                }
            },
            "another one into the same target",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.multisampled("one");
                declare.resolves("other", "two", FORMAT);
            },
            "does not draw into it",
        ),
        (
            |declare| {
                clears(declare, "one");
                declare.resolves("one", "two", Format::R32Uint);
            },
            "resolves its format",
        ),
    ];
    for (declare, part) in cases {
        let backend = drawloom::backend::NullBackend;
        let built = Renderer::builder(backend).process(Declaring(declare)).build(Arc::new(Scheduler::new(1)?));
        match built.map(drop) {
            Err(BuildError::Plan(error)) if error.to_string().contains(part) => {
                expect(error.to_string().contains("\"declaring\""), || error.to_string())?;
            }
            other => return Err(format!("{other:?} without {part:?}").into()),
        }
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let builder = builder.process(Numbered { multisampled: true }).output("numbers");
    let (mut renderer, _) = builder.build(scheduler)?;
    let message = renderer.record(field(3).as_scene_ref()).err().map(|error| error.to_string()).unwrap_or_default();
    expect(message.contains("numbered") && message.contains("multisampled targets"), || format!("{message:?}"))
}
