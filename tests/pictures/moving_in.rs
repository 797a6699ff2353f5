//! An engine that was written for plain wgpu draws the same bytes on Drawloom.

#[path = "../../examples/moving_in/content.rs"]
mod content;
#[path = "../../examples/moving_in/engine.rs"]
mod engine;
#[path = "../../examples/moving_in/on_drawloom.rs"]
mod on_drawloom;

use std::collections::HashSet;
use std::sync::Arc;

use drawloom::task::Scheduler;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::device;
use engine::Engine;
use on_drawloom::EngineOnDrawloom;

pub const CASES: &[Case] = &[("an_engine_that_moved_in_draws_the_bytes_of_plain_wgpu", same_bytes)];

fn same_bytes() -> Result<(), Failed> {
    let (device, queue) = device()?;
    let engine = || Engine::new(device.clone(), queue.clone(), 900);
    let mut plain = engine();
    let moved =
        |workers| -> Result<_, Failed> { Ok(EngineOnDrawloom::new(engine(), Arc::new(Scheduler::new(workers)?))?) };
    let mut moved = [moved(1)?, moved(3)?];
    let mut pictures = HashSet::new();
    for frame in 0..4_u8 {
        let time = f32::from(frame / 2) * 9.0;
        plain.update(time);
        plain.draw();
        let expected = plain.read_picture()?;
        for moved in &mut moved {
            moved.engine.update(time);
            moved.draw()?;
            let picture = moved.engine.read_picture()?;
            let differing = picture.iter().zip(&expected).filter(|(one, other)| one != other).count();
            assert_eq!((differing, picture.len()), (0, expected.len()), "frame {frame}");
        }
        let colors: HashSet<_> = expected.chunks_exact(4).collect();
        assert!(colors.len() > 1_000, "frame {frame} has {} colours", colors.len());
        pictures.insert(expected);
    }
    assert_eq!(pictures.len(), 2, "the world moves");
    Ok(())
}
