//! A world of arrays, one per property.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Changes, Material, Mesh, SceneError, SceneRef};
use drawloom::task::{JobPanic, Scheduler};

use super::assets::Surroundings;
use super::{CHUNK, World};
use crate::contender::Failure;
use crate::layout::{self, Layout, Motion};

pub struct Arrays {
    surroundings: Surroundings,
    motion: Motion,
    /// The objects that move, unless all do.
    moving: Vec<u32>,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

impl Arrays {
    pub fn new(layout: &Layout) -> Result<Self, SceneError> {
        let surroundings = Surroundings::new(layout)?;
        let objects = 0..layout.objects;
        let moving = match layout.motion {
            Motion::AllObjects => Vec::new(),
            Motion::FewObjects | Motion::Nothing | Motion::Cameras => {
                (0..).zip(objects.clone()).filter(|&(_, object)| layout.moves(object)).map(|(index, _)| index).collect()
            }
        };
        Ok(Self {
            motion: layout.motion,
            moving,
            positions: layout.positions().map(DVec3::from_array).collect(),
            orientations: vec![Quat::IDENTITY; layout.objects],
            scales: vec![Vec3::ONE; layout.objects],
            bounds: vec![surroundings.bounds; layout.objects],
            meshes: objects.clone().map(|object| surroundings.meshes[Layout::mesh(object)]).collect(),
            materials: objects.map(|object| surroundings.materials[Layout::material(object)]).collect(),
            surroundings,
        })
    }
}

impl World for Arrays {
    fn advance(&mut self, frame: u32, scheduler: &Scheduler) -> Result<(), JobPanic> {
        let step = DVec3::from_array(layout::step(frame));
        match self.motion {
            Motion::AllObjects => scheduler.parallel_for_each(self.positions.chunks_mut(CHUNK), |positions, _| {
                positions.iter_mut().for_each(|position| *position += step);
            })?,
            Motion::FewObjects => self.moving.iter().for_each(|&object| self.positions[object as usize] += step),
            Motion::Nothing => {}
            Motion::Cameras => self.surroundings.turn(frame),
        }
        Ok(())
    }

    fn lend(&mut self, draw: &mut dyn FnMut(SceneRef<'_>) -> Result<(), Failure>) -> Result<(), Failure> {
        draw(SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            // As Bevy knows by itself which components changed. The first frame is derived anew in any case.
            changes: match self.motion {
                Motion::AllObjects => Changes::Unknown,
                Motion::FewObjects | Motion::Nothing | Motion::Cameras => Changes::Objects(&self.moving),
            },
            ..self.surroundings.as_scene_ref()
        })
    }
}
