//! Frames of a camera path, each in a file of its own. Any of them may be drawn by any process, on any machine: a frame
//! needs nothing from the others, and one that is there already is not drawn again.

use std::error::Error;
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drawloom::backend::{Backend, BackendError, Picture, SoftwareSubmission, WgpuBackend, WgpuSubmission};
use drawloom::process::{Target, targets};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom_output::{PictureFile, path_text, print_line};
use drawloom_testing::demo::UpAxis;
use indicatif::{ProgressBar, ProgressStyle};

use crate::arguments::{Arguments, BackendName, CameraPosition};
use crate::camera_path::CameraPath;
use crate::pipeline;

/// The requested frames that are not there.
pub struct Sequence {
    missing: Vec<Missing>,
    /// How many frames are requested.
    frame_count: usize,
    up: UpAxis,
}

/// A frame that is not there.
struct Missing {
    camera: CameraPosition,
    file: PictureFile,
}

impl Sequence {
    /// The sequence that the command line names.
    ///
    /// # Errors
    /// If the path cannot be read, or a frame has no camera or a file that cannot be written.
    pub fn new(arguments: &Arguments, frames: Range<u32>) -> Result<Self, Box<dyn Error>> {
        let (Some(path), Some(out)) = (&arguments.path, &arguments.out) else {
            return Err("a range of frames needs --path and --out".into());
        };
        let wrong = |problem: String| format!("{}: {problem}", path_text(path));
        let path = CameraPath::load(path).map_err(wrong)?;
        let (frame_count, mut missing) = (frames.len(), Vec::new());
        for frame in frames {
            let camera = path.at(frame).map_err(wrong)?;
            let file = file_of(out.path(), frame);
            if !file.is_file() {
                missing.push(Missing { camera, file: PictureFile::new(file)? });
            }
        }
        Ok(Self { missing, frame_count, up: arguments.up.axis() })
    }

    /// Draws the frames that are not there, and writes each as soon as it is drawn. Unless the command line names a
    /// software backend, that of `open_adapter` draws all of them.
    ///
    /// # Errors
    /// If there is no such backend, or a frame cannot be drawn or written. Those before it are there.
    pub fn draw(
        self,
        arguments: &Arguments,
        scene: Scene,
        open_adapter: impl FnOnce() -> Result<WgpuBackend, Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        print_line!("{} of {} frames are there", self.frame_count - self.missing.len(), self.frame_count);
        if self.missing.is_empty() {
            return Ok(());
        }
        if let Some(BackendName::Software | BackendName::Reference) = arguments.backend {
            let make = |scheduler: &Arc<Scheduler>| pipeline::software_backend(arguments.backend, scheduler);
            return self.draw_with(arguments, scene, make, |submission: &SoftwareSubmission, view, target| {
                submission.read(view, target)
            });
        }
        // The frames beside these may be drawn on an adapter, and pictures of two backends differ in details.
        let backend = open_adapter()
            .map_err(|error| format!("{error}; --backend software draws every frame of a sequence on the CPU"))?;
        self.draw_with(
            arguments,
            scene,
            |_| backend,
            |submission: &WgpuSubmission, view, target| submission.read(view, target),
        )
    }

    fn draw_with<B: Backend>(
        self,
        arguments: &Arguments,
        mut scene: Scene,
        make: impl FnOnce(&Arc<Scheduler>) -> B,
        read: impl Fn(&B::Submission, usize, Target) -> Result<Picture, BackendError>,
    ) -> Result<(), Box<dyn Error>> {
        let (mut renderer, submitter) = pipeline::renderer(arguments, &scene, make)?;
        let progress = ProgressBar::new(self.missing.len() as u64);
        progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left")?);
        let still = scene.cameras.clone();
        for Missing { camera: placed, file } in self.missing {
            scene.cameras.clone_from(&still);
            scene.cameras.iter_mut().for_each(|camera| placed.apply(camera, self.up));
            let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
            let picture = read(&submitted.submission, 0, targets::PICTURE)?;
            file.write([picture.width, picture.height], &picture.bytes)?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(())
    }
}

/// The file of a frame: its number instead of the last `#`s of the name, with a zero for each of them that it does not
/// need. A name without a `#`, or that is not Unicode, stays.
pub fn file_of(pattern: &Path, frame: u32) -> PathBuf {
    let name = pattern.file_name().and_then(OsStr::to_str).unwrap_or_default();
    let Some(end) = name.rfind('#') else { return pattern.to_owned() };
    let start = name[..end].trim_end_matches('#').len();
    let digits = end + 1 - start;
    pattern.with_file_name(format!("{}{frame:0digits$}{}", &name[..start], &name[end + 1..]))
}
