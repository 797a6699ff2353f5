//! What meshes and textures cost the frame in which they come: all at once, one by one, and streamed by background
//! jobs.
//!
//!     cargo bench -p drawloom-benches --bench streaming
//!     cargo bench -p drawloom-benches --bench streaming -- --quick
//!
//! *At once* is the first frame of a renderer whose pipelines are made. *More* is the longest of 30 frames that each
//! bring a twentieth more. *Streamed* is the longest frame until everything is on the device, and how many it takes.
//! *Through* a number of MB is a world of which each frame brings a mesh and a texture and drops as many: its longest
//! frame, and that divided by the median. Times are of `Renderer::record`, but in the last rows, which are of whole
//! frames; two workers, on wgpu's `noop` device and on the machine's adapter, if there is one.
//! `target/drawloom/streaming.json` has the same. The last line names the targets that were missed.

use std::collections::VecDeque;
use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use drawloom::backend::{Backend, StreamingBudget, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::handle::Handle;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Material, Mesh, ObjectHandle, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, wgpu};
use drawloom_benches::arguments::BackendArguments;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use serde::Serialize;

type Failure = Box<dyn Error>;
type Device = (wgpu::Device, wgpu::Queue);

#[derive(Serialize)]
struct Row {
    adapter: &'static str,
    scene: String,
    case: &'static str,
    longest_ms: f64,
    median_ms: f64,
    frames: usize,
    uploaded_bytes: u64,
    resident_bytes_max: u64,
}

/// The case of a world that is streamed through a budget.
const WHOLE_FRAMES: &str = "whole frames";

/// How much there is of everything.
struct Extent {
    meshes: usize,
    textures: usize,
    /// Of the world that is streamed through a budget.
    world_bytes: u64,
    /// The budget's bytes for meshes and for textures.
    budget_bytes: [u64; 2],
    /// Objects of that world at any time.
    live: usize,
    rounds: usize,
}

