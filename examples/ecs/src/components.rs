//! The components of the engine's entities. Each is a value that Drawloom reads, under a name of the engine's own.

use bevy_ecs::component::Component;
use bytemuck::TransparentWrapper;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh};

/// Which entity it is. No other has the same number, before or after it.
#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Number(pub u64);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Position(pub DVec3);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Orientation(pub Quat);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Scale(pub Vec3);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Extent(pub Bounds);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Shape(pub Handle<Mesh>);

#[derive(Clone, Copy, Component, TransparentWrapper)]
#[repr(transparent)]
pub struct Surface(pub Handle<Material>);

/// What moves an entity up and down: entities without it stand still.
#[derive(Clone, Copy, Component)]
pub struct Wave {
    /// In the middle of its way, in metres.
    pub center: DVec3,
    /// In radians.
    pub phase: f64,
}

/// Nothing that is drawn: entities with it are in an archetype of their own.
#[derive(Clone, Copy, Component)]
pub struct Friend;

/// Nothing that is drawn either.
#[derive(Clone, Copy, Component)]
pub struct Foe {
    #[expect(dead_code, reason = "what an engine keeps beside what is drawn")]
    pub health: f32,
}
