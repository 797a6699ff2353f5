//! The command line.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use drawloom::Granularity;
use drawloom::backend::RecordingStrategy;
use drawloom::glam::DVec3;
use drawloom::scene::Camera;
use drawloom_obj::ObjLimits;
use drawloom_output::{OutputFile, PictureFile};
use drawloom_testing::demo::UpAxis;

/// Renders a scene through the whole frame: graph, jobs, views, commands, sorting and instancing, bundles, queues and
/// submission.
#[derive(Parser)]
#[command(name = "frame")]
pub struct Arguments {
    /// An OBJ file. Default: the scene that comes with the project.
    pub scene: Option<PathBuf>,

    /// The camera's position and target, in metres.
    #[arg(long, value_name = "x,y,z,tx,ty,tz", allow_hyphen_values = true)]
    pub camera: Option<CameraPosition>,

    /// The axis that points up in the OBJ file.
    #[arg(long, value_enum, value_name = "AXIS", default_value = "y")]
    pub up: UpName,

    /// Sets a limit in bytes of the OBJ file or of the files that it names, by its name in messages. May be given
    /// several times.
    #[arg(long = "limit", value_name = "FIELD=BYTES")]
    pub limits: Vec<FileLimit>,

    /// The backend: `wgpu` draws on an adapter, `software` on the CPU, `reference` on the CPU in f64 on one thread;
    /// `noop` is wgpu without an adapter, and `null` draws nothing but checks every rule. Default: wgpu, or software if
    /// there is no adapter and no camera path.
    #[arg(long, value_enum)]
    pub backend: Option<BackendName>,

    /// Threads that run jobs, the calling thread included. Default: the number of cores.
    #[arg(long, value_name = "N")]
    pub workers: Option<NonZeroUsize>,

    /// The size of a job: adaptive, per-camera, per-draw or chunk:N.
    #[arg(long, value_name = "SIZE", default_value = "adaptive")]
    pub granularity: JobSize,

    /// The recording strategy. Default: for each pass the one that is measured to be cheapest.
    #[arg(long, value_enum, value_name = "STRATEGY")]
    pub record: Option<StrategyName>,

    /// Repeats the scene's objects N times, at the same positions.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub copies: u32,

    /// The number of frames; or the frames of a camera path, A to B - 1, each in a file of its own. Those that are
    /// there already are not drawn.
    #[arg(long, value_name = "N|A..B", default_value = "1")]
    pub frames: Frames,

    /// The camera path, in a regular file: lines of a frame's number, and the camera's position and target then, `12 x
    /// y z tx ty tz`. It moves smoothly between them.
    #[arg(long, value_name = "FILE")]
    pub path: Option<PathBuf>,

    /// The picture's size in pixels.
    #[arg(long, value_name = "WxH", default_value = "960x540")]
    pub size: PictureSize,

    /// The file of the last picture, a .png, .jpg, .tga or .bmp. Default: frame.png. The files of a camera path have
    /// their frame's number instead of `#`s, as in shot-####.png.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    pub out: Option<PictureFile>,

    /// Adds a depth pre-pass before the geometry buffer.
    #[arg(long)]
    pub depth_pre_pass: bool,

    /// Culls triangles on the CPU: back faces, for example, and those that cover no pixel.
    #[arg(long)]
    pub cull_triangles: bool,

    /// Writes the graph of the frame's processes and targets in the DOT language.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub graph: Option<OutputFile>,

    /// Explains in words why the median of the last 60 frames took as long as it did.
    #[arg(long)]
    pub explain: bool,

    /// Writes the timeline of the last 60 frames as an HTML page.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub html: Option<OutputFile>,

    /// Writes the timeline of the last 60 frames as a Chrome trace, which Perfetto reads.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub timeline: Option<OutputFile>,

    /// Writes the figures as JSON.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    pub report: Option<OutputFile>,
}

impl Arguments {
    /// Parses the command line, and checks that each file that it names can be written.
    ///
    /// # Errors
    /// If an argument is wrong, or a file cannot be written.
    pub fn checked(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let mut arguments = Self::try_parse_from(arguments)?;
        let draws = !matches!(arguments.backend, Some(BackendName::Noop | BackendName::Null));
        if arguments.out.is_some() && !draws {
            return Err(conflict("--out needs a picture, and this backend draws none"));
        }
        if arguments.record.is_some() && !arguments.backend.is_none_or(BackendName::is_wgpu) {
            return Err(conflict("--record is for wgpu, and this backend records nothing"));
        }
        if arguments.up != UpName::Y && arguments.scene.is_none() {
            return Err(conflict("--up is for an OBJ file, and there is none"));
        }
        if !arguments.limits.is_empty() && arguments.scene.is_none() {
            return Err(conflict("--limit is for an OBJ file, and there is none"));
        }
        if let Frames::Range(_) = arguments.frames {
            arguments.check_sequence(draws)?;
        } else if arguments.path.is_some() {
            return Err(conflict("--path needs a range of frames, as in --frames 0..100"));
        }
        if arguments.out.is_none() && draws {
            let default = PictureFile::new("frame.png");
            arguments.out = Some(default.map_err(|error| Self::command().error(ErrorKind::Io, error))?);
        }
        Ok(arguments)
    }

