//! An engine's own nodes in the graph of a frame.

mod failures;
mod generated;
mod order;
mod same_bytes;
mod timeline;

use std::ops::Range;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::graph::NodeError;
use drawloom::process::Deferred;
use drawloom::task::{Scheduler, Worker};
use drawloom::{CpuNode, NodeAccesses, NodeContext, Renderer, Submitter};

/// The shipped processes on the null backend.
fn renderer(workers: usize) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}

type Declare<'a> = Box<dyn Fn(&mut NodeAccesses) + Send + Sync + 'a>;
type Body<'a> = Box<dyn Fn(&NodeContext<'_>, Range<usize>) -> Result<(), NodeError> + Send + Sync + 'a>;

/// A node made of closures.
struct TestNode<'a> {
    name: String,
    width: usize,
    items_per_job: Option<usize>,
    declare: Declare<'a>,
    body: Body<'a>,
}

impl<'a> TestNode<'a> {
    fn new(
        name: &str,
        declare: impl Fn(&mut NodeAccesses) + Send + Sync + 'a,
        body: impl Fn(&NodeContext<'_>, Range<usize>) -> Result<(), NodeError> + Send + Sync + 'a,
    ) -> Self {
        let (declare, body) = (Box::new(declare), Box::new(body));
        Self { name: name.to_owned(), width: 1, items_per_job: Some(1), declare, body }
    }

    fn with_width(self, width: usize) -> Self {
        Self { width, ..self }
    }
}

impl CpuNode for TestNode<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        (self.declare)(accesses);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.width
    }

    fn items_per_job(&self) -> Option<usize> {
        self.items_per_job
    }

    fn run(&self, frame: &NodeContext<'_>, items: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        (self.body)(frame, items)
    }
}

/// The nodes as a frame takes them.
fn lent<'a>(nodes: &'a [TestNode<'_>]) -> Vec<&'a dyn CpuNode> {
    nodes.iter().map(|node| node as &dyn CpuNode).collect()
}
