//! Draws every setting at every position of the path, first for its pictures, and then interleaved for its times.

use std::time::Duration;

use drawloom::backend::Picture;
use drawloom::command::RenderCommand;
use drawloom::scene::Camera;
use drawloom_benches::harness::{Harness, Rounds, progress_bar};
use drawloom_benches::statistics::median_duration;

use crate::Failure;
use crate::arguments::Arguments;
use crate::backend::{self, BackendUnderTest, FrameTime};
use crate::comparison::{Distance, share_that_differs};
use crate::configuration::Configuration;
use crate::settings::Setting;
use crate::subject::{MIRRORS, Subject};

/// The measurements of all settings, in their order.
pub struct Measurements {
    pub settings: Vec<Measurement>,
    /// The reference's picture at each position of the path.
    pub reference: Vec<Picture>,
}

/// The measurement of one setting.
pub struct Measurement {
    /// Mean times along the path, by round.
    pub times: Vec<FrameTime>,
    /// At the last position of the path.
    pub picture: Picture,
    /// At the last position of the path.
    pub contents: FrameContents,
    /// The distance from the pictures of [`Configuration::exact`].
    pub from_exact: Distance,
    /// The distance from the reference's pictures.
    pub from_reference: Distance,
    /// The largest share of pixels at one position that differ from those of exact: at all, and by more than
    /// [`VISIBLE`].
    pub differing: [f64; 2],
    /// Objects that occlusion culling removed, in all pictures.
    pub occluded: usize,
    /// How many frames before its own the oldest picture was drawn that a mirror showed.
    pub age: u32,
}

/// The minimum difference of 255 that is visible when switching between two pictures.
const VISIBLE: u8 = 3;

/// The commands and targets of a frame.
pub struct FrameContents {
    /// The geometry buffer's commands, in order.
    pub opaque: Vec<RenderCommand>,
    /// The transparency's commands, in order.
    pub blended: Vec<RenderCommand>,
    /// The geometry buffer's commands in the first mirror's view, in order.
    pub mirrored: Vec<RenderCommand>,
    /// The light's index in the scene and the commands of each shadow map.
    pub shadow_maps: Vec<(usize, Vec<RenderCommand>)>,
    pub normal: Picture,
    pub diffuse: Picture,
    pub radiance: Picture,
}

impl FrameContents {
    /// Reads the last frame.
    ///
    /// # Errors
    /// Returns an error if a target cannot be read.
    fn of(backend: &dyn BackendUnderTest) -> Result<Self, Failure> {
        let light_of = |name: &String| name.strip_prefix("shadow of light ")?.parse().ok();
        let maps = backend.views().iter().enumerate().filter_map(|(view, name)| Some((view, light_of(name)?)));
        let is_mirror = |name: &String| name.rsplit_once('/').is_some_and(|(_, view)| view == MIRRORS[0].0);
        let mirror = backend.views().iter().position(is_mirror);
        Ok(Self {
            opaque: backend.commands("geometry buffer", 0),
            blended: backend.commands("transparency", 0),
            mirrored: mirror.map_or_else(Vec::new, |view| backend.commands("geometry buffer", view)),
            shadow_maps: maps.map(|(view, light)| (light, backend.commands("shadow casters", view))).collect(),
            normal: backend.read("normal")?,
            diffuse: backend.read("diffuse")?,
            radiance: backend.read("radiance")?,
        })
    }
}

/// Warm-up frames: pipelines are created, memory is allocated, and views decide whether occlusion culling is worth it,
/// in four frames with it and four without.
const WARM_UP: usize = 8;

impl Measurements {
    /// # Errors
    /// Returns an error if a frame fails.
    pub fn take(
        backend: &mut dyn BackendUnderTest,
        subject: &mut Subject,
        path: &[Camera],
        settings: &[Setting],
        arguments: &Arguments,
    ) -> Result<Self, Failure> {
        let rounds = arguments.rounds as usize;
        let progress = progress_bar("steps");
        progress.set_length((path.len() + settings.len()) as u64);

        let mut reference = Vec::new();
        let mut reference_backend = backend::reference(subject)?;
        let exact = Configuration::exact();
        let mut run = Run::new(&mut *reference_backend, subject, &exact)?;
        for camera in path {
            progress.set_message("the reference in f64");
            run.draw(camera)?;
            reference.push(run.backend.read("picture")?);
            progress.inc(1);
        }
        drop(reference_backend);

        let mut exact: Vec<Picture> = Vec::new();
        let mut measurements: Vec<Measurement> = Vec::new();
        for (index, setting) in settings.iter().enumerate() {
            progress.set_message(format!("pictures of {}: {}", setting.knob.name(), setting.name));
            // What keeps no pictures looks the same wherever the path begins.
            let from = if arguments.quick && index > 0 && !setting.keeps_pictures() { path.len() - 1 } else { 0 };
            let drawn = draw_pictures(backend, subject, &path[from..], &setting.configuration)?;
            if index == 0 {
                exact.clone_from(&drawn.pictures);
            }
            measurements.push(drawn.compare(backend, &exact[from..], &reference[from..], rounds == 0)?);
            progress.inc(1);
        }

        let mut contenders: Vec<_> = settings.iter().collect();
        let times = Harness::new(Rounds { warm_up: 0, measured: rounds }, &progress).measure(
            &mut contenders,
            |setting, _round| {
                progress.set_message(format!("times of {}: {}", setting.knob.name(), setting.name));
                time_along(backend, subject, path, &setting.configuration)
            },
        )?;
        for (measurement, times) in measurements.iter_mut().zip(times) {
            measurement.times.extend(times);
        }
        progress.finish_and_clear();
        Ok(Self { settings: measurements, reference })
    }
}