/// Measures streaming.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Failure> {
    let arguments = drawloom_output::parse_arguments::<Arguments>().backend;
    let quick = arguments.is_quick();
    let extent = match quick {
        true => Extent {
            meshes: 60,
            textures: 20,
            world_bytes: 20 << 20,
            budget_bytes: [4 << 20, 6 << 20],
            live: 20,
            rounds: 1,
        },
        false => Extent {
            meshes: 10_000,
            textures: 300,
            world_bytes: 1 << 30,
            budget_bytes: [26 << 20, 38 << 20],
            live: 180,
            rounds: 3,
        },
    };
    let progress = progress_bar("cases");
    let mut rows = Vec::new();
    for backend in arguments.backends()? {
        let (name, device) = (backend.name(), backend.device()?);
        for _round in 0..extent.rounds {
            // `noop` has 256 layers.
            let textures = extent.textures.min(device.0.limits().max_texture_array_layers as usize);
            for content in [Content::Meshes(extent.meshes), Content::Textures(textures)] {
                rows.extend(at_once_and_more(name, &device, content)?);
                rows.push(streamed(name, &device, content)?);
                progress.inc(1);
            }
        }
        rows.push(through_a_budget(name, &device, &extent)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    let rows = medians(rows);

    let headings =
        ["on", "scene", "case", "longest, ms", "median, ms", "ratio", "frames", "uploaded, MB", "resident, MB"];
    let mut table = Table::new(&headings);
    for row in &rows {
        table.row([
            row.adapter.to_owned(),
            row.scene.clone(),
            row.case.to_owned(),
            format!("{:.2}", row.longest_ms),
            format!("{:.2}", row.median_ms),
            format!("{:.2}", row.longest_ms / row.median_ms),
            row.frames.to_string(),
            format!("{:.0}", row.uploaded_bytes as f64 / 1e6),
            format!("{:.0}", row.resident_bytes_max as f64 / 1e6),
        ]);
    }
    table.print();
    let targets = targets(&rows, &extent);
    targets.print("Targets and results of whole frames");
    if !quick {
        results::write_json("streaming.json", &rows)?;
    }
    targets.print_missed();
    Ok(())
}

/// The targets of a world that is streamed: it keeps to its budget, and no frame takes longer than two, where frames
/// are long enough that the system's other programs do not make one of them twice as long.
fn targets(rows: &[Row], extent: &Extent) -> Targets {
    let mut targets = Targets::new();
    let budget: u64 = extent.budget_bytes.iter().sum();
    for row in rows.iter().filter(|row| row.case == WHOLE_FRAMES) {
        let Row { adapter, scene, .. } = row;
        let resident = row.resident_bytes_max as f64 / budget as f64;
        targets.at_most(format!("{adapter}, {scene}, bytes on the device ÷ budget"), 1.0, resident);
        if *adapter != BackendName::Noop.name() {
            let figure = format!("{adapter}, {scene}, longest ÷ median frame");
            targets.at_most(figure, 2.0, row.longest_ms / row.median_ms);
        }
    }
    targets
}

/// One row for each case: the medians of its rounds.
fn medians(rows: Vec<Row>) -> Vec<Row> {
    let mut groups: Vec<Vec<Row>> = Vec::new();
    for row in rows {
        let is_same = |group: &&mut Vec<Row>| {
            (group[0].adapter, &group[0].scene, group[0].case) == (row.adapter, &row.scene, row.case)
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    let middle = |group: Vec<Row>| {
        let (longest_ms, median_ms) =
            (median(group.iter().map(|row| row.longest_ms)), median(group.iter().map(|row| row.median_ms)));
        group.into_iter().next().map(|first| Row { longest_ms, median_ms, ..first })
    };
    groups.into_iter().filter_map(middle).collect()
}

#[derive(Clone, Copy)]
enum Content {
    Meshes(usize),
    Textures(usize),
}

impl Content {
    fn name(self) -> String {
        match self {
            Self::Meshes(count) => format!("{count} meshes of 9 KB"),
            Self::Textures(count) => format!("{count} textures of 256 × 256"),
        }
    }

    fn count(self) -> usize {
        match self {
            Self::Meshes(count) | Self::Textures(count) => count,
        }
    }
}

/// A grid of quads. Clones share their vertices, but each is uploaded.
fn grid(quads: u32) -> Result<Mesh, Failure> {
    let side = quads + 1;
    let vertex = |index: u32| {
        let position = [(index % side) as f32 / quads as f32, (index / side) as f32 / quads as f32, 0.0];
        Vertex { position, normal: [0.0, 0.0, 1.0], uv: [position[0], position[1]] }
    };
    let quad = |index: u32| {
        let first = index / quads * side + index % quads;
        [first, first + 1, first + side, first + side, first + 1, first + side + 1]
    };
    let (vertices, indices) = ((0..side * side).map(vertex).collect(), (0..quads * quads).flat_map(quad).collect());
    Ok(Mesh::new("grid", Topology::TriangleList, vertices, indices)?)
}

fn speckled() -> Result<Texture, Failure> {
    let pixel = |index: u32| [(index * 7) as u8, (index / 3) as u8, (index / 256) as u8, 255];
    Ok(Texture::new("speckled", 256, 256, (0..256 * 256).flat_map(pixel).collect())?)
}

/// An object, its mesh, and its material and texture if these are its own.
type Added = (ObjectHandle, Handle<Mesh>, Option<(Handle<Material>, Handle<Texture>)>);

/// A scene, and how things are added to it.
struct World {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    scene: Scene,
    mesh: Mesh,
    shared_mesh: Handle<Mesh>,
    texture: Texture,
    material: Handle<Material>,
    objects: VecDeque<Added>,
    added: usize,
}

impl World {
    /// A scene with one object, whose pipelines are made.
    fn new((device, queue): &Device, budget: Option<StreamingBudget>, quads: u32) -> Result<Self, Failure> {
        let mut backend = WgpuBackend::new(device.clone(), queue.clone())?;
        if let Some(budget) = budget {
            backend = backend.stream_resources(budget)?;
        }
        let scheduler = Arc::new(Scheduler::new(2)?);
        let (renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler)?;
        let (mut scene, mesh) = (Scene::new(), grid(quads)?);
        let material = scene.add(Material::default())?;
        let shared_mesh = scene.add(mesh.clone())?;
        scene.add_object(RenderObject::new(shared_mesh, material, DVec3::ZERO))?;
        let target = DVec3::new(25.0, 25.0, 0.0);
        let camera = Camera::looking_at("main", target + DVec3::Z * 60.0, target);
        scene.cameras = vec![Camera { size: [64, 64], ..camera }];
        let (texture, objects) = (speckled()?, VecDeque::new());
        let mut world = Self { renderer, submitter, scene, mesh, shared_mesh, texture, material, objects, added: 0 };
        for _frame in 0..20 {
            world.frame()?;
        }
        Ok(world)
    }

    fn add(&mut self, content: Content) -> Result<(), Failure> {
        let position = DVec3::new((self.added % 50) as f64, (self.added / 50 % 50) as f64, 0.0);
        let (mesh, material, textured) = match content {
            Content::Meshes(_) => (self.scene.add(self.mesh.clone())?, self.material, None),
            Content::Textures(_) => {
                let texture = self.scene.add(self.texture.clone())?;
                let material = self.scene.add(Material { texture: Some(texture), ..Material::default() })?;
                (self.shared_mesh, material, Some((material, texture)))
            }
        };
        let object = self.scene.add_object(RenderObject::new(mesh, material, position))?;
        self.objects.push_back((object, mesh, textured));
        self.added += 1;
        Ok(())
    }

    fn drop_oldest(&mut self) -> Result<(), Failure> {
        let Some((object, mesh, textured)) = self.objects.pop_front() else { return Ok(()) };
        self.scene.remove_object(object)?;
        if mesh != self.shared_mesh {
            self.scene.remove(mesh)?;
        }
        if let Some((material, texture)) = textured {
            self.scene.remove(material)?;
            self.scene.remove(texture)?;
        }
        Ok(())
    }

    /// Draws a frame. Returns what recording took, in milliseconds.
    fn frame(&mut self) -> Result<f64, Failure> {
        let start = Instant::now();
        let recorded = self.renderer.record(self.scene.as_scene_ref())?;
        let record = start.elapsed();
        self.submitter.submit(recorded)?.submission.wait()?;
        Ok(record.as_secs_f64() * 1e3)
    }

    fn uploaded(&self) -> u64 {
        self.renderer.backend().extras().uploaded_bytes()
    }

    fn resident(&self) -> u64 {
        let resources = self.renderer.backend().resources();
        resources.mesh_bytes + resources.texture_bytes
    }
}

/// Frames of one case.
struct Measured {
    adapter: &'static str,
    scene: String,
    case: &'static str,
    times: Vec<f64>,
}

impl Measured {
    /// Since this number of bytes was uploaded.
    fn row(self, world: &World, uploaded_before: u64, resident_bytes_max: u64) -> Row {
        let Self { adapter, scene, case, times } = self;
        Row {
            adapter,
            scene,
            case,
            longest_ms: times.iter().copied().fold(0.0, f64::max),
            median_ms: median(times.iter().copied()),
            frames: times.len(),
            uploaded_bytes: world.uploaded() - uploaded_before,
            resident_bytes_max,
        }
    }
}

/// Everything in one frame, then a twentieth more in each of 30 frames.
fn at_once_and_more(adapter: &'static str, device: &Device, content: Content) -> Result<[Row; 2], Failure> {
    let mut world = World::new(device, None, 12)?;
    let before = world.uploaded();
    (0..content.count()).try_for_each(|_| world.add(content))?;
    let measured = |case, times| Measured { adapter, scene: content.name(), case, times };
    let first = vec![world.frame()?];
    let at_once = measured("at once", first).row(&world, before, world.resident());
    let (before, mut times) = (world.uploaded(), Vec::new());
    for _frame in 0..30 {
        (0..content.count().div_ceil(20)).try_for_each(|_| world.add(content))?;
        times.push(world.frame()?);
    }
    Ok([at_once, measured("more", times).row(&world, before, world.resident())])
}

fn streamed(adapter: &'static str, device: &Device, content: Content) -> Result<Row, Failure> {
    let mut world = World::new(device, Some(StreamingBudget::default()), 12)?;
    let before = world.uploaded();
    (0..content.count()).try_for_each(|_| world.add(content))?;
    let mut times = Vec::new();
    loop {
        times.push(world.frame()?);
        let statistics = world.renderer.backend().streaming_statistics().ok_or("it streams")?;
        if (statistics.requested, statistics.in_flight) == (0, 0) {
            break;
        }
        // As a loop of 250 frames a second.
        std::thread::sleep(
            Duration::from_millis(4).saturating_sub(Duration::from_secs_f64(times[times.len() - 1] / 1e3)),
        );
    }
    let measured = Measured { adapter, scene: content.name(), case: "streamed", times };
    Ok(measured.row(&world, before, world.resident()))
}

/// A world that comes and goes: each frame adds an object with a mesh of 228 KB and one with a texture of 350 KB.
fn through_a_budget(adapter: &'static str, device: &Device, extent: &Extent) -> Result<Row, Failure> {
    let [mesh_bytes, texture_bytes] = extent.budget_bytes;
    let budget = StreamingBudget {
        mesh_bytes,
        texture_bytes,
        upload_bytes_per_frame: 2 << 20,
        upload_time_per_frame: Duration::from_millis(3),
    };
    let mut world = World::new(device, Some(budget), 64)?;
    let (before, mut times, mut resident) = (world.uploaded(), Vec::new(), 0);
    while world.uploaded() - before < extent.world_bytes {
        let start = Instant::now();
        world.add(Content::Meshes(1))?;
        world.add(Content::Textures(1))?;
        while world.objects.len() > extent.live {
            world.drop_oldest()?;
        }
        world.frame()?;
        let elapsed = start.elapsed();
        times.push(elapsed.as_secs_f64() * 1e3);
        resident = resident.max(world.resident());
        std::thread::sleep(Duration::from_millis(8).saturating_sub(elapsed));
    }
    let scene = format!("{} MB through {} MB", extent.world_bytes >> 20, (mesh_bytes + texture_bytes) >> 20);
    Ok(Measured { adapter, scene, case: WHOLE_FRAMES, times }.row(&world, before, resident))
}
