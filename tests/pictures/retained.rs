//! Frames that upload what changed, against frames of new renderers, which upload everything.

use std::sync::OnceLock;

use drawloom::RendererBuilder;
use drawloom::backend::{PipelineLibrary, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::scene::{Changes, SceneRef};
use drawloom_testing::adapter;
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::tinted::Tinted;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("reported_changes_make_the_picture_of_a_new_renderer", || {
        changes_make_the_picture_of_a_new_renderer(|| Fixture::with(2, with_tints))
    }),
    ("so_do_changes_that_are_staged", || changes_make_the_picture_of_a_new_renderer(staging_fixture)),
];

/// A fixture whose device maps no memory, so objects are staged.
fn staging_fixture() -> Result<Fixture, Failed> {
    static LIBRARY: OnceLock<Result<PipelineLibrary, String>> = OnceLock::new();
    let open = || {
        let (device, queue) =
            adapter::device_without(WgpuBackend::MAPPING_FEATURES).map_err(|error| error.to_string())?;
        Ok::<_, String>(PipelineLibrary::new(device, queue))
    };
    Fixture::on_backend(LIBRARY.get_or_init(open).clone()?.backend()?, 2, with_tints)
}

/// The shipped processes, and one that reads a column.
fn with_tints(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.pipeline(Deferred::to_picture()).process(Tinted).output("tinted")
}

fn changes_make_the_picture_of_a_new_renderer(fixture: fn() -> Result<Fixture, Failed>) -> Result<(), Failed> {
    let mut world = ChangingWorld::new(3, 600);
    let mut fixture = fixture()?;
    let mut log = Vec::new();
    // A frame in flight has buffers of its own, so the next frame writes others, which hold an older scene.
    let mut in_flight = None;
    for step in 0..40 {
        // After a frame that is dropped, or still in flight, nothing changes.
        let stands_still = matches!(step % 8, 2 | 4);
        let reported = world.as_scene_ref();
        let changes = if stands_still { Changes::NONE } else { reported.changes };
        let recorded = fixture.renderer.record(SceneRef { changes, columns: &[world.tints()], ..reported })?;
        match step % 8 {
            1 => drop(recorded),
            3 => in_flight = Some(recorded),
            4 => {
                in_flight.take().map(|earlier| fixture.submit(earlier)).transpose()?;
                fixture.submit(recorded)?;
            }
            5 => {
                let (changes, columns) = (Changes::Unknown, [world.tints()]);
                let scene = SceneRef { changes, columns: &columns, ..world.as_scene_ref() };
                let mut new = Fixture::with(2, with_tints)?;
                let expected = new.renderer.record(scene)?;
                let (found, expected) = (fixture.submit(recorded)?, new.submit(expected)?);
                for (view, target) in [(0, "picture"), (1, "picture"), (0, "tinted"), (1, "tinted")] {
                    if found.read(view, target)? != expected.read(view, target)? {
                        return Err(format!("{target} of view {view} of frame {step} differs after {log:#?}").into());
                    }
                }
            }
            _ => drop(fixture.submit(recorded)?),
        }
        if !matches!(step % 8, 1 | 3) {
            log.push(world.step()?);
        }
    }
    Ok(())
}
