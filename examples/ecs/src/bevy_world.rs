//! The entities in `bevy_ecs`. It marks components that are changed with ticks.

use std::collections::VecDeque;

use bevy_ecs::change_detection::{ContiguousRef, Ref};
use bevy_ecs::entity::Entity;
use bevy_ecs::query::QueryState;
use bevy_ecs::world::World;
use bytemuck::TransparentWrapper;
use drawloom::task::{JobPanic, Scheduler};

use crate::components::{Extent, Foe, Friend, Number, Orientation, Position, Scale, Shape, Surface, Wave};
use crate::engine_world::{ArchetypeColumns, ENTITIES_PER_JOB, EngineWorld, Lend, Moved};
use crate::population::{Kind, Looks, Population};

type DrawnQuery = (
    &'static Number,
    Ref<'static, Position>,
    &'static Orientation,
    &'static Scale,
    &'static Extent,
    &'static Shape,
    &'static Surface,
);

/// The entities in `bevy_ecs`.
pub struct BevyWorld {
    world: World,
    moving: QueryState<(&'static Wave, &'static mut Position, &'static mut Orientation)>,
    drawn: QueryState<DrawnQuery>,
    population: Population,
    /// The oldest first.
    entities: VecDeque<Entity>,
    spawned: u64,
}

/// The columns of all tables.
pub struct LentColumns<'w> {
    tables: Vec<ArchetypeColumns<'w>>,
}

impl BevyWorld {
    /// A world without entities.
    pub fn new(population: Population) -> Self {
        let mut world = World::new();
        let (moving, drawn) = (world.query(), world.query());
        Self { world, moving, drawn, population, entities: VecDeque::new(), spawned: 0 }
    }
}

impl EngineWorld for BevyWorld {
    type Lent<'w> = LentColumns<'w>;

    fn spawn(&mut self, count: u32, looks: Looks, time: f64) {
        for number in self.spawned..self.spawned + u64::from(count) {
            let drawn = self.population.drawn(number, looks, time);
            let wave = self.population.wave(number);
            let foe = Foe { health: 1.0 };
            let entity = match self.population.kind(number) {
                Kind::Moving => self.world.spawn((drawn, wave)),
                Kind::MovingFriend => self.world.spawn((drawn, wave, Friend)),
                Kind::MovingFoe => self.world.spawn((drawn, wave, foe)),
                Kind::Friend => self.world.spawn((drawn, Friend)),
                Kind::Foe => self.world.spawn((drawn, foe)),
            };
            self.entities.push_back(entity.id());
        }
        self.spawned += u64::from(count);
    }

    fn despawn_oldest(&mut self, count: u32) {
        for entity in self.entities.drain(..self.entities.len().min(count as usize)) {
            self.world.despawn(entity);
        }
    }

    fn update(&mut self, scheduler: &Scheduler, time: f64) -> Result<(), JobPanic> {
        let tables = self.moving.contiguous_iter_mut(&mut self.world).expect("all components are in tables");
        for (waves, mut positions, mut orientations) in tables {
            let positions = positions.chunks_mut(ENTITIES_PER_JOB);
            let orientations = orientations.chunks_mut(ENTITIES_PER_JOB);
            let chunks = waves.chunks(ENTITIES_PER_JOB).zip(positions.zip(orientations));
            scheduler.parallel_for_each(chunks, |(waves, (positions, orientations)), _| {
                for (wave, (position, orientation)) in waves.iter().zip(positions.iter_mut().zip(orientations)) {
                    (*position, *orientation) = wave.pose(time);
                }
            })?;
        }
        Ok(())
    }

    fn lend(&mut self) -> LentColumns<'_> {
        let tables = self.drawn.contiguous_iter(&self.world).expect("all components are in tables");
        let columns =
            tables.map(|(numbers, positions, orientations, scales, extents, shapes, surfaces)| ArchetypeColumns {
                numbers: Number::peel_slice(numbers),
                moved: moved(&positions),
                positions: Position::peel_slice(positions.into_inner()),
                orientations: Orientation::peel_slice(orientations),
                scales: Scale::peel_slice(scales),
                bounds: Extent::peel_slice(extents),
                meshes: Shape::peel_slice(shapes),
                materials: Surface::peel_slice(surfaces),
            });
        LentColumns { tables: columns.collect() }
    }

    fn end_frame(&mut self) {
        self.world.clear_trackers();
    }
}

impl Lend for LentColumns<'_> {
    fn archetypes(&self) -> Vec<ArchetypeColumns<'_>> {
        self.tables.clone()
    }
}

/// What the ticks of positions say. Orientations change with them.
fn moved(positions: &ContiguousRef<'_, Position>) -> Moved {
    let (last_run, this_run) = (positions.last_run_tick(), positions.this_run_tick());
    let ticks = positions.changed_ticks_slice().iter().enumerate();
    let rows: Vec<_> =
        ticks.filter(|(_, tick)| tick.is_newer_than(last_run, this_run)).map(|(row, _)| row as u32).collect();
    match rows.len() {
        0 => Moved::None,
        count if count == positions.len() => Moved::All,
        _ => Moved::Rows(rows),
    }
}
