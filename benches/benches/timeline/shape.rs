//! Schedules of many chunks that do nothing, so that all there is to count is the scheduler's own doing.

use std::error::Error;
use std::hint::black_box;

use clap::ValueEnum;
use drawloom::graph::{Closure, FrameGraph, Schedule};
use drawloom::task::Scheduler;
use serde::Serialize;

/// Chunks in a frame.
pub const CHUNKS: usize = 1_024;

/// How a frame's chunks are arranged. All is run by one worker, so that counts are the same each time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// One process, as it is run where it is not shared.
    Alone,
    /// One process of many chunks, as it is run where workers share it.
    Shared,
    /// A chain of processes of one chunk, as it is run where it is not shared.
    Chain,
    /// The same, as it is run where workers share it.
    SharedChain,
}

impl Shape {
    pub const ALL: &[Self] = &[Self::Alone, Self::Shared, Self::Chain, Self::SharedChain];

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alone => "alone",
            Self::Shared => "shared",
            Self::Chain => "chain",
            Self::SharedChain => "shared-chain",
        }
    }

    /// Runs so many frames.
    ///
    /// # Errors
    /// If they cannot be run.
    pub fn run(self, frames: usize) -> Result<(), Box<dyn Error + Send + Sync>> {
        // With a seed even a single worker goes the way of those that share.
        let builder = Scheduler::builder().workers(1);
        let scheduler = match self {
            Self::Alone | Self::Chain => builder,
            Self::Shared | Self::SharedChain => builder.shuffle(1),
        }
        .build()?;
        let mut schedule = match self {
            Self::Alone | Self::Shared => pass(CHUNKS)?,
            Self::Chain | Self::SharedChain => chain(CHUNKS)?,
        };
        for _ in 0..frames {
            schedule.run(&scheduler, &())?;
        }
        Ok(())
    }
}

/// One process of so many empty chunks.
///
/// # Errors
/// If it does not compile.
pub fn pass(chunks: usize) -> Result<Schedule<Closure<'static, ()>>, Box<dyn Error + Send + Sync>> {
    let mut graph = FrameGraph::new();
    let process = graph.add("pass", empty().with_width(move |_| chunks));
    graph.keep(process);
    Ok(graph.compile()?)
}

fn chain(processes: usize) -> Result<Schedule<Closure<'static, ()>>, Box<dyn Error + Send + Sync>> {
    let mut graph = FrameGraph::new();
    let chain: Vec<_> = (0..processes).map(|index| graph.add(index.to_string(), empty())).collect();
    chain.windows(2).for_each(|pair| graph.order(pair[0], pair[1]));
    chain.iter().for_each(|&process| graph.keep(process));
    Ok(graph.compile()?)
}

fn empty() -> Closure<'static, ()> {
    Closure::new(|_context, range, _worker| {
        black_box(range);
        Ok(())
    })
}
