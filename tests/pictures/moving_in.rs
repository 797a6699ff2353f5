//! An engine that was written for plain wgpu draws the same bytes on Drawloom.

#[path = "../../examples/moving_in/drawables.rs"]
mod drawables;
#[path = "../../examples/moving_in/engine.rs"]
mod engine;
#[path = "../../examples/moving_in/on_drawloom.rs"]
mod on_drawloom;
#[path = "../../examples/moving_in/on_wgpu.rs"]
mod on_wgpu;
#[path = "../../examples/moving_in/resources.rs"]
mod resources;
#[path = "../../examples/moving_in/world.rs"]
mod world;

use std::collections::HashSet;
use std::sync::Arc;

use drawloom::Granularity;
use drawloom::task::Scheduler;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::device;
use engine::Engine;
use on_drawloom::OnDrawloom;
use on_wgpu::OnWgpu;

pub const CASES: &[Case] = &[("moving_in_changes_no_byte", moving_in_changes_no_byte)];

/// Workers and granularity.
const RUNS: [(usize, Granularity); 4] =
    [(1, Granularity::Adaptive), (3, Granularity::Adaptive), (2, Granularity::PerCamera), (4, Granularity::Chunk(20))];

/// In seconds. The world stands still in the last frame.
const TIMES: [f32; 4] = [0.0, 0.1, 9.0, 9.0];

fn moving_in_changes_no_byte() -> Result<(), Failed> {
    let (device, queue) = device()?;
    // Each renderer draws into targets of its own, so none finds the picture of another one there.
    let engine = || Engine::new(device.clone(), queue.clone(), 400);
    let (mut plain_engine, mut plain) = (engine(), OnWgpu::default());
    let mut moved = Vec::new();
    for (workers, granularity) in RUNS {
        let engine = engine();
        let renderer = OnDrawloom::new(&engine, Arc::new(Scheduler::new(workers)?), granularity)?;
        moved.push((engine, renderer));
    }
    let mut pictures = HashSet::new();
    for time in TIMES {
        plain_engine.update(time);
        plain.draw(&plain_engine);
        let expected = plain_engine.read_picture()?;
        for ((engine, renderer), run) in moved.iter_mut().zip(RUNS) {
            engine.update(time);
            renderer.draw(engine)?;
            let picture = engine.read_picture()?;
            let differing = picture.iter().zip(&expected).filter(|(one, other)| one != other).count();
            assert_eq!((differing, picture.len()), (0, expected.len()), "at {time} s with {run:?}");
        }
        let colors: HashSet<_> = expected.chunks_exact(4).collect();
        assert!(colors.len() > 1_000, "at {time} s there are {} colours", colors.len());
        pictures.insert(expected);
    }
    assert_eq!(pictures.len(), 3, "the world moves");
    Ok(())
}
