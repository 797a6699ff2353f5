//! The command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use drawloom_output::print_diagnostic;
use drawloom_testing::demo;

use crate::Failure;
use crate::every_knob::every_knob;
use crate::subject::Subject;

/// The names of the project's scenes.
const COLONNADE: &str = "colonnade";
const EVERY_KNOB: &str = "every-knob";

/// Measures the frame time and the error of each quality knob on a scene.
#[derive(Parser)]
#[command(name = "tradeoff")]
pub struct Arguments {
    /// An OBJ file, or a scene of the project's: `colonnade`, which is the default, or `every-knob`, a small one in
    /// which every knob has an effect, with levels of detail, mirrors and an impostor. That is the default of a quick
    /// run.
    pub scene: Option<PathBuf>,

    /// The camera path: `sway` moves a little to the side, `orbit` around the scene; or a file with a line
    /// `x,y,z,tx,ty,tz` for each position and the point the camera looks at, in metres.
    #[arg(long, value_name = "FILE|orbit|sway", default_value = "sway")]
    pub camera_path: String,

    /// The backend. Default: wgpu if there is an adapter, or else software.
    #[arg(long, value_enum)]
    pub backend: Option<BackendName>,

    /// Searches for the most accurate settings with a frame time of at most this many milliseconds.
    #[arg(long, value_name = "X")]
    pub budget_ms: Option<f64>,

    /// The picture's width in pixels. Its aspect ratio is 16:9.
    #[arg(long, value_name = "PIXELS", default_value = "960", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    pub width: u32,

    /// Rounds in which all settings are timed, interleaved. The median counts.
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub rounds: u32,

    /// A small scene unless one is named, small pictures from two positions of the path, or from the last one where no
    /// picture is kept from the first, and no rounds. Errors are measured; times are those of cold frames, and
    /// inaccurate.
    #[arg(long)]
    pub quick: bool,
}

/// A backend.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// wgpu on the machine's adapter.
    Wgpu,
    /// The CPU.
    Software,
}

impl Arguments {
    /// Parses the command line, or exits with an error.
    pub fn checked() -> Self {
        let mut arguments: Self = drawloom_output::parse_arguments();
        if arguments.quick {
            (arguments.width, arguments.rounds) = (160, 0);
        }
        if arguments.budget_ms.is_some_and(|budget| !(budget > 0.0 && budget.is_finite())) {
            let error = <Self as clap::CommandFactory>::command()
                .error(clap::error::ErrorKind::ValueValidation, "--budget-ms must be greater than 0");
            drawloom_output::exit_with(error);
        }
        arguments
    }

    /// Positions of a path that the program makes: a multiple of all shadow map intervals, unless the run is a quick
    /// one.
    pub fn path_positions(&self) -> usize {
        if self.quick { 2 } else { 4 }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, (self.width * 9 / 16).max(1)]
    }

    /// The scene's name in reports and file names.
    pub fn scene_name(&self) -> String {
        let default = if self.quick { EVERY_KNOB } else { COLONNADE };
        let stem = self.scene.as_ref().and_then(|path| path.file_stem());
        stem.map_or_else(|| default.to_owned(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Whether every knob should have an effect in the scene.
    pub fn has_every_knob(&self) -> bool {
        self.scene.as_ref().map_or(self.quick, |path| path.as_os_str() == EVERY_KNOB)
    }

    /// # Errors
    /// Returns an error if the file cannot be read.
    pub fn load_subject(&self) -> Result<Subject, Failure> {
        if self.has_every_knob() {
            return every_knob();
        }
        let Some(path) = self.scene.as_ref().filter(|path| path.as_os_str() != COLONNADE) else {
            return Ok(Subject::of_scene(demo::colonnade()?));
        };
        let mut imported = drawloom_obj::load(path)?;
        for warning in &imported.warnings {
            print_diagnostic!("warning: {warning}");
        }
        demo::add_camera_and_lights(&mut imported.scene);
        Ok(Subject::of_scene(imported.scene))
    }
}
