//! The command line.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use drawloom_output::OutputFile;

/// Flies through a world that is many times larger than the device's memory for it.
#[derive(Parser)]
#[command(name = "streaming")]
pub struct Arguments {
    /// How long the flight takes, in seconds.
    #[arg(long, value_name = "N", default_value = "60", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,

    /// Draws this many frames instead, each as if 1/rate seconds had passed.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub frames: Option<u32>,

    /// The limit of frames a second.
    #[arg(long, value_name = "N", default_value = "60", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub rate: u32,

    /// The backend: `wgpu` draws on an adapter, `noop` is wgpu without one, so that only the CPU's work takes time.
    #[arg(long, value_enum, default_value = "wgpu")]
    pub backend: BackendName,

    /// Threads that run jobs, the calling thread included. Default: the number of cores.
    #[arg(long, value_name = "N")]
    pub workers: Option<NonZeroUsize>,

    /// The memory of the device for meshes and textures, in MiB.
    #[arg(long, value_name = "MIB", default_value = "64", value_parser = clap::value_parser!(u32).range(8..=65_536))]
    pub budget: u32,

    /// The picture's size in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x360")]
    pub size: PictureSize,

    /// Writes the report as JSON.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub report: Option<OutputFile>,

    /// Writes the chart and three pictures into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Shows no progress.
    #[arg(long)]
    pub quiet: bool,
}

impl Arguments {
    /// The arguments of this program. Ends it if they are wrong.
    pub fn checked() -> Self {
        drawloom_output::parse_arguments()
    }

    /// The time of the flight at which a frame begins, in seconds; `None` if it is over.
    pub fn time_of(&self, frame: usize, elapsed: Duration) -> Option<f64> {
        let time = match self.frames {
            Some(_) => frame as f64 / f64::from(self.rate),
            None => elapsed.as_secs_f64(),
        };
        (time < self.duration()).then_some(time)
    }

    /// How much of the flight is over, from 0 to 1.
    pub fn share_of(&self, time: f64) -> f64 {
        time / self.duration()
    }

    /// What a frame takes at least.
    pub fn frame_time(&self) -> Duration {
        Duration::from_secs(1) / self.rate
    }

    fn duration(&self) -> f64 {
        self.frames.map_or(f64::from(self.seconds), |frames| f64::from(frames) / f64::from(self.rate))
    }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    Wgpu,
    Noop,
}

/// Width and height in pixels.
#[derive(Clone, Copy)]
pub struct PictureSize(pub [u32; 2]);

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected WIDTHxHEIGHT, each from 1 to 8192".to_owned();
        let (width, height) = text.split_once('x').ok_or_else(wrong)?;
        let side = |side: &str| side.parse().ok().filter(|side| (1..=8192).contains(side)).ok_or_else(wrong);
        Ok(Self([side(width)?, side(height)?]))
    }
}
