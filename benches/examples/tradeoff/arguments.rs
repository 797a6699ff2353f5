//! The command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use drawloom::demo;
use drawloom::scene::{Scene, obj};

use crate::Failure;

/// Measures what each knob of quality gives and takes on a scene.
#[derive(Parser)]
#[command(name = "tradeoff")]
pub struct Arguments {
    /// An OBJ file; without it, the scene that comes with the project.
    pub scene: Option<PathBuf>,

    /// Where the camera goes: `sway` a little to the side from where it stands, `orbit` around the scene, or a file with a line
    /// `x,y,z,tx,ty,tz` for each place and what is looked at from there, in metres.
    #[arg(long, value_name = "FILE|orbit|sway", default_value = "sway")]
    pub camera_path: String,

    /// What draws; wgpu where there is an adapter, if not given.
    #[arg(long, value_enum)]
    pub backend: Option<BackendName>,

    /// Looks for the most accurate settings whose frame takes no longer than this, in milliseconds.
    #[arg(long, value_name = "X")]
    pub budget_ms: Option<f64>,

    /// The picture's width in pixels; it is 16 to 9.
    #[arg(long, value_name = "PIXELS", default_value = "960", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    pub width: u32,

    /// How often all settings are timed, in turns; of the rounds the one in the middle counts.
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub rounds: u32,

    /// Small pictures and no rounds: errors as they are, and times of frames that nothing was drawn before, which say little.
    #[arg(long)]
    pub quick: bool,
}

/// What draws.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// wgpu on the machine's adapter.
    Wgpu,
    /// The processor.
    Software,
}

impl Arguments {
    /// The command line's arguments, or clap's error.
    pub fn checked() -> Self {
        let mut arguments = Self::parse();
        if arguments.quick {
            (arguments.width, arguments.rounds) = (320, 0);
        }
        if arguments.budget_ms.is_some_and(|budget| !(budget > 0.0 && budget.is_finite())) {
            let error = <Self as clap::CommandFactory>::command()
                .error(clap::error::ErrorKind::ValueValidation, "--budget-ms is a time above 0");
            error.exit();
        }
        arguments
    }

    /// How many places of a path are drawn: a multiple of all intervals at which shadow maps are.
    pub const PLACES: usize = 4;

    /// In pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, (self.width * 9 / 16).max(1)]
    }

    /// What the scene is called in reports and file names.
    pub fn scene_name(&self) -> String {
        let stem = self.scene.as_ref().and_then(|path| path.file_stem());
        stem.map_or_else(|| String::from("colonnade"), |stem| stem.to_string_lossy().into_owned())
    }

    /// # Errors
    /// If the file cannot be read.
    pub fn load_scene(&self) -> Result<Scene, Failure> {
        let Some(path) = &self.scene else { return Ok(demo::colonnade()?) };
        let mut imported = obj::load(path)?;
        for warning in &imported.warnings {
            eprintln!("warning: {warning}");
        }
        demo::add_camera_and_lights(&mut imported.scene);
        Ok(imported.scene)
    }
}
