//! The world: what the engine has, and the nodes that make the rest of it in each frame.

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{
    Camera, Changes, GeneratedBuffer, Light, Material, Mesh, NodeColumn, RenderObject, Scene, SceneError, SceneRef,
    WrittenColumns,
};
use drawloom::{FrameError, FrameInputs, RecordedFrame, Renderer};

use crate::creature::{self, Creature};
use crate::mirror::{self, BuildBvh, Reflected, TraceMirror};
use crate::sound::Sound;
use crate::sparks::Sparks;
use crate::terrain::Terrain;
use crate::walkers::{self, Walkers, walker};
use crate::{PICTURE, colors};

pub struct World {
    /// Its objects are the land, the creature, the mirror's frame and then the walkers.
    scene: Scene,
    /// The engine's own columns, which nodes write.
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    terrain: Terrain,
    creature: Creature,
    sparks: Sparks,
    pub sound: Sound,
    reflected: Reflected,
    mirror: GeneratedBuffer<[f32; 4]>,
}

/// The index of the land among the objects, and that of the first walker.
const LAND: usize = 0;
const FIRST_WALKER: usize = 3;

impl World {
    pub fn new() -> Result<Self, SceneError> {
        let (terrain, creature) = (Terrain::new(), Creature::new());
        let mut scene = Scene::new();
        let material = |scene: &mut Scene, diffuse| scene.add(Material { diffuse, ..Material::default() });
        let mesh = scene.add(terrain.mesh()?)?;
        let land = material(&mut scene, colors::LAND)?;
        scene.add_object(RenderObject::new(mesh, land, DVec3::ZERO))?;
        let mesh = scene.add(creature.mesh()?)?;
        let skin = material(&mut scene, colors::CREATURE)?;
        scene.add_object(RenderObject::new(mesh, skin, creature::POSITION))?;
        let size = Vec3::new(mirror::HALF.x * 2.0 + 0.6, mirror::HALF.y * 2.0 + 0.6, 0.3);
        let mesh = scene.add(Mesh::cuboid("frame of the mirror", size)?)?;
        let wood = material(&mut scene, colors::FRAME)?;
        let behind = mirror::MIDDLE.as_dvec3() - DVec3::Z * 0.2;
        scene.add_object(RenderObject::new(mesh, wood, behind))?;
        let mesh = scene.add(Mesh::cuboid("walker", colors::WALKER_SIZE)?)?;
        let cloth = material(&mut scene, colors::WALKER)?;
        for number in 0..walkers::COUNT {
            scene.add_object(RenderObject::new(mesh, cloth, walker(number, 0.0).0))?;
        }
        (scene.ambient, scene.background) = (colors::AMBIENT, colors::SKY);
        let (direction, illuminance) = (colors::SUN_DIRECTION.normalize(), colors::SUN);
        scene.lights.push(Light::Directional { direction, illuminance, casts_shadow: true });
        let lent = scene.as_scene_ref();
        let (positions, orientations) = (lent.positions.to_vec(), lent.orientations.to_vec());
        Ok(Self {
            scene,
            positions,
            orientations,
            terrain,
            creature,
            sparks: Sparks::new(),
            sound: Sound::new(),
            reflected: Reflected::default(),
            mirror: mirror::pixels(),
        })
    }

    /// How many particles the latest frame had.
    pub fn sparks(&self) -> usize {
        self.sparks.count()
    }

    /// Records the frame of a time, with all that its nodes make.
    pub fn record(
        &mut self,
        renderer: &mut Renderer<WgpuBackend>,
        seconds: f32,
    ) -> Result<RecordedFrame<WgpuBackend>, FrameError> {
        let angle = f64::from((seconds * 0.4).sin()) * 0.5;
        let eye = DVec3::new(angle.sin() * 19.0 + 1.0, 6.5, angle.cos() * 19.0);
        let mut camera = Camera::looking_at("main", eye, DVec3::new(0.0, 3.2, 2.0));
        camera.size = PICTURE;
        self.positions[LAND] = self.terrain.follow(eye);
        self.creature.set_time(seconds);
        self.sparks.set_time(seconds);
        self.sound.set_time(seconds);

        let positions = &NodeColumn::new(&mut self.positions);
        let orientations = &NodeColumn::new(&mut self.orientations);
        let walkers = Walkers { positions, orientations, first: FIRST_WALKER, seconds };
        let (reflected, creature) = (&self.reflected, &self.creature);
        let build_bvh = BuildBvh { reflected, creature, positions, orientations, first_walker: FIRST_WALKER };
        let trace_mirror = TraceMirror { reflected, pixels: &self.mirror };
        let written = WrittenColumns {
            positions: Some(positions),
            orientations: Some(orientations),
            ..WrittenColumns::default()
        };
        let cameras = [camera];
        let scene = SceneRef { written, cameras: &cameras, changes: Changes::Unknown, ..self.scene.as_scene_ref() };
        renderer.record_with(FrameInputs {
            nodes: &[&walkers, &self.terrain, creature, &self.sparks, &self.sound, &build_bvh, &trace_mirror],
            ..FrameInputs::new(scene)
        })
    }
}
