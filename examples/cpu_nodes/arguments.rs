//! The command line.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use drawloom_output::OutputFile;

/// Draws a world that the jobs of each frame make.
#[derive(Parser)]
#[command(name = "cpu_nodes")]
pub struct Arguments {
    /// The number of frames, 30 a second of the world's time.
    #[arg(long, value_name = "N", default_value = "90", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub frames: u32,

    /// The backend: `wgpu` draws on an adapter, `noop` is wgpu without one, so that only the CPU's work takes time.
    #[arg(long, value_enum, default_value = "wgpu")]
    pub backend: BackendName,

    /// Threads that run jobs, the calling thread included. Default: the number of cores.
    #[arg(long, value_name = "N")]
    pub workers: Option<NonZeroUsize>,

    /// Writes three pictures into this folder: of the first, the middle and the last frame.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Explains why the last frame took as long as it did.
    #[arg(long)]
    pub explain: bool,

    /// Writes the timeline of the last frames as a Chrome trace, which Perfetto reads.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub timeline: Option<OutputFile>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    Wgpu,
    Noop,
}
