//! Every process of a frame is needed: without it the picture is another one, or others have nothing to read.

use drawloom::backend::Picture;
use drawloom::process::{Deferred, Fxaa};
use drawloom::scene::{Scene, ViewKind};
use drawloom_testing::scenes::everything::{everything, everything_with_mirror};
use libtest_mimic::Failed;

use super::cost::{different_pixels, expect_changed};
use super::deferred;
use crate::fixture::Fixture;
use crate::sampled_views::{MIRROR, SURFACE};

/// What others read, and a target that they read.
const READ_BY_OTHERS: [(&str, &str); 2] = [("depth pre-pass", "\"depth\""), ("geometry buffer", "\"normal\"")];

fn all() -> Deferred {
    deferred().depth_pre_pass(true).post(Fxaa::default())
}

/// The names of the planned processes for views of a kind.
fn planned(fixture: &Fixture, is_wanted: impl Fn(ViewKind) -> bool) -> Vec<String> {
    let processes = fixture.renderer.plan().processes().iter();
    processes.filter(|planned| is_wanted(planned.declaration.views)).map(|planned| planned.name.clone()).collect()
}

/// The pictures without each of these processes; fails if others than those expected are read by others. One renderer
/// draws all pictures, because compiling the pipelines takes most of the time.
fn without_each(fixture: &mut Fixture, scene: &Scene, names: &[String]) -> Result<Vec<(String, Picture)>, Failed> {
    let (mut pictures, mut needed_by_others) = (Vec::new(), Vec::new());
    for name in names {
        match fixture.renderer.set_pipeline(all().leave_out(name)) {
            Ok(()) => pictures.push((name.clone(), fixture.draw(scene)?)),
            Err(error) => needed_by_others.push((name.as_str(), error.to_string())),
        }
    }
    let is_expected =
        |((name, error), (read, target)): (&(&str, String), (&str, &str))| *name == read && error.contains(target);
    if needed_by_others.len() != READ_BY_OTHERS.len() || !needed_by_others.iter().zip(READ_BY_OTHERS).all(is_expected) {
        return Err(format!("{needed_by_others:?} should be {READ_BY_OTHERS:?}").into());
    }
    Ok(pictures)
}

pub fn every_process_is_needed() -> Result<(), Failed> {
    let scene = everything();
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(all()))?;
    let picture = fixture.draw(&scene)?;
    let names = planned(&fixture, |_| true);
    let without = without_each(&mut fixture, &scene, &names)?;
    without.iter().try_for_each(|(name, without)| expect_changed(name, &picture, without))?;
    // A process per class of lights, shadow casters, transparency, and the two steps of post-processing.
    match (without.len(), names.len()) {
        (12, 14) => Ok(()),
        (changed, count) => Err(format!("{changed} of {count} change the picture").into()),
    }
}

/// Each process that draws in the mirror's view is needed for what the mirror shows, where the main view's own
/// processes draw nothing.
pub fn every_process_of_a_mirror_is_needed() -> Result<(), Failed> {
    let scene = everything_with_mirror(SURFACE);
    let mut empty_mirror = everything_with_mirror(SURFACE);
    empty_mirror.cameras.pop();
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(all()).process(MIRROR))?;
    let unmirrored = fixture.draw(&empty_mirror)?;
    let picture = fixture.draw(&scene)?;
    let shown: Vec<bool> = different_pixels(&picture, &unmirrored).collect();
    let of_main = planned(&fixture, |views| views == ViewKind::Main);
    let mut of_mirror = planned(&fixture, |views| views == ViewKind::Reflection);
    // It draws the mirrors in a mirror, and this one shows none.
    of_mirror.retain(|name| name != "mirror surface");
    let without = without_each(&mut fixture, &scene, &of_mirror)?;
    for (name, without) in &without {
        let in_mirror =
            different_pixels(&picture, without).zip(&shown).filter(|(is_different, shown)| *is_different && **shown);
        let count = in_mirror.count();
        if count < 10 {
            return Err(format!("{name}: only {count} pixels of the mirror change").into());
        }
    }
    // The mirror shows radiance, so it has no post-processing.
    let steps: Vec<_> = of_main.iter().filter(|name| !of_mirror.contains(name) && *name != "mirror surface").collect();
    if steps != ["tone mapping", "fxaa"] {
        return Err(format!("{of_mirror:?} draw in the mirror's view").into());
    }
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(all()))?;
    expect_changed("the mirror's own process", &picture, &fixture.draw(&empty_mirror)?)
}
