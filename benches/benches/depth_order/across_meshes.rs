//! Orders of all objects, whatever their meshes, which no sort key has.

use std::error::Error;
use std::sync::Arc;

use drawloom::glam::DVec3;
use drawloom::handle::Handle;
use drawloom::quality::DepthPrecision;
use drawloom::scene::{Blend, Camera, Material, Mesh, RenderObject, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom_testing::random::Random;

use crate::fragment_counter::{Counts, FragmentCounter, SURFACES};

/// An order of all objects of a draw state. Draw states are drawn one after the other, as usual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcrossMeshes {
    FrontToBack,
    Random,
    BackToFront,
}

impl AcrossMeshes {
    pub const ALL: [Self; 3] = [Self::FrontToBack, Self::Random, Self::BackToFront];

    pub fn name(self) -> &'static str {
        match self {
            Self::FrontToBack => "front to back, across meshes",
            Self::Random => "random, across meshes",
            Self::BackToFront => "back to front, across meshes",
        }
    }

    /// Draws the opaque objects that a camera sees in this order. The draws are the runs of objects with the same mesh.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    pub fn count(self, scheduler: &Arc<Scheduler>, scene: &Scene, camera: &Camera) -> Result<Counts, Box<dyn Error>> {
        let source = scene.as_scene_ref();
        let objects = self.objects(&source, camera)?;
        let mut counter = FragmentCounter::new(scheduler)?;
        let counts = counter.count(&with_a_mesh_each(&source, &objects)?, camera, DepthPrecision::UNORDERED)?;
        let list = counter.renderer.draw_list(SURFACES, 0).ok_or("the process draws no commands")?;
        // Meshes were added in the objects' order, so a mesh's slot is the object's position in it.
        let mesh = |slot: u32| source.meshes[objects[slot as usize]];
        let runs = list.batches.chunk_by(|one, next| (one.state, mesh(one.mesh)) == (next.state, mesh(next.mesh)));
        Ok(Counts { draws: runs.count(), ..counts })
    }

    /// The opaque objects in this order.
    fn objects(self, scene: &SceneRef<'_>, camera: &Camera) -> Result<Vec<usize>, Box<dyn Error>> {
        let mut objects = Vec::new();
        for object in 0..scene.object_count() {
            if scene.assets.get(scene.materials[object])?.blend == Blend::None {
                objects.push(object);
            }
        }
        let forward = camera.orientation.as_dquat() * DVec3::NEG_Z;
        let depth = |object: usize| {
            let center = scene.orientations[object] * (scene.bounds[object].center * scene.scales[object]);
            forward.dot(scene.positions[object] + center.as_dvec3() - camera.position)
        };
        match self {
            Self::FrontToBack => objects.sort_by(|&one, &other| depth(one).total_cmp(&depth(other))),
            Self::Random => objects = Random::new().order(objects.len()).iter().map(|&index| objects[index]).collect(),
            Self::BackToFront => objects.sort_by(|&one, &other| depth(other).total_cmp(&depth(one))),
        }
        Ok(objects)
    }
}

/// A scene of these objects, each with a mesh of its own. Without an order by depth they are drawn in the order of the
/// meshes' slots, which is that of `objects`.
fn with_a_mesh_each(source: &SceneRef<'_>, objects: &[usize]) -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::new();
    let mut materials: Vec<(Handle<Material>, Handle<Material>)> = Vec::new();
    for &object in objects {
        let material = match materials.iter().find(|(original, _)| *original == source.materials[object]) {
            Some(&(_, copy)) => copy,
            None => {
                let original = source.materials[object];
                let copy = scene.add(Material { texture: None, ..source.assets.get(original)?.clone() })?;
                materials.push((original, copy));
                copy
            }
        };
        let mesh: Mesh = source.assets.get(source.meshes[object])?.clone();
        let mesh = scene.add(mesh)?;
        scene.add_object(RenderObject {
            orientation: source.orientations[object],
            scale: source.scales[object],
            ..RenderObject::new(mesh, material, source.positions[object])
        })?;
    }
    Ok(scene)
}
