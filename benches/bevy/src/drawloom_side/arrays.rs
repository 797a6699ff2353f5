//! A world of arrays, one per property.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh, SceneError, SceneRef};
use drawloom::task::{JobPanic, Scheduler};

use super::assets::Surroundings;
use super::{CHUNK, World};
use crate::contender::Failure;
use crate::layout::Layout;

pub struct Arrays {
    surroundings: Surroundings,
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
        Ok(Self {
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
    fn advance(&mut self, step: DVec3, scheduler: &Scheduler) -> Result<(), JobPanic> {
        scheduler.parallel_for_each(self.positions.chunks_mut(CHUNK), |positions, _| {
            positions.iter_mut().for_each(|position| *position += step);
        })
    }

    fn lend(&mut self, draw: &mut dyn FnMut(SceneRef<'_>) -> Result<(), Failure>) -> Result<(), Failure> {
        draw(SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            ..self.surroundings.as_scene_ref()
        })
    }
}
