//! Frames of a camera path, each in a file of its own. Any of them may be drawn by any process, on any machine: a frame needs nothing from the
//! others, and one that is there already is not drawn again.

use std::error::Error;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drawloom::backend::{Backend, BackendError, Picture, SoftwareSubmission, WgpuSubmission};
use drawloom::demo::UpAxis;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom_output::PictureFile;
use indicatif::{ProgressBar, ProgressStyle};

use crate::arguments::{Arguments, BackendName, CameraPosition};
use crate::camera_path::CameraPath;
use crate::pipeline;

/// A frame that is not there: its camera and its file.
type Missing<'a> = (&'a CameraPosition, PictureFile);

/// The frames that are requested, by number, and their cameras.
pub struct Sequence {
    cameras: Vec<(u32, CameraPosition)>,
    /// The files, with a `#` for each digit of the frame's number.
    pattern: PathBuf,
    up: UpAxis,
}

impl Sequence {
    /// The sequence that the command line names.
    ///
    /// # Errors
    /// If the path cannot be read, or a frame has no camera.
    pub fn new(arguments: &Arguments, frames: Range<u32>) -> Result<Self, Box<dyn Error>> {
        let (Some(file), Some(out)) = (&arguments.path, &arguments.out) else {
            return Err("a range of frames needs --path and --out".into());
        };
        let wrong = |problem: String| format!("{}: {problem}", file.display());
        let text = fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
        let path = CameraPath::parse(&text).map_err(wrong)?;
        let cameras = frames.map(|frame| path.at(frame).map(|camera| (frame, camera)));
        let cameras = cameras.collect::<Result<_, _>>().map_err(wrong)?;
        Ok(Self { cameras, pattern: out.path().to_owned(), up: arguments.up.axis() })
    }

    /// The cameras and files of the frames that are not there.
    fn missing(&self) -> Result<Vec<Missing<'_>>, Box<dyn Error>> {
        let files = self.cameras.iter().map(|(frame, camera)| (camera, file_of(&self.pattern, *frame)));
        files.filter(|(_, file)| !file.exists()).map(|(camera, file)| Ok((camera, PictureFile::new(file)?))).collect()
    }

    /// Draws the frames that are not there, and writes each as soon as it is drawn.
    ///
    /// # Errors
    /// If a frame cannot be drawn or written. Those before it are there.
    pub fn draw(&self, arguments: &Arguments, scene: Scene) -> Result<(), Box<dyn Error>> {
        let missing = self.missing()?;
        println!("{} of {} frames are there", self.cameras.len() - missing.len(), self.cameras.len());
        if missing.is_empty() {
            return Ok(());
        }
        let on_adapter = match arguments.backend {
            Some(BackendName::Software | BackendName::Reference) => None,
            None if arguments.record.is_none() => {
                pipeline::adapter_backend(arguments).inspect_err(|error| eprintln!("drawing in software: {error}")).ok()
            }
            _ => Some(pipeline::adapter_backend(arguments)?),
        };
        match on_adapter {
            Some(backend) => self.draw_with(arguments, scene, missing, |_| backend, WgpuSubmission::read),
            None => {
                let make = |scheduler: &Arc<Scheduler>| pipeline::software_backend(arguments.backend, scheduler);
                self.draw_with(arguments, scene, missing, make, SoftwareSubmission::read)
            }
        }
    }

    fn draw_with<B: Backend>(
        &self,
        arguments: &Arguments,
        mut scene: Scene,
        missing: Vec<Missing<'_>>,
        make: impl FnOnce(&Arc<Scheduler>) -> B,
        read: impl Fn(&B::Submission, usize, &str) -> Result<Picture, BackendError>,
    ) -> Result<(), Box<dyn Error>> {
        let (mut renderer, submitter) = pipeline::renderer(arguments, make)?;
        let progress = ProgressBar::new(missing.len() as u64);
        progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left")?);
        let still = scene.cameras.clone();
        for (placed, file) in missing {
            scene.cameras.clone_from(&still);
            scene.cameras.iter_mut().for_each(|camera| placed.apply(camera, self.up));
            let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
            let picture = read(&submitted.submission, 0, "picture")?;
            file.write([picture.width, picture.height], &picture.bytes)?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(())
    }
}

/// The file of a frame: its number instead of the last `#`s of the name, with a zero for each of them that it does not need.
pub fn file_of(pattern: &Path, frame: u32) -> PathBuf {
    let name = pattern.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let Some(end) = name.rfind('#') else { return pattern.to_owned() };
    let start = name[..end].trim_end_matches('#').len();
    let digits = end + 1 - start;
    pattern.with_file_name(format!("{}{frame:0digits$}{}", &name[..start], &name[end + 1..]))
}
