//! What CPU nodes make in a frame is drawn by this frame.

use std::ops::Range;

use drawloom::command::Cull;
use drawloom::glam::DVec3;
use drawloom::graph::NodeError;
use drawloom::process::{ClearColor, Declare, DrawCount, Draws, Format, ProceduralDraws, RenderProcess, StorageBuffer};
use drawloom::scene::{Camera, GeneratedBuffer, Scene};
use drawloom::task::Worker;
use drawloom::{CpuNode, FrameInputs, NodeAccesses, NodeContext};
use drawloom_testing::hills::{self, GeneratedHills};
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw, pixel};

pub const CASES: &[Case] = &[
    ("a_mesh_that_nodes_make_looks_like_one_that_the_engine_makes", same_picture),
    ("frames_in_flight_draw_what_their_own_nodes_have_made", in_flight),
    ("a_buffer_that_nodes_fill_is_drawn_as_often_as_they_say", particles),
];

const FRAMES: usize = 4;

fn same_picture() -> Result<(), Failed> {
    let expected = (0..FRAMES).map(|frame| draw(&hills::scene(hills::mesh(frame)?)?)).collect::<Result<Vec<_>, _>>()?;
    assert!(expected[0].bytes != expected[2].bytes && expected[0].bytes != expected[1].bytes, "nothing moves");
    for workers in [1, 2, 4] {
        let mut fixture =
            Fixture::with(workers, |builder| builder.pipeline(drawloom::process::Deferred::to_picture()))?;
        let made = GeneratedHills::new();
        let scene = hills::scene(made.mesh()?)?;
        for (frame, expected) in expected.iter().enumerate() {
            let (vertices, indices) = made.nodes(frame);
            let recorded = fixture
                .renderer
                .record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene.as_scene_ref()) })?;
            let picture = fixture.submit(recorded)?.read(0, "picture")?;
            assert!(picture.bytes == expected.bytes, "frame {frame} on {workers} workers");
        }
        // Without nodes it stays as it was.
        assert!(fixture.draw(&scene)?.bytes == expected[FRAMES - 1].bytes);
    }
    Ok(())
}

fn in_flight() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let made = GeneratedHills::new();
    let scene = hills::scene(made.mesh()?)?;
    let expected = (0..FRAMES).map(|frame| draw(&hills::scene(hills::mesh(frame)?)?)).collect::<Result<Vec<_>, _>>()?;
    let mut recorded = Vec::new();
    for frame in 0..FRAMES {
        let (vertices, indices) = made.nodes(frame);
        recorded.push(
            fixture
                .renderer
                .record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene.as_scene_ref()) })?,
        );
    }
    // One that is dropped leaves nothing behind.
    drop(recorded.remove(1));
    let submissions = recorded.into_iter().map(|recorded| fixture.submit(recorded)).collect::<Result<Vec<_>, _>>()?;
    // Frames share their targets, so only the last picture can be read.
    assert!(submissions[2].read(0, "picture")?.bytes == expected[3].bytes);
    let (vertices, indices) = made.nodes(2);
    let later = fixture
        .renderer
        .record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene.as_scene_ref()) })?;
    let (vertices, indices) = made.nodes(0);
    drop(
        fixture
            .renderer
            .record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene.as_scene_ref()) })?,
    );
    assert!(fixture.submit(later)?.read(0, "picture")?.bytes == expected[2].bytes, "the later frame overwrote it");
    Ok(())
}

/// The colour of each column, and the arguments of the draw.
const COLORS: StorageBuffer<[f32; 4]> = StorageBuffer::new("colours", 8).filled_by_nodes();
const ARGUMENTS: StorageBuffer<[u32; 4]> = StorageBuffer::new("arguments", 1).filled_by_nodes();

/// Draws a column of 8 pixels for each instance.
struct DrawColumns;

impl RenderProcess for DrawColumns {
    fn name(&self) -> &str {
        "draw columns"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
        declare.reads_buffer(COLORS);
        declare.reads_arguments(ARGUMENTS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read> colors: array<vec4<f32>>;

            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) color: vec4<f32>,
            }

            @vertex
            fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) column: u32) -> Corner {
                let corner = vec2<f32>(f32((0x32u >> vertex) & 1u), f32((0x2cu >> vertex) & 1u));
                let x = (f32(column) + corner.x) * 8.0 / view.width * 2.0 - 1.0;
                return Corner(vec4<f32>(x, corner.y * 2.0 - 1.0, 0.5, 1.0), colors[column]);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return in.color;
            }
        ";
        let count = DrawCount::Indirect(ARGUMENTS.at(0));
        Draws::Procedural(ProceduralDraws { shader, count, cull: Cull::Nothing, ..ProceduralDraws::default() })
    }
}

/// Colours this number of columns.
struct Columns {
    colors: GeneratedBuffer<[f32; 4]>,
    arguments: GeneratedBuffer<[u32; 4]>,
    count: usize,
}

impl CpuNode for Columns {
    fn name(&self) -> &str {
        "columns"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.colors).fills(&self.arguments);
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        let green = self.count as f32 / 255.0;
        frame.fill(&self.colors, 0)?.fill([1.0, green, 0.0, 1.0]);
        frame.set_count(&self.colors, self.count)?;
        frame.fill(&self.arguments, 0)?[0] = [6, self.count as u32, 0, 0];
        Ok(())
    }
}

fn particles() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(DrawColumns).output("picture"))?;
    let mut scene = Scene::new();
    scene.cameras.push(sized(Camera::looking_at("main", DVec3::Z, DVec3::ZERO), [64, 16]));
    let mut columns = Columns { colors: COLORS.generated(), arguments: ARGUMENTS.generated(), count: 0 };
    for count in [3, 8, 0, 5] {
        columns.count = count;
        let recorded = fixture
            .renderer
            .record_with(FrameInputs { nodes: &[&columns], ..FrameInputs::new(scene.as_scene_ref()) })?;
        assert_eq!(recorded.statistics().generated, 16 * count as u64 + 16);
        let picture = fixture.submit(recorded)?.read(0, "picture")?;
        for column in 0..8 {
            let expected = if column < count { [255, count as u8, 0] } else { [0; 3] };
            assert_eq!(pixel(&picture, column as u32 * 8 + 4, 8), expected, "column {column} of {count}");
        }
    }
    Ok(())
}
