//! Buffers that processes share, compute shaders, and vertices that a shader makes.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::command::Cull;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, ComputeDispatch, Declare, DrawCount, Draws, Format, Primitive, ProceduralDraws, RawPass,
    RawPassResources, RenderProcess, StorageBuffer, Workgroups,
};
use drawloom::scene::{Blend, Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] = &[
    ("buffers_keep_what_compute_shaders_wrote_in_frames_submitted_before", counting),
    ("a_compute_shader_decides_how_often_another_runs", indirect_dispatch),
    ("a_raw_pass_fills_a_buffer_that_it_declares", filled),
    ("each_view_of_a_process_that_is_not_once_a_frame_changes_a_buffer", once_a_view),
    ("vertices_that_a_shader_makes_form_lines_and_are_blended_and_culled", primitives),
    ("the_software_backend_names_what_it_cannot_run", on_software),
    ("a_compute_shader_with_an_error_is_named_and_the_next_frame_is_right", broken_compute),
];

/// How many columns are drawn: the arguments of an indirect draw.
const COLUMNS: StorageBuffer<[u32; 4]> = StorageBuffer::new("columns", 2);
/// The workgroups of an indirect dispatch.
const GROUPS: StorageBuffer<[u32; 3]> = StorageBuffer::new("groups", 1);
/// The number of workgroups that ran.
const RUNS: StorageBuffer<u32> = StorageBuffer::new("runs", 1);

/// Adds a column in each frame, or in each view.
#[derive(Clone, Copy)]
pub struct Count {
    pub once_a_frame: bool,
}

impl RenderProcess for Count {
    fn name(&self) -> &str {
        "count"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(COLUMNS);
        if self.once_a_frame {
            declare.once_a_frame();
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read_write> columns: array<vec4<u32>>;

            @compute @workgroup_size(1)
            fn compute() {
                columns[1] = vec4<u32>(6u, columns[1].y + 1u, 0u, 0u);
            }
        ";
        Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() })
    }
}

/// Draws a column of 8 pixels for each instance.
pub struct DrawColumns;

impl RenderProcess for DrawColumns {
    fn name(&self) -> &str {
        "draw columns"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
        declare.reads_buffer(COLUMNS);
        declare.reads_arguments(COLUMNS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read> columns: array<vec4<u32>>;

            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) color: vec4<f32>,
            }

            @vertex
            fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) column: u32) -> Corner {
                let corner = vec2<f32>(f32((0x32u >> vertex) & 1u), f32((0x2cu >> vertex) & 1u));
                let x = (f32(column) + corner.x) * 8.0 / view.width * 2.0 - 1.0;
                let color = vec4<f32>(f32(columns[1].y) * 10.0 / 255.0, 1.0, 0.0, 1.0);
                return Corner(vec4<f32>(x, corner.y * 2.0 - 1.0, 0.5, 1.0), color);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return in.color;
            }
        ";
        let count = DrawCount::Indirect(COLUMNS.at(1));
        Draws::Procedural(ProceduralDraws { shader, count, cull: Cull::Nothing, ..ProceduralDraws::default() })
    }
}

fn scene(views: usize) -> Scene {
    let mut scene = Scene::new();
    let camera = |view| sized(Camera::looking_at(format!("{view}"), DVec3::Z, DVec3::ZERO), [64, 16]);
    scene.cameras = (0..views).map(camera).collect();
    scene
}

/// Whether only the first `count` columns are drawn.
fn check_columns(picture: &Picture, count: u32) -> Result<(), Failed> {
    for column in 0..8 {
        let expected = if column < count { [count as u8 * 10, 255, 0] } else { [0; 3] };
        assert_color(pixel(picture, column * 8 + 4, 8), expected)?;
    }
    Ok(())
}

fn counting() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| {
        builder.process(DrawColumns).process(Count { once_a_frame: true }).output("picture")
    })?;
    let scene = scene(2);
    let first = fixture.record(&scene)?;
    let second = fixture.record(&scene)?;
    drop(fixture.record(&scene)?);
    for (recorded, count) in [(first, 1), (second, 2)] {
        let submission = fixture.submit(recorded)?;
        check_columns(&submission.read(0, "picture")?, count)?;
        check_columns(&submission.read(1, "picture")?, count)?;
    }
    let third = fixture.record(&scene)?;
    check_columns(&fixture.submit(third)?.read(1, "picture")?, 3)
}

fn once_a_view() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| {
        builder.process(DrawColumns).process(Count { once_a_frame: false }).output("picture")
    })?;
    for frame in 0..2 {
        let recorded = fixture.record(&scene(2))?;
        let submission = fixture.submit(recorded)?;
        check_columns(&submission.read(0, "picture")?, frame * 2 + 1)?;
        check_columns(&submission.read(1, "picture")?, frame * 2 + 2)?;
    }
    Ok(())
}

/// Has five columns drawn, without a shader.
struct Fill;

impl RenderProcess for Fill {
    fn name(&self) -> &str {
        "fill"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(COLUMNS);
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for Fill {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let columns = resources.buffer(COLUMNS)?;
        let arguments = [[0; 4], [6_u32, 5, 0, 0]];
        let staged = resources.buffer_of("columns", wgpu::BufferUsages::COPY_SRC, bytemuck::bytes_of(&arguments));
        encoder.copy_buffer_to_buffer(&staged, 0, columns, 0, staged.size());
        Ok(())
    }
}

fn filled() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(DrawColumns).process(Fill).output("picture"))?;
    let recorded = fixture.record(&scene(1))?;
    check_columns(&fixture.submit(recorded)?.read(0, "picture")?, 5)
}

