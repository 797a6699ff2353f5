//! Long draw lists: each object is drawn once, in its own pixel, and no other.
//!
//! Every object covers the centre of one pixel. A process stores the object's number there, and counts how often the
//! pixel is drawn. An oracle computes in f64, from the positions of object and camera, which pixel that is; it shares
//! no code with the crate.

use drawloom::RendererBuilder;
use drawloom::backend::RecordingStrategy;
use drawloom::command::{DrawOrder, Selection};
use drawloom::glam::{DVec3, EulerRot, Quat, Vec3};
use drawloom::process::{BlendEquation, ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::scene::{Camera, Changes, Material, Projection, RenderObject, Scene, SceneRef, Topology};
use drawloom_testing::scenes::{sized, square};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend};
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("every_object_of_a_list_is_drawn_once", || check_counts(&[1, 255, 256, 257, 2_047, 2_048, 2_049])),
    ("every_object_of_a_list_around_65536_is_drawn_once", || check_counts(&[65_535, 65_536, 65_537])),
    ("every_object_of_a_list_of_a_million_is_drawn_once", || check_counts(&[1_000_000])),
];

/// Stores the number of each object, from 1, and counts the draws of each pixel.
struct Numbers(DrawOrder);

impl RenderProcess for Numbers {
    fn name(&self) -> &str {
        "numbers"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("number", Format::R32Uint, ClearColor::Value([0.0; 4]));
        declare.clears_color("draws", Format::R16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) @interpolate(flat) number: u32,
            }

            struct Pixel {
                @location(0) number: u32,
                @location(1) draws: vec4<f32>,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), object.index + 1u);
            }

            @fragment
            fn fragment(in: Corner) -> Pixel {
                return Pixel(in.number, vec4<f32>(1.0));
            }
        ";
        Draws::Commands(CommandDraws {
            shader,
            selection: Selection::OPAQUE.in_order(self.0),
            blend_equations: vec![BlendEquation::REPLACE, BlendEquation::ADDITIVE],
            ..CommandDraws::default()
        })
    }
}

/// Metres across a pixel.
const PIXEL: f64 = 0.125;

/// Objects in the pixels of a picture that is large enough, in an order that jumps across it. They are of several
/// meshes, so a list has several batches.
fn scene(count: usize) -> Result<Scene, Failed> {
    let width = count.isqrt() + 1;
    let orientation = Quat::from_euler(EulerRot::YXZ, 0.7, -0.4, 0.2);
    let position = DVec3::new(1_234.5, -654_321.25, 77.0);
    let projection = Projection::Orthographic { height: (width as f64 * PIXEL) as f32 };
    let camera = Camera::looking_at("main", position, position + DVec3::X);
    let camera = Camera { orientation, projection, near: 1.0, far: 100.0, ..camera };
    let mut scene = Scene::new();
    scene.cameras = vec![sized(camera, [width as u32; 2])];
    let material = scene.add(Material::default())?;
    let meshes = [(); 7].map(|()| scene.add(square(Topology::TriangleList)));
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| orientation.as_dquat() * axis);
    for index in 0..count {
        // A prime that is greater than any number of pixels here, so no two objects share one.
        let pixel = index * 1_999_993 % (width * width);
        let across = |pixel: usize| (pixel as f64 + 0.5 - width as f64 / 2.0) * PIXEL;
        let [right, up] = [across(pixel % width), across(pixel / width)];
        let depth = 2.0 + (index * 7 % 90) as f64;
        let center = position + axes[0] * right + axes[1] * up - axes[2] * depth;
        let mesh = meshes[index * 5 % 11 % 7].clone()?;
        let scale = Vec3::splat(PIXEL as f32 * 0.3);
        scene.add_object(RenderObject { orientation, scale, ..RenderObject::new(mesh, material, center) })?;
    }
    Ok(scene)
}

