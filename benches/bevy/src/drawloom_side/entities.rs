//! A `bevy_ecs` world, whose columns are lent without copying them.
//!
//! All objects have the same components, so they are rows of one table, and each component is one slice. An engine with
//! objects in several tables would gather the slices, or draw a scene for each.

use bevy_ecs::component::Component;
use bevy_ecs::query::QueryState;
use bevy_ecs::world::World as EcsWorld;
use bytemuck::TransparentWrapper;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh, SceneError, SceneRef};
use drawloom::task::{JobPanic, Scheduler};

use super::assets::Surroundings;
use super::{CHUNK, World};
use crate::contender::Failure;
use crate::layout::{self, Layout};

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct Position(DVec3);

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct Orientation(Quat);

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct Scale(Vec3);

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct BoundsOf(Bounds);

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct MeshOf(Handle<Mesh>);

#[derive(Component, TransparentWrapper)]
#[repr(transparent)]
struct MaterialOf(Handle<Material>);

type Columns =
    (&'static Position, &'static Orientation, &'static Scale, &'static BoundsOf, &'static MeshOf, &'static MaterialOf);

pub struct Entities {
    surroundings: Surroundings,
    world: EcsWorld,
    moving: QueryState<&'static mut Position>,
    drawn: QueryState<Columns>,
}

impl Entities {
    pub fn new(layout: &Layout) -> Result<Self, SceneError> {
        let surroundings = Surroundings::new(layout)?;
        let mut world = EcsWorld::new();
        let entity = |(object, position)| {
            (
                Position(DVec3::from_array(position)),
                Orientation(Quat::IDENTITY),
                Scale(Vec3::ONE),
                BoundsOf(surroundings.bounds),
                MeshOf(surroundings.meshes[Layout::mesh(object)]),
                MaterialOf(surroundings.materials[Layout::material(object)]),
            )
        };
        world.spawn_batch(layout.positions().enumerate().map(entity).collect::<Vec<_>>());
        let (moving, drawn) = (world.query(), world.query());
        Ok(Self { surroundings, world, moving, drawn })
    }
}

impl World for Entities {
    fn advance(&mut self, frame: u32, scheduler: &Scheduler) -> Result<(), JobPanic> {
        let step = DVec3::from_array(layout::step(frame));
        let Ok(tables) = self.moving.contiguous_iter_mut(&mut self.world) else { return Ok(()) };
        for mut positions in tables {
            let positions = Position::peel_slice_mut(&mut positions);
            scheduler.parallel_for_each(positions.chunks_mut(CHUNK), |positions, _| {
                positions.iter_mut().for_each(|position| *position += step);
            })?;
        }
        Ok(())
    }

    fn lend(&mut self, draw: &mut dyn FnMut(SceneRef<'_>) -> Result<(), Failure>) -> Result<(), Failure> {
        let mut tables = self.drawn.contiguous_iter(&self.world).map_err(|_| "a component is not stored in tables")?;
        let (Some((positions, orientations, scales, bounds, meshes, materials)), None) = (tables.next(), tables.next())
        else {
            return Err("the objects are not rows of one table".into());
        };
        draw(SceneRef {
            positions: Position::peel_slice(positions),
            orientations: Orientation::peel_slice(orientations),
            scales: Scale::peel_slice(scales),
            bounds: BoundsOf::peel_slice(bounds),
            meshes: MeshOf::peel_slice(meshes),
            materials: MaterialOf::peel_slice(materials),
            ..self.surroundings.as_scene_ref()
        })
    }
}
