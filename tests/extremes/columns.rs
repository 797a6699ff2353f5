//! Columns of the engine's own, and targets of its own, in which shaders find and leave extreme numbers.

use std::sync::Arc;

use drawloom::FrameError;
use drawloom::backend::{BackendError, Picture};
use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, ObjectCpuShader, ObjectPixel, PassInputs,
    RenderProcess, ShaderObject, TargetSize, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::quality::Quality;
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, ObjectColumn, SceneRef};
use libtest_mimic::Failed;

use crate::Case;
use crate::derived::camera_at;
use crate::error_table::{EXTREMES, Extreme, TOUCHING, UNIT_ROUNDOFF, expect_within};
use crate::harness::{BackendName, Harness, Outcome, Setup};
use crate::markers::{Marker, MarkerScene};

pub const CASES: &[Case] =
    &[("targets_hold_what_columns_say", columns), ("targets_of_any_size_are_drawn_or_refused_by_name", sizes)];

const NUMBERS: ObjectColumn<[f32; 4]> = ObjectColumn::new("numbers");
const WORDS: ObjectColumn<u32> = ObjectColumn::new("words");
const TARGETS: [&str; 2] = ["numbers of objects", "words of objects"];

/// Draws what columns say of an object into targets that round nothing.
#[derive(Clone, Copy, Debug, Default)]
struct Numbers {
    size: TargetSize,
}

