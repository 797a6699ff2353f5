//! Schedules of many empty chunks, so that only the scheduler's own instructions are counted.

use std::error::Error;
use std::hint::black_box;

use clap::ValueEnum;
use drawloom::graph::{Closure, FrameGraph, Schedule};
use drawloom::task::Scheduler;
use serde::Serialize;

/// Chunks in a frame.
pub const CHUNKS: usize = 1_024;

/// How a frame's chunks are arranged. One worker runs them all, so that counts are reproducible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// One node of many chunks in a serial run.
    Serial,
    /// One node of many chunks in a parallel run.
    Parallel,
    /// A chain of nodes of one chunk each in a serial run.
    SerialChain,
    /// The same chain in a parallel run.
    ParallelChain,
}

impl Shape {
    pub const ALL: &[Self] = &[Self::Serial, Self::Parallel, Self::SerialChain, Self::ParallelChain];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Serial => "serial",
            Self::Parallel => "parallel",
            Self::SerialChain => "serial-chain",
            Self::ParallelChain => "parallel-chain",
        }
    }

    /// Runs this many frames.
    ///
    /// # Errors
    /// Returns an error if a frame fails.
    pub fn run(self, frames: usize) -> Result<(), Box<dyn Error + Send + Sync>> {
        // A shuffled scheduler runs every schedule in parallel, even on one worker.
        let builder = Scheduler::builder().workers(1);
        let scheduler = match self {
            Self::Serial | Self::SerialChain => builder,
            Self::Parallel | Self::ParallelChain => builder.shuffle(1),
        }
        .build()?;
        let mut schedule = match self {
            Self::Serial | Self::Parallel => one_node(CHUNKS)?,
            Self::SerialChain | Self::ParallelChain => chain(CHUNKS)?,
        };
        for _ in 0..frames {
            schedule.run(&scheduler, &())?;
        }
        Ok(())
    }
}

/// One node of this many empty chunks.
fn one_node(chunks: usize) -> Result<Schedule<Closure<'static, ()>>, Box<dyn Error + Send + Sync>> {
    let mut graph = FrameGraph::new();
    let node = graph.add("node", empty().with_width(move |_| chunks));
    graph.keep(node);
    Ok(graph.compile()?)
}

fn chain(nodes: usize) -> Result<Schedule<Closure<'static, ()>>, Box<dyn Error + Send + Sync>> {
    let mut graph = FrameGraph::new();
    let chain: Vec<_> = (0..nodes).map(|index| graph.add(index.to_string(), empty())).collect();
    chain.windows(2).for_each(|pair| graph.order(pair[0], pair[1]));
    chain.iter().for_each(|&node| graph.keep(node));
    Ok(graph.compile()?)
}

fn empty() -> Closure<'static, ()> {
    Closure::new(|_context, range, _worker| {
        black_box(range);
        Ok(())
    })
}
