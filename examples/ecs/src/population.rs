//! Which entities there are, and how they move.

use std::f64::consts::TAU;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh};

use crate::components::{Extent, Number, Orientation, Position, Scale, Shape, Surface, Wave};

/// Which entities there are.
#[derive(Clone, Copy, Debug)]
pub struct Population {
    pub name: &'static str,
    pub entities: u32,
    /// What entities have besides what is drawn: one after the other in turns.
    kinds: &'static [Kind],
}

/// What an entity has besides what is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Moving,
    MovingFriend,
    MovingFoe,
    Friend,
    Foe,
}

/// The components that all entities have.
pub type Drawn = (Number, Position, Orientation, Scale, Extent, Shape, Surface);

/// What all entities look like.
#[derive(Clone, Copy, Debug)]
pub struct Looks {
    pub mesh: Handle<Mesh>,
    pub bounds: Bounds,
    pub materials: [Handle<Material>; 3],
}

impl Population {
    /// All populations, of this number of entities.
    pub fn all(entities: u32) -> [Self; 3] {
        use Kind::{Foe, Friend, Moving, MovingFoe, MovingFriend};
        let population = |name, kinds| Self { name, entities, kinds };
        [
            population("one archetype, all move", &[Moving]),
            population("three archetypes, all move", &[Moving, MovingFriend, MovingFoe]),
            population(
                "three archetypes, a tenth moves",
                &[Moving, Friend, Foe, Friend, Foe, Friend, Foe, Friend, Foe, Friend],
            ),
        ]
    }

    /// What the entity of a number is.
    pub fn kind(self, number: u64) -> Kind {
        self.kinds[(number % self.kinds.len() as u64) as usize]
    }

    /// The wave of the entity of a number, which stands where the one stood that it replaces.
    pub fn wave(self, number: u64) -> Wave {
        let side = f64::from(self.entities).sqrt().ceil();
        let cell = (number % u64::from(self.entities)) as f64;
        let (x, z) = (cell % side - side / 2.0, (cell / side).floor() - side / 2.0);
        Wave { center: DVec3::new(x, 0.0, z) * 0.8, phase: x.hypot(z) * 0.6 }
    }

    /// What is drawn of the entity of a number.
    pub fn drawn(self, number: u64, looks: Looks, time: f64) -> Drawn {
        let (position, orientation) = self.wave(number).pose(time);
        (
            Number(number),
            position,
            orientation,
            Scale(Vec3::splat(0.25 + 0.05 * (number % 4) as f32)),
            Extent(looks.bounds),
            Shape(looks.mesh),
            Surface(looks.materials[(number % 3) as usize]),
        )
    }
}

impl Wave {
    /// Where it moves an entity at a time, in seconds.
    pub fn pose(self, time: f64) -> (Position, Orientation) {
        let angle = (self.phase - time * 2.0) % TAU;
        let height = angle.sin();
        (Position(self.center + DVec3::Y * height), Orientation(Quat::from_rotation_y((angle + height) as f32)))
    }
}