impl RenderProcess for Numbers {
    fn name(&self) -> &str {
        "numbers"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(TARGETS[0], Format::Rgba32Float, ClearColor::Value([0.0; 4]));
        declare.clears_color(TARGETS[1], Format::R32Uint, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth of numbers", Format::Depth32Float);
        TARGETS.into_iter().chain(["depth of numbers"]).for_each(|target| declare.size(target, self.size));
        declare.reads_column(NUMBERS);
        declare.reads_column(WORDS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(3) @binding(0) var<storage, read> numbers: array<vec4<f32>>;
            @group(3) @binding(1) var<storage, read> words: array<u32>;

            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) @interpolate(flat) object: u32,
            }

            struct Pixel {
                @location(0) numbers: vec4<f32>,
                @location(1) word: u32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), object.index);
            }

            @fragment
            fn fragment(in: Corner) -> Pixel {
                return Pixel(numbers[in.object], words[in.object]);
            }
        ";
        Draws::Commands(CommandDraws { shader, selection: Selection::ALL, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Numbers {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = Vector(pass.column(NUMBERS, pixel.object).map(|number| R::of(f64::from(number))));
        targets[1] = Vector([R::of(f64::from(pass.column(WORDS, pixel.object))); 4]);
        true
    }
}

const SQUARES: usize = 9;

/// Squares side by side, in a picture of 90 × 10 pixels.
fn squares(extreme: &Extreme) -> Result<MarkerScene, Failed> {
    let mut camera = Camera { size: [90, 10], ..camera_at(extreme) };
    let distance = 5.0 * extreme.scale;
    if extreme.name == TOUCHING {
        // The near plane is at the squares, but for what the shader rounds.
        camera.near = (distance * (1.0 - 40.0 * UNIT_ROUNDOFF)) as f32;
    }
    // The picture is so high there.
    let height = 2.0 * distance * (30.0_f64.to_radians()).tan();
    let marker = |index: usize| {
        let middle = (index as f64 - (SQUARES - 1) as f64 / 2.0) * height;
        Marker::before(&camera, distance, height * 0.8).moved(&camera, middle, 0.0)
    };
    MarkerScene::new(camera.clone(), (0..SQUARES).map(marker))
}

/// Numbers of every size, and what stands for others: a device may take a subnormal number for 0.
const VALUES: [[f32; 4]; SQUARES] = [
    [0.0, -0.0, 1.0, -1.0],
    [1e6, -1e9, 1e-6, -1e-9],
    [f32::MAX, f32::MIN, f32::MIN_POSITIVE, -f32::MIN_POSITIVE],
    [f32::INFINITY, f32::NEG_INFINITY, 16_777_216.0, 16_777_215.0],
    [1.000_000_1, -1.000_000_1, 0.1, std::f32::consts::PI],
    [1e-20, 1e20, -1e-38, 1e38],
    [4_294_967_296.0, 1e-37, 0.333_333_34, 65_504.0],
    [65_505.0, 6e-8, -65_520.0, 255.5],
    [2.0, 4.0, 8.0, 16.0],
];

const VALUES_OF_WORDS: [u32; SQUARES] = [0, 1, 255, 65_536, 16_777_215, 16_777_217, 0x7fc0_0001, 0x8000_0000, u32::MAX];

/// The four bytes of a channel in the middle of a square.
fn channel(picture: &Picture, square: usize, channel: usize) -> [u8; 4] {
    let [width, height] = [picture.width as usize, picture.height as usize];
    let pixel = height / 2 * width + square * (width / SQUARES) + width / SQUARES / 2;
    let size = picture.bytes.len() / (width * height);
    let first = pixel * size + channel * 4;
    [0, 1, 2, 3].map(|byte| picture.bytes[first + byte])
}

fn harness_with_targets(harness: &Harness, size: TargetSize) -> Result<Harness, Failed> {
    let quality = harness.name().affordable(Quality::balanced());
    let process: Option<Arc<dyn RenderProcess>> = Some(Arc::new(Numbers { size }));
    let setup = Setup { process, own_targets: &TARGETS, ..quality.into() };
    harness.with(setup).map_err(|error| error.to_string().into())
}

/// The sizes of targets, and those that devices and the CPU must draw. Others may be refused.
const SIZES: [(TargetSize, Option<[u32; 2]>); 9] = [
    (TargetSize::Divided(u32::MAX), Some([1, 1])),
    (TargetSize::Divided(7), Some([13, 2])),
    (TargetSize::Fixed([1, 1]), Some([1, 1])),
    (TargetSize::Fixed([8192, 1]), Some([8192, 1])),
    (TargetSize::Fixed([1, 8192]), Some([1, 8192])),
    (TargetSize::Fixed([65_536, 1]), None),
    (TargetSize::Fixed([u32::MAX, 1]), None),
    (TargetSize::Fixed([1, u32::MAX]), None),
    (TargetSize::Fixed([u32::MAX; 2]), None),
];

fn sizes(harness: &mut Harness) -> Result<(), Failed> {
    let scene = squares(&Extreme { position: DVec3::ZERO, ..EXTREMES[0] })?;
    let columns = [NUMBERS.values(&VALUES), WORDS.values(&VALUES_OF_WORDS)];
    let frame = SceneRef { columns: &columns, ..scene.scene.as_scene_ref() };
    for (size, must_be) in SIZES {
        match harness_with_targets(harness, size)?.outcome(&frame)? {
            Outcome::Drawn(drawn) => {
                scene.compare(&drawn, SQUARES)?;
                for target in &drawn.own_targets {
                    let found = Some([target.width, target.height]);
                    if must_be.is_none() || found != must_be {
                        return Err(format!("{size:?}: {found:?}").into());
                    }
                }
            }
            Outcome::Refused(FrameError::Backend(BackendError::TargetTooLarge { target, width, height, .. }))
                if must_be.is_none() && TargetSize::Fixed([width, height]) == size && target.contains("numbers") => {}
            Outcome::Refused(error) => return Err(format!("{size:?}: {error}").into()),
            Outcome::NotSubmitted(error) => return Err(format!("{size:?}: {error}").into()),
        }
        scene.compare(&harness.draw_whole(&scene.scene)?, SQUARES)?;
    }
    Ok(())
}

fn columns(harness: &mut Harness) -> Result<(), Failed> {
    let (name, mut harness) = (harness.name(), harness_with_targets(harness, TargetSize::Picture)?);
    let touching = Extreme { name: TOUCHING, ..EXTREMES[0] };
    for extreme in EXTREMES.into_iter().chain([touching]) {
        let scene = squares(&extreme)?;
        let columns = [NUMBERS.values(&VALUES), WORDS.values(&VALUES_OF_WORDS)];
        let drawn = harness.outcome(&SceneRef { columns: &columns, ..scene.scene.as_scene_ref() })?.drawn()?;
        scene.compare(&drawn, SQUARES)?;
        let [numbers, words] = &drawn.own_targets[..] else { continue };
        for square in 0..SQUARES {
            let found = [0, 1, 2, 3].map(|index| f32::from_le_bytes(channel(numbers, square, index)));
            let wrong = found.iter().zip(&VALUES[square]).filter(|(found, set)| found != set).count();
            let word = u32::from_le_bytes(channel(words, square, 0));
            // In f32, the numbers of the CPU's shaders are whole up to 2²⁴.
            let set = match name {
                BackendName::Software => f64::from(VALUES_OF_WORDS[square] as f32) as u32,
                _ => VALUES_OF_WORDS[square],
            };
            let context = format!("{found:?} and {word} of {:?} and {set}", VALUES[square]);
            let wrong = wrong + usize::from(word != set);
            expect_within(("column and target", extreme.name, "wrong number"), &context, [wrong as f64, 0.0])?;
        }
    }
    Ok(())
}
