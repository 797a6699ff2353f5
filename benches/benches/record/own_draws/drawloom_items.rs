//! The same draws by this crate: a process that draws items, and the engine's code that records them.

use std::error::Error;
use std::ops::Range;
use std::sync::Arc;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::graph::NodeError;
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, Items, RecordItems,
    RenderProcess,
};
use drawloom::scene::Changes;
use drawloom::task::{Scheduler, Worker};
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{CpuNode, FrameInputs, NodeAccesses, NodeContext, Renderer, Submitter};

use super::OwnTechnique;
use super::commands::Commands;
use super::world::World;
use crate::technique::Failure;

pub struct DrawloomItems {
    commands: Commands,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    workers: usize,
    /// Whether the engine says which items are recorded to the same commands as before.
    has_versions: bool,
    last: Option<WgpuSubmission>,
}

impl DrawloomItems {
    /// The commands are those of the backend's device.
    ///
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn new(backend: WgpuBackend, commands: Commands, workers: usize, has_versions: bool) -> Result<Self, Failure> {
        let builder = Renderer::builder(backend).process(OwnDraws).output(COLOR);
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(workers)?))?;
        Ok(Self { commands, renderer, submitter, workers, has_versions, last: None })
    }
}

impl OwnTechnique for DrawloomItems {
    fn frame(&mut self, world: &World) -> Result<usize, Failure> {
        self.commands.upload_cameras(world);
        let upload = UploadNode { commands: &self.commands, world, chunks: Commands::chunk_count(world, self.workers) };
        let nodes: &[&dyn CpuNode] = &[&upload];
        let items = Items {
            bounds: &world.bounds,
            versions: if self.has_versions { &world.versions } else { &[] },
            changes: if world.kind().moves_items() { Changes::Unknown } else { Changes::NONE },
            ..Items::new(OWN_DRAWS, &world.keys, ItemRecorder::Any(&self.commands))
        };
        let inputs = FrameInputs { nodes, items: &[items], ..FrameInputs::new(world.as_scene_ref()) };
        let submitted = self.submitter.submit(self.renderer.record_with(inputs)?)?;
        self.last = Some(submitted.submission);
        Ok(submitted.statistics.views.iter().map(|view| view.items).sum())
    }

    fn wait(&self) -> Result<(), Failure> {
        Ok(self.last.as_ref().map_or(Ok(()), WgpuSubmission::wait)?)
    }

    fn commands(&self) -> &Commands {
        &self.commands
    }
}

/// The engine's upload, on the frame's workers.
struct UploadNode<'a> {
    commands: &'a Commands,
    world: &'a World,
    chunks: usize,
}

impl CpuNode for UploadNode<'_> {
    fn name(&self) -> &str {
        "upload transforms"
    }

    fn declare(&self, _: &mut NodeAccesses) {}

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.chunks
    }

    fn run(&self, _: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        chunks.for_each(|chunk| self.commands.upload_chunk(self.world, chunk, self.chunks));
        Ok(())
    }
}

const OWN_DRAWS: &str = "own draws";
const COLOR: &str = "color";

struct OwnDraws;

impl RenderProcess for OwnDraws {
    fn name(&self) -> &str {
        OWN_DRAWS
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(COLOR, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

impl RecordItems for Commands {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        self.record(encoder, context.resources.view, items.items());
        Ok(())
    }
}
