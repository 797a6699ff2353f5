//! What the example asks of a world, whatever entity-component system it is in.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh};
use drawloom::task::{JobPanic, Scheduler};

use crate::population::Looks;

/// A world of entities.
pub trait EngineWorld {
    /// What lends the columns: whatever the system's borrows need to stay alive.
    type Lent<'w>: Lend
    where
        Self: 'w;

    /// Spawns entities.
    fn spawn(&mut self, count: u32, looks: Looks, time: f64);

    /// Despawns the entities that have been there longest.
    fn despawn_oldest(&mut self, count: u32);

    /// Moves all entities that move, on all workers.
    ///
    /// # Errors
    /// If a job panics.
    fn update(&mut self, scheduler: &Scheduler, time: f64) -> Result<(), JobPanic>;

    /// Lends all columns that are drawn, until the frame is recorded.
    fn lend(&mut self) -> Self::Lent<'_>;

    /// The frame is recorded: what changes from now on is a change of the next one.
    fn end_frame(&mut self);
}

/// Lent columns.
pub trait Lend {
    /// The columns of each archetype with entities.
    fn archetypes(&self) -> Vec<ArchetypeColumns<'_>>;
}

/// The columns of an archetype: slices with one entry for each of its entities.
#[derive(Clone, Debug)]
pub struct ArchetypeColumns<'a> {
    pub numbers: &'a [u64],
    pub positions: &'a [DVec3],
    pub orientations: &'a [Quat],
    pub scales: &'a [Vec3],
    pub bounds: &'a [Bounds],
    pub meshes: &'a [Handle<Mesh>],
    pub materials: &'a [Handle<Material>],
    /// Which positions and orientations changed since the frame before. Other columns change only with the entity.
    pub moved: Moved,
}

/// Which entities of an archetype moved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Moved {
    None,
    All,
    /// By row.
    Rows(Vec<u32>),
}

/// How many entities a job moves.
pub const ENTITIES_PER_JOB: usize = 1024;
