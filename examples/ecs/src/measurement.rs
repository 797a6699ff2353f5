//! What a frame of a world costs.

use std::error::Error;
use std::fmt::{self, Display, Formatter};
use std::time::{Duration, Instant};

use crate::engine_world::{EngineWorld, Lend};
use crate::graphics::Graphics;
use crate::population::Population;
use crate::scene_columns::SceneColumns;

/// What a frame of a world costs: medians over frames.
#[derive(Clone, Copy, Debug)]
pub struct FrameCosts {
    update: Duration,
    replace: Duration,
    gather: Duration,
    record: Duration,
    submit: Duration,
    bytes_copied: usize,
    objects_changed: usize,
}

/// Draws frames of a world, in which some entities are replaced between frames. Returns what a frame costs.
///
/// # Errors
/// If a frame is impossible, or a job panics.
pub fn measure(
    graphics: &mut Graphics,
    world: &mut impl EngineWorld,
    population: Population,
    replaced: u32,
    frames: u32,
) -> Result<FrameCosts, Box<dyn Error>> {
    /// Frames in which choices by measurement settle.
    const WARM_UP: u32 = 60;
    graphics.look_at(population);
    world.spawn(population.entities, graphics.looks, 0.0);
    let mut columns = SceneColumns::default();
    let mut costs = Vec::new();
    for frame in 0..WARM_UP + frames {
        let time = f64::from(frame) / 60.0;
        let (update, updated) = timed(|| world.update(&graphics.scheduler, time));
        updated?;
        let (replace, ()) = timed(|| {
            world.despawn_oldest(replaced);
            world.spawn(replaced, graphics.looks, time);
        });
        let began = Instant::now();
        let lent = world.lend();
        let archetypes = lent.archetypes();
        let scene = columns.update(&archetypes);
        let gather = began.elapsed();
        let objects_changed = scene.changed.iter().map(ExactSizeIterator::len).sum();
        let [record, submit] = graphics.draw(scene, frame + 1 == WARM_UP + frames)?;
        drop(archetypes);
        drop(lent);
        world.end_frame();
        let bytes_copied = columns.bytes_copied;
        costs.push(FrameCosts { update, replace, gather, record, submit, bytes_copied, objects_changed });
    }
    Ok(median(&costs[WARM_UP as usize..]))
}

fn timed<T>(work: impl FnOnce() -> T) -> (Duration, T) {
    let began = Instant::now();
    let result = work();
    (began.elapsed(), result)
}

fn median(costs: &[FrameCosts]) -> FrameCosts {
    fn of<T: Ord + Copy>(costs: &[FrameCosts], value: impl Fn(&FrameCosts) -> T) -> T {
        let mut values: Vec<_> = costs.iter().map(value).collect();
        values.sort();
        values[values.len() / 2]
    }
    FrameCosts {
        update: of(costs, |costs| costs.update),
        replace: of(costs, |costs| costs.replace),
        gather: of(costs, |costs| costs.gather),
        record: of(costs, |costs| costs.record),
        submit: of(costs, |costs| costs.submit),
        bytes_copied: of(costs, |costs| costs.bytes_copied),
        objects_changed: of(costs, |costs| costs.objects_changed),
    }
}

impl Display for FrameCosts {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        for time in [self.update, self.replace, self.gather, self.record, self.submit] {
            write!(formatter, "{:>8.1}", time.as_secs_f64() * 1e6)?;
        }
        write!(formatter, "{:>10} {:>8}", self.bytes_copied, self.objects_changed)
    }
}