impl Measurement {
    /// From the hand-over of the scene to the return of submit, in the median round.
    pub fn cpu(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.cpu))
    }

    /// Until the frame is drawn, in the median round.
    pub fn frame(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.frame))
    }
}

/// The pictures and times along the path.
struct Pictures {
    pictures: Vec<Picture>,
    times: Vec<FrameTime>,
}

/// The frames of a configuration.
struct Run<'a> {
    backend: &'a mut dyn BackendUnderTest,
    subject: &'a mut Subject,
    configuration: &'a Configuration,
    /// The camera of the impostor's picture in the frame before.
    impostor: Option<Camera>,
}

impl<'a> Run<'a> {
    fn new(
        backend: &'a mut dyn BackendUnderTest,
        subject: &'a mut Subject,
        configuration: &'a Configuration,
    ) -> Result<Self, Failure> {
        backend.configure(configuration)?;
        Ok(Self { backend, subject, configuration, impostor: None })
    }

    fn draw(&mut self, camera: &Camera) -> Result<FrameTime, Failure> {
        let (cameras, impostor) = self.subject.cameras(camera, self.configuration, self.impostor.as_ref())?;
        self.impostor = impostor;
        self.backend.draw(self.subject.with_cameras(&cameras))
    }
}

/// Draws each position of the path. Occlusion culling, if enabled, runs in each picture, whether it is worth it or not.
fn draw_pictures(
    backend: &mut dyn BackendUnderTest,
    subject: &mut Subject,
    path: &[Camera],
    configuration: &Configuration,
) -> Result<Pictures, Failure> {
    let mut drawn = Pictures { pictures: Vec::new(), times: Vec::new() };
    let mut run = Run::new(backend, subject, configuration)?;
    for camera in path {
        if configuration.quality.occlusion.is_some() {
            // A change of quality makes the next frame try occlusion culling again.
            run.backend.configure(&Configuration::exact())?;
            run.backend.configure(configuration)?;
        }
        drawn.times.push(run.draw(camera)?);
        drawn.pictures.push(run.backend.read("picture")?);
    }
    Ok(drawn)
}

impl Pictures {
    /// If `timed`, these frames are the only timed ones of the setting.
    fn compare(
        self,
        backend: &dyn BackendUnderTest,
        exact: &[Picture],
        reference: &[Picture],
        timed: bool,
    ) -> Result<Measurement, Failure> {
        let Self { pictures, times } = self;
        let differing = [0, VISIBLE].map(|tolerance| {
            let pairs = pictures.iter().zip(exact);
            pairs.map(|(one, other)| share_that_differs(one, other, tolerance)).fold(0.0, f64::max)
        });
        Ok(Measurement {
            times: if timed { vec![FrameTime::mean(&times)] } else { Vec::new() },
            contents: FrameContents::of(backend)?,
            from_exact: distance(&pictures, exact)?,
            from_reference: distance(&pictures, reference)?,
            picture: pictures.into_iter().next_back().ok_or("the path has no position")?,
            differing,
            occluded: times.iter().map(|time| time.occluded).sum(),
            age: FrameTime::mean(&times).age,
        })
    }
}

/// Returns the mean frame time along the path, after a warm-up.
///
/// # Errors
/// Returns an error if a frame fails.
pub fn time_along(
    backend: &mut dyn BackendUnderTest,
    subject: &mut Subject,
    path: &[Camera],
    configuration: &Configuration,
) -> Result<FrameTime, Failure> {
    let mut run = Run::new(backend, subject, configuration)?;
    let start = path.first().ok_or("the path has no position")?;
    for _ in 0..WARM_UP {
        run.draw(start)?;
    }
    let times: Vec<_> = path.iter().map(|camera| run.draw(camera)).collect::<Result<_, _>>()?;
    Ok(FrameTime::mean(&times))
}

fn distance(pictures: &[Picture], others: &[Picture]) -> Result<Distance, Failure> {
    let pairs = pictures.iter().zip(others).map(|(one, other)| Distance::between(one, other));
    Ok(Distance::together(&pairs.collect::<Result<Vec<_>, Failure>>()?))
}