/// The number that each pixel shows, from 1: row by row from the top, 0 where there is no object.
fn expected_numbers(scene: &SceneRef<'_>) -> Result<Vec<u32>, Failed> {
    let camera = &scene.cameras[0];
    let [width, height] = camera.size.map(|pixels| pixels as usize);
    let to_camera = camera.orientation.as_dquat().inverse();
    let mut numbers = vec![0; width * height];
    for (number, &position) in (1..).zip(scene.positions) {
        let local = to_camera * (position - camera.position) / PIXEL;
        let [x, y] = [local.x + width as f64 / 2.0, height as f64 / 2.0 - local.y];
        // Squares are 0.6 pixels wide.
        expect([x, y].iter().all(|along| (along.fract() - 0.5).abs() < 0.1), || format!("{number} is at {x}, {y}"))?;
        let before = std::mem::replace(&mut numbers[y as usize * width + x as usize], number);
        expect(before == 0, || format!("{before} and {number} share a pixel"))?;
    }
    Ok(numbers)
}

/// Draws a scene, and compares the number of each pixel.
fn compare(
    fixture: &mut Fixture,
    (scene, expected): (SceneRef<'_>, &[u32]),
    context: impl Fn() -> String,
) -> Result<(), Failed> {
    let recorded = fixture.renderer.record(scene)?;
    let submission = fixture.submit(recorded)?;
    let (numbers, draws) = (submission.read(0, "number")?, submission.read(0, "draws")?);
    let found: Vec<_> = numbers.bytes.as_chunks().0.iter().map(|&number| u32::from_le_bytes(number)).collect();
    let drawn = draws.bytes.as_chunks().0.iter().map(|&draws| f16::from_le_bytes(draws).to_f32() as usize);
    let (drawn, count) = (drawn.collect::<Vec<_>>(), scene.positions.len());
    let wrong: Vec<_> = (0..expected.len())
        .filter(|&pixel| found[pixel] != expected[pixel] || drawn[pixel] != usize::from(expected[pixel] > 0))
        .collect();
    let total: usize = drawn.iter().sum();
    expect(found.len() == expected.len() && total == count && wrong.is_empty(), || {
        let first = wrong.first().map(|&pixel| (found[pixel], expected[pixel], drawn[pixel]));
        format!(
            "{}: {total} of {count} objects were drawn, {} pixels are wrong; the first (number, expected number, draws): {first:?}",
            context(),
            wrong.len()
        )
    })
}

/// In which order objects are drawn: lists that are binned and lists that are sorted.
const ORDERS: [DrawOrder; 2] = [DrawOrder::ByState, DrawOrder::FrontToBack];

/// Draws lists of these lengths: at first, after the first object and the last have changed places, and without the
/// first.
fn check_counts(counts: &[usize]) -> Result<(), Failed> {
    for &count in counts {
        let whole = scene(count)?;
        let mut positions = whole.as_scene_ref().positions.to_vec();
        positions.swap(0, count - 1);
        let changes = Changes::Objects(&[0, count as u32 - 1]);
        let swapped = SceneRef { positions: &positions, changes, ..whole.as_scene_ref() };
        let mut without_first = scene(count)?;
        let first = without_first.objects().next().ok_or("there is an object")?;
        without_first.remove_object(first)?;
        let fewer = SceneRef { changes: Changes::Unknown, ..without_first.as_scene_ref() };
        let steps = [
            ("at first", whole.as_scene_ref(), expected_numbers(&whole.as_scene_ref())?),
            ("of which two changed places", swapped, expected_numbers(&swapped)?),
            ("without the first", fewer, expected_numbers(&fewer)?),
        ];
        for (index, order) in ORDERS.into_iter().enumerate() {
            let build = |builder: RendererBuilder<_>| builder.process(Numbers(order)).output("number").output("draws");
            let mut fixture = Fixture::on_backend(backend()?.recording_strategy(RecordingStrategy::Direct), 2, build)?;
            // A frame of a million takes seconds.
            let steps = if count > 100_000 && index > 0 { &steps[..1] } else { &steps[..] };
            for (step, scene, expected) in steps {
                compare(&mut fixture, (*scene, expected), || format!("{count} objects {step}, {order:?}"))?;
            }
        }
    }
    Ok(())
}
