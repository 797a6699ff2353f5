//! The entities in `hecs`. It knows no changes: what has a wave moves in every frame.

use std::collections::VecDeque;

use bytemuck::TransparentWrapper;
use drawloom::task::{JobPanic, Scheduler};
use hecs::{ArchetypeColumn, Entity, World};

use crate::components::{Extent, Foe, Friend, Number, Orientation, Position, Scale, Shape, Surface, Wave};
use crate::engine_world::{ArchetypeColumns, ENTITIES_PER_JOB, EngineWorld, Lend, Moved};
use crate::population::{Kind, Looks, Population};

/// The entities in `hecs`.
pub struct HecsWorld {
    world: World,
    population: Population,
    /// The oldest first.
    entities: VecDeque<Entity>,
    spawned: u64,
}

/// The columns of all archetypes. Each is borrowed from the world as long as its guard lives.
pub struct LentColumns<'w> {
    archetypes: Vec<Guards<'w>>,
}

struct Guards<'w> {
    numbers: ArchetypeColumn<'w, Number>,
    positions: ArchetypeColumn<'w, Position>,
    orientations: ArchetypeColumn<'w, Orientation>,
    scales: ArchetypeColumn<'w, Scale>,
    extents: ArchetypeColumn<'w, Extent>,
    shapes: ArchetypeColumn<'w, Shape>,
    surfaces: ArchetypeColumn<'w, Surface>,
    moves: bool,
}

impl HecsWorld {
    /// A world without entities.
    pub fn new(population: Population) -> Self {
        Self { world: World::new(), population, entities: VecDeque::new(), spawned: 0 }
    }
}

impl EngineWorld for HecsWorld {
    type Lent<'w> = LentColumns<'w>;

    fn spawn(&mut self, count: u32, looks: Looks, time: f64) {
        for number in self.spawned..self.spawned + u64::from(count) {
            let (n, p, o, s, e, h, m) = self.population.drawn(number, looks, time);
            let wave = self.population.wave(number);
            let foe = Foe { health: 1.0 };
            let entity = match self.population.kind(number) {
                Kind::Moving => self.world.spawn((n, p, o, s, e, h, m, wave)),
                Kind::MovingFriend => self.world.spawn((n, p, o, s, e, h, m, wave, Friend)),
                Kind::MovingFoe => self.world.spawn((n, p, o, s, e, h, m, wave, foe)),
                Kind::Friend => self.world.spawn((n, p, o, s, e, h, m, Friend)),
                Kind::Foe => self.world.spawn((n, p, o, s, e, h, m, foe)),
            };
            self.entities.push_back(entity);
        }
        self.spawned += u64::from(count);
    }

    fn despawn_oldest(&mut self, count: u32) {
        for entity in self.entities.drain(..self.entities.len().min(count as usize)) {
            // Nothing else despawns entities.
            self.world.despawn(entity).expect("the entity lives");
        }
    }

    fn update(&mut self, scheduler: &Scheduler, time: f64) -> Result<(), JobPanic> {
        for archetype in self.world.archetypes() {
            let columns = archetype.get::<&Wave>().zip(archetype.get::<&mut Position>());
            let Some((waves, mut positions)) = columns else { continue };
            let Some(mut orientations) = archetype.get::<&mut Orientation>() else { continue };
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
        let archetypes = self.world.archetypes().filter(|archetype| !archetype.is_empty()).filter_map(|archetype| {
            Some(Guards {
                numbers: archetype.get::<&Number>()?,
                positions: archetype.get::<&Position>()?,
                orientations: archetype.get::<&Orientation>()?,
                scales: archetype.get::<&Scale>()?,
                extents: archetype.get::<&Extent>()?,
                shapes: archetype.get::<&Shape>()?,
                surfaces: archetype.get::<&Surface>()?,
                moves: archetype.has::<Wave>(),
            })
        });
        LentColumns { archetypes: archetypes.collect() }
    }

    fn end_frame(&mut self) {}
}

impl Lend for LentColumns<'_> {
    fn archetypes(&self) -> Vec<ArchetypeColumns<'_>> {
        let columns = self.archetypes.iter().map(|guards| ArchetypeColumns {
            numbers: Number::peel_slice(&guards.numbers),
            positions: Position::peel_slice(&guards.positions),
            orientations: Orientation::peel_slice(&guards.orientations),
            scales: Scale::peel_slice(&guards.scales),
            bounds: Extent::peel_slice(&guards.extents),
            meshes: Shape::peel_slice(&guards.shapes),
            materials: Surface::peel_slice(&guards.surfaces),
            moved: if guards.moves { Moved::All } else { Moved::None },
        });
        columns.collect()
    }
}
