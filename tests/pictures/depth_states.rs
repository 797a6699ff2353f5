//! How a process compares and moves depth, and which channels it writes.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::SoftwareBackend;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, ColorMask, CommandDraws, Comparison, CpuShader, Declare, DepthBias, Draws, Format, ObjectCpuShader,
    ObjectPixel, PassInputs, PipelineState, RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::quality::Quality;
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, LayerMask, Material, RenderObject, Scene, SceneRef, Topology};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};

pub const CASES: &[Case] = &[
    ("a_process_compares_depth_as_it_says", comparisons),
    ("what_shows_where_it_is_hidden_is_not_culled", hidden),
    ("a_depth_bias_moves_surfaces_nearer_or_farther", bias),
    ("depth_is_cleared_to_the_value_that_a_process_says", cleared_depth),
    ("masked_channels_stay_as_they_are", color_masks),
    ("alpha_decides_how_much_of_a_pixel_is_covered", alpha_to_coverage),
    ("states_that_are_wrong_or_not_there_are_named", refused),
];

const WALL: LayerMask = LayerMask::layer(0);
const SIGN: LayerMask = LayerMask::layer(1);

/// Draws the objects of a layer in one colour: the wall first, then signs with a state of their own.
#[derive(Clone)]
struct Painted {
    layer: LayerMask,
    state: PipelineState,
    is_multisampled: bool,
    clears_depth_to: Option<f32>,
}

impl Painted {
    fn wall() -> Self {
        Self { layer: WALL, state: PipelineState::default(), is_multisampled: false, clears_depth_to: None }
    }

    fn sign(state: PipelineState) -> Self {
        Self { layer: SIGN, state, ..Self::wall() }
    }
}

impl RenderProcess for Painted {
    fn name(&self) -> &str {
        if self.layer == WALL { "wall" } else { "sign" }
    }

    fn declare(&self, declare: &mut Declare) {
        if self.layer == WALL {
            declare.clears_color("color", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
            declare.clears_depth("depth", Format::Depth32Float);
            if let Some(value) = self.clears_depth_to {
                declare.clears_depth_to(value);
            }
            if self.is_multisampled {
                declare.multisampled("color");
                declare.multisampled("depth");
            }
        } else {
            declare.draws_over("color");
            declare.draws_depth("depth");
            declare.after("wall");
            if self.is_multisampled {
                declare.resolves("color", "resolved", Format::Rgba8Unorm);
            }
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                @vertex
                fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
                    return clip_position(relative_position(drawn_object(in.instance), in.position));
                }

                @fragment
                fn wall() -> @location(0) vec4<f32> {
                    return vec4<f32>(1.0, 0.0, 0.0, 1.0);
                }

                @fragment
                fn sign() -> @location(0) vec4<f32> {
                    return vec4<f32>(0.0, 1.0, 1.0, 0.5);
                }
            ",
            fragment: Some(self.name()),
            selection: Selection::ALL.in_layers(self.layer),
            pipeline_state: self.state.clone(),
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(Green))
    }
}

struct Green;

impl<R: Real> ObjectCpuShader<R> for Green {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, _: &PassInputs<'_, R>, _: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets.fill(Vector([0.0, 1.0, 0.0, 1.0].map(R::of)));
        true
    }
}

