//! Draws every setting at every position of the path, first for its pictures, and then interleaved for its times.

use std::time::Duration;

use drawloom::backend::Picture;
use drawloom::command::RenderCommand;
use drawloom::quality::Quality;
use drawloom::scene::{Camera, Scene, SceneRef};
use drawloom_benches::harness::{Harness, Rounds, progress_bar};
use drawloom_benches::statistics::median_duration;

use crate::Failure;
use crate::arguments::Arguments;
use crate::comparison::{Distance, share_that_differs};
use crate::settings::Setting;
use crate::stage::{self, FrameTime, Stage};

/// What was measured of all settings, in their order.
pub struct Measurements {
    pub of_settings: Vec<Measurement>,
    /// What the reference draws at each place of the path.
    pub reference: Vec<Picture>,
}

/// What was measured of a setting.
pub struct Measurement {
    /// Of the mean frame along the path, of each round.
    pub times: Vec<FrameTime>,
    /// At the path's first place.
    pub picture: Picture,
    /// At the last place of the path.
    pub insides: Insides,
    /// From the pictures of [`Quality::exact`](drawloom::quality::Quality::exact).
    pub from_exact: Distance,
    /// From the reference's pictures.
    pub from_reference: Distance,
    /// The largest share of pixels that differ at all from those of exact, at one place; and by more than what is seen.
    pub differing: [f64; 2],
    /// Objects that were left out because others hide them, in all pictures.
    pub occluded: usize,
}

/// Of 255: what a look from one picture to the other shows.
const VISIBLE: u8 = 3;

/// What a frame was made of.
pub struct Insides {
    /// What the geometry buffer drew, in order.
    pub opaque: Vec<RenderCommand>,
    /// What the transparency drew, in order.
    pub blended: Vec<RenderCommand>,
    /// Of each shadow map, its light's index in the scene and what was drawn into it.
    pub shadow_maps: Vec<(usize, Vec<RenderCommand>)>,
    pub normal: Picture,
    pub diffuse: Picture,
    pub radiance: Picture,
}

impl Insides {
    /// Of the frame drawn last.
    ///
    /// # Errors
    /// If a target cannot be read.
    fn of(stage: &dyn Stage) -> Result<Self, Failure> {
        let light_of = |name: &String| name.strip_prefix("shadow of light ")?.parse().ok();
        let maps = stage.views().iter().enumerate().filter_map(|(view, name)| Some((view, light_of(name)?)));
        Ok(Self {
            opaque: stage.commands("geometry buffer", 0),
            blended: stage.commands("transparency", 0),
            shadow_maps: maps.map(|(view, light)| (light, stage.commands("shadow casters", view))).collect(),
            normal: stage.read("normal")?,
            diffuse: stage.read("diffuse")?,
            radiance: stage.read("radiance")?,
        })
    }
}

/// Frames drawn before those that count: pipelines are made, memory is there, and a view has found out whether it pays to look for
/// what is hidden.
const UNCOUNTED: usize = 6;

impl Measurements {
    /// # Errors
    /// If a frame fails.
    pub fn take(
        stage: &mut dyn Stage,
        scene: &Scene,
        path: &[Camera],
        settings: &[Setting],
        arguments: &Arguments,
    ) -> Result<Self, Failure> {
        let rounds = arguments.rounds as usize;
        let progress = progress_bar("steps");
        progress.set_length((path.len() + settings.len()) as u64);

        let mut reference = Vec::new();
        let mut judge = stage::reference()?;
        for camera in path {
            progress.set_message("the reference in f64");
            judge.draw(seen_from(scene, camera))?;
            reference.push(judge.read("picture")?);
            progress.inc(1);
        }
        drop(judge);

        let mut exact: Vec<Picture> = Vec::new();
        let mut of_settings: Vec<Measurement> = Vec::new();
        for (index, setting) in settings.iter().enumerate() {
            progress.set_message(format!("pictures of {}: {}", setting.knob.name(), setting.name));
            let drawn = draw_pictures(stage, scene, path, setting)?;
            if index == 0 {
                exact.clone_from(&drawn.pictures);
            }
            of_settings.push(drawn.compare(stage, &exact, &reference, rounds == 0)?);
            progress.inc(1);
        }

        let mut contenders: Vec<_> = settings.iter().collect();
        let times = Harness::new(Rounds { warm_up: 0, measured: rounds }, &progress).measure(
            &mut contenders,
            |setting, _round| {
                progress.set_message(format!("times of {}: {}", setting.knob.name(), setting.name));
                time_along(stage, scene, path, &setting.quality)
            },
        )?;
        for (measurement, times) in of_settings.iter_mut().zip(times) {
            measurement.times.extend(times);
        }
        progress.finish_and_clear();
        Ok(Self { of_settings, reference })
    }
}

impl Measurement {
    /// From the scene's hand-over to the return of submit, in the round in the middle.
    pub fn cpu(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.cpu))
    }

    /// Until it is drawn, in the round in the middle.
    pub fn frame(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.frame))
    }
}

/// Pictures along the path.
struct Pictures {
    pictures: Vec<Picture>,
    times: Vec<FrameTime>,
}

/// Draws each place of the path. Where what is hidden is looked for it is looked for in each picture, whether it pays or not.
fn draw_pictures(
    stage: &mut dyn Stage,
    scene: &Scene,
    path: &[Camera],
    setting: &Setting,
) -> Result<Pictures, Failure> {
    let mut drawn = Pictures { pictures: Vec::new(), times: Vec::new() };
    stage.set_quality(&setting.quality)?;
    for camera in path {
        if setting.quality.occlusion.is_some() {
            // With another quality it is tried anew, in the first frame.
            stage.set_quality(&Quality::exact())?;
            stage.set_quality(&setting.quality)?;
        }
        drawn.times.push(stage.draw(seen_from(scene, camera))?);
        drawn.pictures.push(stage.read("picture")?);
    }
    Ok(drawn)
}

impl Pictures {
    /// If `timed`, these frames are all that is timed of the setting.
    fn compare(
        self,
        stage: &dyn Stage,
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
            insides: Insides::of(stage)?,
            from_exact: distance(&pictures, exact)?,
            from_reference: distance(&pictures, reference)?,
            picture: pictures.into_iter().next().ok_or("the path has no place")?,
            differing,
            occluded: times.iter().map(|time| time.occluded).sum(),
        })
    }
}

/// What the mean frame along the path takes, after as many frames as it takes for that to mean something.
///
/// # Errors
/// If a frame fails.
pub fn time_along(
    stage: &mut dyn Stage,
    scene: &Scene,
    path: &[Camera],
    quality: &Quality,
) -> Result<FrameTime, Failure> {
    stage.set_quality(quality)?;
    let start = path.first().ok_or("the path has no place")?;
    for _ in 0..UNCOUNTED {
        stage.draw(seen_from(scene, start))?;
    }
    let times: Vec<_> = path.iter().map(|camera| stage.draw(seen_from(scene, camera))).collect::<Result<_, _>>()?;
    Ok(FrameTime::mean(&times))
}

/// The scene with this camera and no other.
fn seen_from<'a>(scene: &'a Scene, camera: &'a Camera) -> SceneRef<'a> {
    SceneRef { cameras: std::slice::from_ref(camera), ..scene.as_scene_ref() }
}

fn distance(pictures: &[Picture], others: &[Picture]) -> Result<Distance, Failure> {
    let pairs = pictures.iter().zip(others).map(|(one, other)| Distance::between(one, other));
    Ok(Distance::together(&pairs.collect::<Result<Vec<_>, Failure>>()?))
}
