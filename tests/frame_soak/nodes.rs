//! The engine's own work in the graph of each frame.

use std::ops::Range;

use drawloom::glam::DVec3;
use drawloom::graph::NodeError;
use drawloom::scene::{GeneratedBuffer, NodeColumn, WrittenColumns};
use drawloom::task::Worker;
use drawloom::{CpuNode, FrameData, NodeAccesses, NodeContext};

/// Lets some objects rise and fall, before the frame reads where they are.
pub struct Movement<'a> {
    positions: NodeColumn<'a, DVec3>,
    /// In ascending order.
    moving: &'a [u32],
    height: f64,
}

impl<'a> Movement<'a> {
    pub fn new(positions: &'a mut [DVec3], moving: &'a [u32], frame: u64) -> Self {
        Self { positions: NodeColumn::new(positions), moving, height: (frame % 7) as f64 * 0.1 }
    }

    pub fn columns(&self) -> WrittenColumns<'_> {
        WrittenColumns { positions: Some(&self.positions), ..WrittenColumns::default() }
    }
}

impl CpuNode for Movement<'_> {
    fn name(&self) -> &str {
        "movement"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.writes(FrameData::Transforms);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.positions.chunk_count()
    }

    fn run(&self, _: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            for (object, position) in self.positions.write(chunk)?.objects() {
                if self.moving.binary_search(&(object as u32)).is_ok() {
                    position.y += self.height;
                }
            }
        }
        Ok(())
    }
}

/// Fills memory that the frame uploads.
pub struct Sparks {
    sparks: GeneratedBuffer<[f32; 4]>,
}

impl Sparks {
    pub fn new() -> Self {
        Self { sparks: GeneratedBuffer::with_chunk("sparks", 256, 64) }
    }
}

impl CpuNode for Sparks {
    fn name(&self) -> &str {
        "sparks"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.sparks);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.sparks.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            frame.fill(&self.sparks, chunk)?.fill([1.0; 4]);
        }
        Ok(())
    }
}
