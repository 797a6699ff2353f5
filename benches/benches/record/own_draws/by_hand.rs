//! What an engine writes by hand: it culls its items eight at a time, in draw order, and records those that a camera
//! sees.

use drawloom::scene::Camera;
use drawloom::view::BoundingSphere;

use super::OwnTechnique;
use super::commands::Commands;
use super::world::World;
use crate::objects::{Sphere, clip_from_world};
use crate::spheres::{LANES, SphereGroup, append_visible, planes};
use crate::technique::Failure;
use crate::threads::Threads;

/// The items in draw order, and their bounding spheres in that order. It holds as long as no key changes.
struct SortedItems {
    items: Vec<u32>,
    groups: Vec<SphereGroup>,
}

/// Groups of items in a job, which are 512 items: fewer are not worth another thread.
const GROUPS_PER_JOB: usize = 512 / LANES;

impl SortedItems {
    fn new(world: &World) -> Self {
        let mut items: Vec<_> = (0..world.keys.len() as u32).collect();
        items.sort_by_key(|&item| world.keys[item as usize]);
        let groups = vec![SphereGroup::EMPTY; items.len().div_ceil(LANES)];
        let mut sorted = Self { items, groups };
        sorted.update(&world.bounds, &Threads::One);
        sorted
    }

    /// Copies the spheres of all items.
    fn update(&mut self, bounds: &[BoundingSphere], threads: &Threads) {
        let Self { items, groups } = self;
        let in_job = GROUPS_PER_JOB * LANES;
        let mut jobs: Vec<_> = items.chunks(in_job).zip(groups.chunks_mut(GROUPS_PER_JOB)).collect();
        threads.for_each(&mut jobs, |(items, groups)| {
            for (items, group) in items.chunks(LANES).zip(groups.iter_mut()) {
                for (lane, &item) in items.iter().enumerate() {
                    let BoundingSphere { center, radius } = bounds[item as usize];
                    group.set(lane, &Sphere { center, radius });
                }
            }
        });
    }

    /// The items that a camera sees, in draw order.
    fn find_visible(&self, camera: &Camera, visible: &mut Vec<u32>) {
        visible.clear();
        append_visible(&self.groups, 0, &planes(&clip_from_world(camera)), visible);
        visible.iter_mut().for_each(|item| *item = self.items[*item as usize]);
    }
}

/// An encoder for each camera, into which a thread records directly.
pub struct Encoders {
    commands: Commands,
    sorted: SortedItems,
    threads: Threads,
    /// By camera.
    visible: Vec<Vec<u32>>,
}

impl Encoders {
    pub fn new(commands: Commands, world: &World, threads: &Threads) -> Self {
        let visible = vec![Vec::new(); world.cameras().len()];
        Self { commands, sorted: SortedItems::new(world), threads: threads.clone(), visible }
    }
}

impl OwnTechnique for Encoders {
    fn frame(&mut self, world: &World) -> Result<usize, Failure> {
        let Self { commands, sorted, threads, visible } = self;
        commands.upload(world);
        if world.kind().moves_items() {
            sorted.update(&world.bounds, threads);
        }
        let mut cameras: Vec<_> = world.cameras().iter().zip(visible.iter_mut()).enumerate().collect();
        let encoded = threads.map(&mut cameras, |(index, (camera, visible))| {
            sorted.find_visible(camera, visible);
            let mut encoder = commands.fixture.encoder();
            commands.record(&mut commands.fixture.pass(&mut encoder, *index), *index, visible);
            encoder.finish()
        });
        commands.fixture.queue.submit(encoded);
        Ok(visible.iter().map(Vec::len).sum())
    }

    fn wait(&self) -> Result<(), Failure> {
        self.commands.fixture.wait()
    }

    fn commands(&self) -> &Commands {
        &self.commands
    }
}