/// A wall across the picture at z = 0, and signs of a hundredth of its size at these distances in front of it, side by
/// side from the left.
fn signs(distances: &[f64]) -> Result<(Scene, Vec<LayerMask>), Failed> {
    let mut scene = Scene::new();
    let camera = Camera::looking_at("main", DVec3::Z * 2.0, DVec3::ZERO);
    scene.cameras = vec![sized(camera, [16 * distances.len() as u32, 16])];
    let mesh = scene.add(square(Topology::TriangleList))?;
    let material = scene.add(Material { double_sided: true, ..Material::default() })?;
    let mut layers = vec![WALL];
    scene.add_object(RenderObject { scale: Vec3::splat(20.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
    let view = scene.cameras[0].clone();
    for (index, distance) in distances.iter().enumerate() {
        // The middle of a column of the picture.
        let across = 2.0 * (index as f64 + 0.5) / distances.len() as f64 - 1.0;
        let drawloom::scene::Projection::Perspective { field_of_view } = view.projection else {
            return Err("the camera has a perspective".into());
        };
        let half_width = (f64::from(field_of_view) / 2.0).tan() * distances.len() as f64;
        let place = DVec3::new(across * half_width * (2.0 - distance), 0.0, *distance);
        scene.add_object(RenderObject { scale: Vec3::splat(0.2), ..RenderObject::new(mesh, material, place) })?;
        layers.push(SIGN);
    }
    Ok((scene, layers))
}

/// Which signs are seen.
fn seen(distances: &[f64], state: PipelineState) -> Result<Vec<bool>, Failed> {
    let (scene, layers) = signs(distances)?;
    let sign = Painted::sign(state);
    let mut fixture = Fixture::with(2, |builder| builder.process(Painted::wall()).process(sign).output("color"))?;
    let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
    let picture = fixture.submit(recorded)?.read(0, "color")?;
    Ok((0..distances.len() as u32).map(|column| pixel(&picture, 16 * column + 8, 8)[1] > 0).collect())
}

fn comparisons() -> Result<(), Failed> {
    // Nearer than the wall, on it, and behind it.
    let distances = [0.5, 0.0, -0.5];
    for (comparison, expected) in [
        (None, [true, false, false]),
        (Some(Comparison::Greater), [true, false, false]),
        (Some(Comparison::GreaterEqual), [true, true, false]),
        (Some(Comparison::Equal), [false, true, false]),
        (Some(Comparison::LessEqual), [false, true, true]),
        (Some(Comparison::Less), [false, false, true]),
        (Some(Comparison::NotEqual), [true, false, true]),
        (Some(Comparison::Always), [true, true, true]),
        (Some(Comparison::Never), [false, false, false]),
    ] {
        let found = seen(&distances, PipelineState { depth_comparison: comparison, ..PipelineState::default() })?;
        if found != expected {
            return Err(format!("{comparison:?}: {found:?}, not {expected:?}").into());
        }
    }
    Ok(())
}

/// With occlusion tests in every frame, if there are any in this build: a box far behind another one.
fn hidden() -> Result<(), Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 10.0, DVec3::ZERO), [64, 64])];
    let (mesh, material) = (scene.add(cube())?, scene.add(Material::default())?);
    let wall = RenderObject { scale: Vec3::new(9.0, 9.0, 1.0), ..RenderObject::new(mesh, material, DVec3::ZERO) };
    scene.add_object(wall)?;
    scene.add_object(RenderObject::new(mesh, material, DVec3::Z * -20.0))?;
    let layers = [WALL, SIGN];
    let nearer = DepthBias { constant: 1 << 28, slope: 0.0, clamp: 0.0 };
    for (state, is_seen) in [
        (PipelineState::default(), false),
        (PipelineState { depth_comparison: Some(Comparison::Less), ..PipelineState::default() }, true),
        (PipelineState { depth_bias: nearer, ..PipelineState::default() }, true),
    ] {
        let sign = Painted::sign(state.clone());
        let mut fixture = Fixture::with(2, |builder| {
            builder
                .process(Painted::wall())
                .process(sign)
                .output("color")
                .quality(Quality { occlusion: Some(1), ..Quality::balanced() })
        })?;
        for frame in 0..12 {
            let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
            let picture = fixture.submit(recorded)?.read(0, "color")?;
            if (pixel(&picture, 32, 32)[1] > 0) != is_seen {
                return Err(format!("frame {frame} with {state:?}: seen is not {is_seen}").into());
            }
        }
    }
    Ok(())
}

fn bias() -> Result<(), Failed> {
    let biased = |constant, slope| PipelineState {
        depth_bias: DepthBias { constant, slope, clamp: 0.0 },
        ..PipelineState::default()
    };
    // On the wall, and a little behind it.
    let distances = [0.0, -1e-4];
    for (constant, expected) in
        [(0, [false, false]), (64, [true, false]), (1 << 20, [true, true]), (-64, [false, false])]
    {
        let found = seen(&distances, biased(constant, 0.0))?;
        if found != expected {
            return Err(format!("{constant}: {found:?}, not {expected:?}").into());
        }
    }
    // A clamp limits it.
    let clamped = DepthBias { constant: 1 << 20, slope: 0.0, clamp: 1e-6 };
    let found = seen(&distances, PipelineState { depth_bias: clamped, ..PipelineState::default() })?;
    if found == [true, false] { Ok(()) } else { Err(format!("with a clamp: {found:?}").into()) }
}