    /// What the OBJ file may take.
    pub fn obj_limits(&self) -> ObjLimits {
        let mut limits = ObjLimits::default();
        self.limits.iter().for_each(|limit| *(limit.field)(&mut limits) = limit.bytes);
        limits
    }

    /// Checks the arguments of a range of frames.
    fn check_sequence(&self, draws: bool) -> Result<(), clap::Error> {
        if !draws {
            return Err(conflict("a range of frames needs a backend that draws"));
        }
        if self.path.is_none() {
            return Err(conflict("a range of frames needs the --path of the camera"));
        }
        let name = self.out.as_ref().and_then(|file| file.path().file_name()).unwrap_or_default();
        let Some(name) = name.to_str() else {
            return Err(conflict("the name of an --out with `#`s for the frame's number must be Unicode"));
        };
        if !name.contains('#') {
            return Err(conflict(
                "a range of frames needs an --out with `#`s for the frame's number, as in shot-####.png",
            ));
        }
        let files = [&self.graph, &self.html, &self.timeline, &self.report];
        if self.camera.is_some() || self.explain || files.into_iter().any(Option::is_some) {
            return Err(conflict(
                "--camera, --graph, --explain, --html, --timeline and --report are for a number of frames",
            ));
        }
        Ok(())
    }
}

fn conflict(message: &str) -> clap::Error {
    Arguments::command().error(ErrorKind::ArgumentConflict, message)
}

/// A recording strategy.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StrategyName {
    /// Directly into each pass.
    Direct,
    /// Into bundles, on all workers.
    Bundles,
    /// Into bundles that are cached from frame to frame.
    Cached,
}

impl StrategyName {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Bundles => "bundles",
            Self::Cached => "cached",
        }
    }

    /// The recording strategy with this name.
    pub fn strategy(self) -> RecordingStrategy {
        match self {
            Self::Direct => RecordingStrategy::Direct,
            Self::Bundles => RecordingStrategy::Bundles,
            Self::Cached => RecordingStrategy::CachedBundles,
        }
    }
}

/// A backend.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// wgpu on the machine's adapter.
    Wgpu,
    /// The CPU, in f32 on all workers.
    Software,
    /// The CPU, in f64 on one thread: the reference for the others.
    Reference,
    /// wgpu's no-op backend, which shows the cost of recording alone.
    Noop,
    /// Drawloom's null backend, which counts and checks.
    Null,
}

impl BackendName {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgpu => "wgpu",
            Self::Software => "software",
            Self::Reference => "reference",
            Self::Noop => "noop",
            Self::Null => "null",
        }
    }

    fn is_wgpu(self) -> bool {
        matches!(self, Self::Wgpu | Self::Noop)
    }
}

/// An axis that points up.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UpName {
    Y,
    Z,
}

impl UpName {
    /// The axis with this name.
    pub fn axis(self) -> UpAxis {
        match self {
            Self::Y => UpAxis::Y,
            Self::Z => UpAxis::Z,
        }
    }
}

/// `FIELD=BYTES`: a limit in bytes of [`ObjLimits`], and its value.
#[derive(Clone, Copy)]
pub struct FileLimit {
    field: LimitField,
    bytes: u64,
}

type LimitField = fn(&mut ObjLimits) -> &mut u64;

impl FromStr for FileLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const FIELDS: [(&str, LimitField); 7] = [
            ("scene_bytes", |limits| &mut limits.scene_bytes),
            ("line_bytes", |limits| &mut limits.line_bytes),
            ("library_bytes", |limits| &mut limits.library_bytes),
            ("texture_file_bytes", |limits| &mut limits.texture_file_bytes),
            ("texture_bytes", |limits| &mut limits.texture_bytes),
            ("all_textures_bytes", |limits| &mut limits.all_textures_bytes),
            ("decoded_bytes", |limits| &mut limits.decoded_bytes),
        ];
        let (name, bytes) = text.split_once('=').ok_or("expected FIELD=BYTES, as in texture_bytes=1000000000")?;
        let Some((_, field)) = FIELDS.into_iter().find(|(field, _)| *field == name) else {
            return Err(format!("{name:?} is none of {}", FIELDS.map(|(field, _)| field).join(", ")));
        };
        let bytes = bytes.parse().map_err(|error| format!("{bytes:?}: {error}"))?;
        Ok(Self { field, bytes })
    }
}

