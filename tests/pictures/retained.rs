//! Frames that upload what changed, against frames of new renderers, which upload everything.

use drawloom::scene::{Changes, SceneRef};
use drawloom_testing::changing_world::ChangingWorld;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] =
    &[("reported_changes_make_the_picture_of_a_new_renderer", reported_changes_make_the_picture_of_a_new_renderer)];

fn reported_changes_make_the_picture_of_a_new_renderer() -> Result<(), Failed> {
    let mut world = ChangingWorld::new(3, 600);
    let mut fixture = Fixture::new()?;
    let mut log = Vec::new();
    // A frame in flight has buffers of its own, so the next frame writes others, which hold an older scene.
    let mut in_flight = None;
    for step in 0..40 {
        let recorded = fixture.renderer.record(world.as_scene_ref())?;
        match step % 8 {
            1 => drop(recorded),
            3 => in_flight = Some(recorded),
            4 => {
                in_flight.take().map(|earlier| fixture.submit(earlier)).transpose()?;
                fixture.submit(recorded)?;
            }
            5 => {
                let scene = SceneRef { changes: Changes::Unknown, ..world.as_scene_ref() };
                let mut new = Fixture::new()?;
                let expected = new.renderer.record(scene)?;
                let (found, expected) = (fixture.submit(recorded)?, new.submit(expected)?);
                for view in 0..2 {
                    if found.read(view, "picture")? != expected.read(view, "picture")? {
                        return Err(format!("view {view} of frame {step} differs after {log:#?}").into());
                    }
                }
            }
            _ => drop(fixture.submit(recorded)?),
        }
        log.push(world.step()?);
    }
    Ok(())
}