fn color_masks() -> Result<(), Failed> {
    let (scene, layers) = signs(&[0.5])?;
    let green = ColorMask { green: true, ..ColorMask::NONE };
    for (masks, expected) in [
        (vec![], [0, 255, 255, 128]),
        (vec![ColorMask::ALL], [0, 255, 255, 128]),
        (vec![ColorMask::COLOR], [0, 255, 255, 255]),
        (vec![green], [255, 255, 0, 255]),
        (vec![ColorMask::NONE], [255, 0, 0, 255]),
    ] {
        let sign = Painted::sign(PipelineState { color_masks: masks.clone(), ..PipelineState::default() });
        let mut fixture = Fixture::with(2, |builder| builder.process(Painted::wall()).process(sign).output("color"))?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
        let picture = fixture.submit(recorded)?.read(0, "color")?;
        let found = &picture.bytes[(8 * 16 + 8) * 4..][..4];
        if found.iter().zip(expected).any(|(found, expected): (&u8, u8)| found.abs_diff(expected) > 1) {
            return Err(format!("{masks:?}: {found:?}, not {expected:?}").into());
        }
    }
    Ok(())
}

/// Half of the samples of a pixel show the sign, whose alpha is a half, and the others the wall.
fn alpha_to_coverage() -> Result<(), Failed> {
    let (scene, layers) = signs(&[0.5])?;
    for (alpha_to_coverage, expected) in [(false, [0, 255, 255]), (true, [128, 128, 128])] {
        let state = PipelineState { alpha_to_coverage, ..PipelineState::default() };
        let wall = Painted { is_multisampled: true, ..Painted::wall() };
        let sign = Painted { is_multisampled: true, ..Painted::sign(state) };
        let mut fixture = Fixture::with(2, |builder| builder.process(wall).process(sign).output("resolved"))?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
        let picture = fixture.submit(recorded)?.read(0, "resolved")?;
        let found = pixel(&picture, 8, 8);
        if found.iter().zip(expected).any(|(found, expected): (&u8, u8)| found.abs_diff(expected) > 1) {
            return Err(format!("{alpha_to_coverage}: {found:?}, not {expected:?}").into());
        }
    }
    Ok(())
}

/// A wall that is drawn where its depth is less than what is there: over 1, not over 0; and values that are refused.
fn cleared_depth() -> Result<(), Failed> {
    let (scene, layers) = signs(&[0.5])?;
    let scene = SceneRef { layers: &layers, ..scene.as_scene_ref() };
    let state = PipelineState { depth_comparison: Some(Comparison::Less), ..PipelineState::default() };
    let wall = |value| Painted { state: state.clone(), clears_depth_to: value, ..Painted::wall() };
    for (value, expected) in [(Some(1.0), [255, 0, 0]), (Some(0.0), [0; 3]), (None, [0; 3])] {
        let mut fixture = Fixture::with(2, |builder| builder.process(wall(value)).output("color"))?;
        let recorded = fixture.renderer.record(scene)?;
        let picture = fixture.submit(recorded)?.read(0, "color")?;
        let found = pixel(&picture, picture.width / 2, picture.height / 2);
        assert_eq!(found, expected, "{value:?}");
    }
    for (value, expected) in [
        (1.5, "process \"wall\" cannot clear depth to 1.5: it is not from 0 to 1"),
        (-0.1, "process \"wall\" cannot clear depth to -0.1: it is not from 0 to 1"),
        (f32::NAN, "process \"wall\" cannot clear depth to NaN: it is not from 0 to 1"),
    ] {
        let built = Fixture::with(1, |builder| builder.process(wall(Some(value))).output("color"));
        assert_eq!(built.err().ok_or("it is built")?.message().unwrap_or_default(), expected);
    }
    Ok(())
}

fn refused() -> Result<(), Failed> {
    let (scene, layers) = signs(&[0.5])?;
    let with_masks = |count| PipelineState { color_masks: vec![ColorMask::ALL; count], ..PipelineState::default() };
    let steep = |slope, clamp| PipelineState {
        depth_bias: DepthBias { constant: 0, slope, clamp },
        ..PipelineState::default()
    };
    for (state, text) in [
        (with_masks(2), "process \"sign\" has 2 colour masks for 1 colour targets"),
        (steep(f32::NAN, 0.0), "the depth bias of process \"sign\" is not finite"),
        (steep(0.0, f32::INFINITY), "the depth bias of process \"sign\" is not finite"),
    ] {
        let sign = Painted::sign(state);
        let mut fixture = Fixture::with(2, |builder| builder.process(Painted::wall()).process(sign).output("color"))?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() });
        let error = recorded.err().ok_or("it is drawn")?.to_string();
        if !error.contains(text) {
            return Err(error.into());
        }
    }
    let scheduler = Arc::new(Scheduler::new(1)?);
    let sign = Painted::sign(with_masks(1));
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let (mut renderer, _) = builder.process(Painted::wall()).process(sign).output("color").build(scheduler)?;
    let recorded = renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() });
    let error = recorded.err().ok_or("the software backend draws it")?.to_string();
    if error.contains("sign") && error.contains("masks") { Ok(()) } else { Err(error.into()) }
}