/// Asks for 3 × 2 × 1 workgroups.
struct Choose;

impl RenderProcess for Choose {
    fn name(&self) -> &str {
        "choose"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(GROUPS);
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read_write> groups: array<u32, 3>;

            @compute @workgroup_size(1)
            fn compute() {
                groups = array(3u, 2u, 1u);
            }
        ";
        Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() })
    }
}

/// Counts the workgroups that run, and has as many columns drawn.
struct Run;

impl RenderProcess for Run {
    fn name(&self) -> &str {
        "run"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_arguments(GROUPS);
        declare.changes_buffer(RUNS);
        declare.changes_buffer(COLUMNS);
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read_write> runs: atomic<u32>;
            @group(2) @binding(2) var<storage, read_write> columns: array<vec4<u32>>;

            @compute @workgroup_size(1)
            fn compute() {
                // The last to add sees them all, and no number is larger.
                atomicMax(&runs, 0u);
                let before = atomicAdd(&runs, 1u);
                if before == 5u {
                    columns[1] = vec4<u32>(6u, before + 1u, 0u, 0u);
                }
            }
        ";
        let workgroups = Workgroups::Indirect(GROUPS.at(0));
        Draws::Compute(ComputeDispatch { shader, workgroups, ..ComputeDispatch::default() })
    }
}

fn indirect_dispatch() -> Result<(), Failed> {
    let mut fixture =
        Fixture::with(2, |builder| builder.process(DrawColumns).process(Run).process(Choose).output("picture"))?;
    let recorded = fixture.record(&scene(1))?;
    check_columns(&fixture.submit(recorded)?.read(0, "picture")?, 6)
}

/// Draws a line over a triangle that is blended twice, and one that is culled.
struct Shapes {
    name: &'static str,
    primitive: Primitive,
    cull: Cull,
    after: Option<&'static str>,
}

impl RenderProcess for Shapes {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        match self.after {
            None => declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0])),
            Some(before) => {
                declare.draws_over("picture");
                declare.after(before);
            }
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @vertex
            fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
                // Counter-clockwise, and as a line from the lower left to the lower right corner.
                let corners = array(vec2<f32>(-1.0, -0.5), vec2<f32>(1.0, -0.5), vec2<f32>(0.0, 1.0));
                return vec4<f32>(corners[vertex], 0.5, 1.0);
            }

            @fragment
            fn fragment() -> @location(0) vec4<f32> {
                return vec4<f32>(0.2, 0.0, 0.0, 0.0);
            }
        ";
        let vertices = if self.primitive == Primitive::Lines { 2 } else { 3 };
        let count = DrawCount::Count { vertices, instances: 2 };
        let (primitive, cull, blend) = (self.primitive, self.cull, Blend::Additive);
        Draws::Procedural(ProceduralDraws { shader, count, primitive, cull, blend, ..ProceduralDraws::default() })
    }
}

fn primitives() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| {
        let triangles = Shapes { name: "triangles", primitive: Primitive::Triangles, cull: Cull::Back, after: None };
        let culled = Shapes { name: "culled", cull: Cull::Front, after: Some("triangles"), ..triangles };
        let line = Shapes { name: "line", primitive: Primitive::Lines, after: Some("culled"), ..triangles };
        builder.process(triangles).process(culled).process(line).output("picture")
    })?;
    let recorded = fixture.record(&scene(1))?;
    let picture = fixture.submit(recorded)?.read(0, "picture")?;
    assert_color(pixel(&picture, 32, 6), [102, 0, 0])?;
    assert_color(pixel(&picture, 1, 1), [0, 0, 0])?;
    let along_line: Vec<_> = (10..14).map(|y| pixel(&picture, 40, y)[0]).collect();
    if along_line.iter().filter(|red| **red == 204 || **red == 102).count() > 3 || !along_line.contains(&204) {
        return Err(format!("{along_line:?} across the line").into());
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let builder = builder.process(DrawColumns).process(Count { once_a_frame: true }).output("picture");
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let error = match renderer.record(scene(1).as_scene_ref()) {
        Err(error) => error.to_string(),
        Ok(recorded) => submitter.submit(recorded).err().ok_or("it is drawn")?.to_string(),
    };
    if error.contains("\"count\"") && error.contains("CPU shader") { Ok(()) } else { Err(error.into()) }
}

/// A compute shader that may be broken.
struct Breakable(std::sync::atomic::AtomicBool);

impl RenderProcess for Breakable {
    fn name(&self) -> &str {
        "breakable"
    }

    fn declare(&self, declare: &mut Declare) {
        Count { once_a_frame: true }.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        if self.0.load(std::sync::atomic::Ordering::Relaxed) {
            let shader = "@compute @workgroup_size(1)\nfn compute() { unknown(); }";
            return Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() });
        }
        const COUNT: Count = Count { once_a_frame: true };
        COUNT.draws()
    }
}

fn broken_compute() -> Result<(), Failed> {
    let breakable = Arc::new(Breakable(true.into()));
    let mut fixture =
        Fixture::with(2, |builder| builder.process(DrawColumns).process(Arc::clone(&breakable)).output("picture"))?;
    let scene = scene(1);
    let error = fixture.renderer.record(scene.as_scene_ref()).err().ok_or("it is recorded")?.to_string();
    if !error.contains("breakable") || !error.contains("line 2") {
        return Err(error.into());
    }
    breakable.0.store(false, std::sync::atomic::Ordering::Relaxed);
    let recorded = fixture.record(&scene)?;
    check_columns(&fixture.submit(recorded)?.read(0, "picture")?, 1)
}
