//! A scene whose lights, glass and mirror come and go.

use std::error::Error;

use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Camera, Changes, ClipPlane, LayerMask, Light, Material, Mesh, ObjectHandle, RenderObject, Scene, SceneRef, ViewKind,
};
use drawloom::view::LightClass;
use drawloom_benches::mirror;
use drawloom_testing::scenes::everything::{class_of, everything, glasses};

/// The scene, and which of its features it has now.
pub struct World {
    scene: Scene,
    has: [bool; World::FEATURES],
    lights: Vec<Light>,
    glass: Vec<(ObjectHandle, RenderObject)>,
    /// The indices of the glass.
    glass_indices: Vec<u32>,
    stone: Handle<Material>,
    cameras: [Camera; 2],
    frames: usize,
    /// Whether the glass changed since the last frame.
    glass_changed: bool,
}

impl World {
    /// The classes of lights, glass, and the mirror.
    pub const FEATURES: usize = LightClass::COUNT + 2;
    const GLASS: usize = LightClass::COUNT;
    const MIRROR: usize = LightClass::COUNT + 1;

    /// A scene with every feature, and with this many boxes.
    pub fn new(boxes: usize, size: [u32; 2]) -> Result<Self, Box<dyn Error>> {
        let mut scene = everything();
        let mesh = scene.add(Mesh::cuboid("box", Vec3::splat(0.1))?)?;
        let stone = scene.add(Material::default())?;
        let side = boxes.isqrt().max(1);
        for index in 0..boxes {
            let [x, z] = [index % side, index / side].map(|place| 0.2 * place as f64);
            let position = DVec3::new(x - 0.1 * side as f64, 0.05, 2.0 - z);
            scene.add_object(RenderObject { layers: WORLD, ..RenderObject::new(mesh, stone, position) })?;
        }
        let mut surface = RenderObject::new(mesh, stone, DVec3::new(0.0, 0.06, 5.0));
        (surface.layers, surface.scale) = (mirror::LAYER, Vec3::new(20.0, 0.1, 10.0));
        scene.add_object(surface)?;

        let materials: Vec<_> = glasses(&scene).into_iter().map(|(handle, _)| handle).collect();
        let (mut glass, mut glass_indices) = (Vec::new(), Vec::new());
        for (index, handle) in (0..).zip(scene.objects()) {
            let object = scene.object(handle)?;
            if materials.contains(&object.material) {
                glass.push((handle, object));
                glass_indices.push(index);
            }
        }
        let main = Camera { size, ..scene.cameras[0].clone() };
        let plane = ClipPlane { point: DVec3::Y * 0.06, normal: Vec3::Y };
        let reflected = Camera { layers: WORLD, ..main.reflected(mirror::VIEW, plane) };
        let lights = std::mem::take(&mut scene.lights);
        let mut world = Self {
            scene,
            has: [true; Self::FEATURES],
            lights,
            glass,
            glass_indices,
            stone,
            cameras: [main, Camera { kind: ViewKind::Reflection, ..reflected }],
            frames: 0,
            glass_changed: false,
        };
        world.set_lights();
        Ok(world)
    }

    /// Takes away the feature of this index, or brings it back.
    ///
    /// # Errors
    /// If an object cannot be replaced.
    pub fn toggle(&mut self, feature: usize) -> Result<(), Box<dyn Error>> {
        self.has[feature] = !self.has[feature];
        match feature {
            Self::GLASS => {
                for (handle, object) in &self.glass {
                    let material = if self.has[feature] { object.material } else { self.stone };
                    self.scene.replace_object(*handle, RenderObject { material, ..*object })?;
                }
                self.glass_changed = true;
            }
            Self::MIRROR => {}
            _ => self.set_lights(),
        }
        Ok(())
    }

    /// The next frame, whose cameras have moved.
    pub fn frame(&mut self) -> SceneRef<'_> {
        for camera in &mut self.cameras {
            camera.position.x += if self.frames.is_multiple_of(2) { 0.01 } else { -0.01 };
        }
        self.frames += 1;
        let changed = std::mem::take(&mut self.glass_changed);
        let changes = if changed { Changes::Objects(&self.glass_indices) } else { Changes::NONE };
        let cameras = if self.has[Self::MIRROR] { &self.cameras[..] } else { &self.cameras[..1] };
        SceneRef { cameras, changes, ..self.scene.as_scene_ref() }
    }

    fn set_lights(&mut self) {
        let has = |light: &Light| LightClass::all().zip(self.has).any(|(class, has)| has && class == class_of(light));
        self.scene.lights = self.lights.iter().copied().filter(has).collect();
    }
}

const WORLD: LayerMask = LayerMask::layer(0);