/// `N` or `A..B`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frames {
    /// The number of frames, of which the last one is written.
    Count(u32),
    /// Frames of a camera path.
    Range(Range<u32>),
}

impl Frames {
    /// How many there are.
    pub fn count(&self) -> u32 {
        match self {
            Self::Count(count) => *count,
            Self::Range(range) => range.end - range.start,
        }
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const MAX: u32 = 1_000_000;
        let number = |text: &str| text.parse::<u32>().map_err(|error| format!("{text:?}: {error}"));
        let (frames, last) = match text.split_once("..") {
            None => number(text).map(|count| (Self::Count(count), count))?,
            Some((start, end)) => {
                number(start).and_then(|start| number(end).map(|end| (Self::Range(start..end), end)))?
            }
        };
        match frames {
            _ if last > MAX => Err(format!("more than {MAX}")),
            Self::Count(0) => Err("there is no frame".to_owned()),
            Self::Range(range) if range.is_empty() => Err("the end must be greater than the start".to_owned()),
            frames => Ok(frames),
        }
    }
}

/// `x,y,z,tx,ty,tz`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPosition {
    position: DVec3,
    target: DVec3,
}

impl CameraPosition {
    /// A camera that looks from a position at a target, both in metres.
    ///
    /// # Errors
    /// If they are equal, or not finite.
    pub fn new(position: DVec3, target: DVec3) -> Result<Self, String> {
        if !position.is_finite() || !target.is_finite() {
            return Err("the numbers must be finite".to_owned());
        }
        if position == target {
            return Err("the camera's position and target must differ".to_owned());
        }
        Ok(Self { position, target })
    }

    /// Moves a camera to this position. Its near plane does not cut off what it looks at, however large the scene is.
    pub fn apply(&self, camera: &mut Camera, up: UpAxis) {
        let placed = up.looking_at(camera.name.clone(), self.position, self.target);
        camera.position = placed.position;
        camera.orientation = placed.orientation;
        let near = (self.position.distance(self.target) * 1e-3) as f32;
        camera.near = camera.near.min(near).max(f32::MIN_POSITIVE);
    }
}

impl FromStr for CameraPosition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = parse_numbers(text.split(','))?;
        let &[x, y, z, target_x, target_y, target_z] = numbers.as_slice() else {
            return Err(format!("expected six numbers, found {}", numbers.len()));
        };
        Self::new(DVec3::new(x, y, z), DVec3::new(target_x, target_y, target_z))
    }
}

/// Numbers in text, with space around them.
///
/// # Errors
/// Names the part that is no number.
pub fn parse_numbers<'t>(parts: impl Iterator<Item = &'t str>) -> Result<Vec<f64>, String> {
    parts.map(|part| part.trim().parse().map_err(|error| format!("{part:?}: {error}"))).collect()
}

/// `adaptive`, `per-camera`, `per-draw` or `chunk:N`.
#[derive(Clone)]
pub struct JobSize(pub Granularity);

impl JobSize {
    /// Its name on the command line.
    pub fn name(&self) -> String {
        match self.0 {
            Granularity::Adaptive => "adaptive".to_owned(),
            Granularity::PerCamera => "per-camera".to_owned(),
            Granularity::PerDraw => "per-draw".to_owned(),
            Granularity::Chunk(size) => format!("chunk:{size}"),
        }
    }
}

impl FromStr for JobSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("chunk:")) {
            ("adaptive", _) => Ok(Self(Granularity::Adaptive)),
            ("per-camera", _) => Ok(Self(Granularity::PerCamera)),
            ("per-draw", _) => Ok(Self(Granularity::PerDraw)),
            (_, Some(size)) => {
                let size = size.parse::<NonZeroUsize>().map_err(|error| format!("chunk size {size:?}: {error}"))?;
                Ok(Self(Granularity::Chunk(size.get())))
            }
            _ => Err("expected adaptive, per-camera, per-draw or chunk:N".to_owned()),
        }
    }
}

/// `WxH`.
#[derive(Clone)]
pub struct PictureSize(pub [u32; 2]);

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once('x').ok_or("expected WIDTHxHEIGHT, as in 960x540")?;
        let side = |text: &str| text.parse::<u32>().map_err(|error| format!("{text:?}: {error}"));
        let size = [side(width)?, side(height)?];
        if size.contains(&0) { Err("a picture needs at least one pixel".to_owned()) } else { Ok(Self(size)) }
    }
}
