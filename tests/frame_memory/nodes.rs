//! A CPU node that looks at the frame.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::graph::NodeError;
use drawloom::task::Worker;
use drawloom::{CpuNode, FrameData, NodeAccesses, NodeContext};

/// Counts what the first view sees.
#[derive(Default)]
pub struct SeenObjects {
    count: AtomicUsize,
}

impl CpuNode for SeenObjects {
    fn name(&self) -> &str {
        "seen objects"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.reads(FrameData::VisibleObjects);
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        self.count.store(frame.visible_objects(0)?.count(), Ordering::Relaxed);
        Ok(())
    }
}
