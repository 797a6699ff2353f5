//! A world in which everything comes and goes.

use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Blend, Camera, Changes, Light, Material, Mesh, ObjectHandle, RenderObject, Scene, SceneRef, StaticGroup, Texture,
};
use drawloom_testing::random::Random;

/// A world, and its parts that may go.
pub struct World {
    pub scene: Scene,
    objects: Vec<ObjectHandle>,
    /// Each with its own texture.
    materials: Vec<(Handle<Material>, Handle<Texture>)>,
    meshes: Vec<Handle<Mesh>>,
    /// Objects that stand still for ever, as one static group.
    room: Vec<ObjectHandle>,
    /// The indices of the objects that changed since the last frame; `None` if that may be any.
    changed: Option<Vec<u32>>,
}

/// The most of each.
const MAX_OBJECTS: usize = 40;
const MAX_MATERIALS: usize = 6;
const MAX_MESHES: usize = 6;
const MAX_LIGHTS: usize = 3;
const MAX_CAMERAS: usize = 3;

impl World {
    pub fn new() -> Self {
        let mut world = Self {
            scene: Scene::new(),
            objects: Vec::new(),
            materials: Vec::new(),
            meshes: Vec::new(),
            room: Vec::new(),
            changed: None,
        };
        world.furnish();
        world.reset();
        world
    }

    fn furnish(&mut self) {
        let mesh = self.scene.add(Mesh::cuboid("shelf", Vec3::splat(0.4)).unwrap()).unwrap();
        let material = self.scene.add(Material::default()).unwrap();
        for shelf in 0..12 {
            let object = RenderObject::new(mesh, material, DVec3::new(f64::from(shelf) - 6.0, -2.0, -3.0));
            self.room.push(self.scene.add_object(object).unwrap());
        }
    }

    /// The objects that a node moves, by index, in ascending order: every third one that does not stand still.
    pub fn moving_objects(&self) -> Vec<u32> {
        (0..)
            .zip(self.scene.objects())
            .filter(|(index, object)| index % 3 == 0 && !self.room.contains(object))
            .map(|(index, _)| index)
            .collect()
    }

    /// The scene, and what changed in it since the last frame: what the world knows of, and what moves.
    pub fn report<'a>(&'a mut self, moving: &'a [u32]) -> SceneRef<'a> {
        // Objects that are removed move others to their index.
        let room = self.scene.object_set(self.room.iter().copied()).unwrap();
        self.scene.static_groups = vec![StaticGroup::new("room", room)];
        let changes = match &mut self.changed {
            None => Changes::Unknown,
            Some(changed) => {
                changed.extend(moving);
                Changes::Objects(changed)
            }
        };
        SceneRef { changes, ..self.scene.as_scene_ref() }
    }

    /// The next frame is not told of the changes so far.
    pub fn forget_changes(&mut self) {
        self.changed = Some(Vec::new());
    }

    /// Makes the world what it was at first, without making a new one.
    pub fn reset(&mut self) {
        self.changed = None;
        for object in self.objects.drain(..) {
            self.scene.remove_object(object).unwrap();
        }
        self.materials.drain(..).for_each(|(material, texture)| {
            self.scene.remove(material).unwrap();
            self.scene.remove(texture).unwrap();
        });
        for mesh in self.meshes.drain(..) {
            self.scene.remove(mesh).unwrap();
        }
        self.scene.lights.clear();
        self.scene.cameras = vec![camera(0, [32, 24])];
        let mut random = Random::stream(3);
        self.add_mesh(&mut random);
        self.add_material(&mut random);
        for _ in 0..4 {
            self.add_object(&mut random);
        }
    }

    /// Something comes, goes or changes. Returns whether it was the size of a picture.
    pub fn change(&mut self, random: &mut Random) -> bool {
        let change = random.below(12);
        // What comes, goes or gets another material may move other objects to other indices. The others change no
        // object but one.
        if matches!(change, 0..=4) {
            self.changed = None;
        }
        match change {
            0 | 1 if self.objects.len() < MAX_OBJECTS => self.add_object(random),
            0..=2 if self.objects.len() > 1 => {
                let object = self.objects.swap_remove(random.below(self.objects.len()));
                self.scene.remove_object(object).unwrap();
            }
            3 if self.materials.len() < MAX_MATERIALS => self.add_material(random),
            3 => self.remove_material(random),
            4 if self.meshes.len() < MAX_MESHES => self.add_mesh(random),
            4 => self.remove_mesh(random),
            5 if self.scene.lights.len() < MAX_LIGHTS => self.scene.lights.push(light(random)),
            5 => self.scene.lights.clear(),
            6 if self.scene.cameras.len() < MAX_CAMERAS => {
                let index = self.scene.cameras.len();
                self.scene.cameras.push(camera(index, [16, 16]));
            }
            6 => self.scene.cameras.truncate(1),
            7 => {
                let index = random.below(self.scene.cameras.len());
                self.scene.cameras[index].size = [8 + random.below(40) as u32, 8 + random.below(40) as u32];
                return true;
            }
            8 => {
                let texture = texture(random);
                let (_, handle) = self.materials[random.below(self.materials.len())];
                self.scene.replace(handle, texture).unwrap();
            }
            _ => {
                let handle = self.objects[random.below(self.objects.len())];
                let object = self.scene.object(handle).unwrap();
                self.scene.replace_object(handle, RenderObject { position: position(random), ..object }).unwrap();
                if let Some(changed) = &mut self.changed {
                    changed.extend(
                        (0..).zip(self.scene.objects()).find(|(_, other)| *other == handle).map(|(index, _)| index),
                    );
                }
            }
        }
        false
    }

    fn add_object(&mut self, random: &mut Random) {
        let mesh = self.meshes[random.below(self.meshes.len())];
        let (material, _) = self.materials[random.below(self.materials.len())];
        let object = RenderObject::new(mesh, material, position(random));
        self.objects.push(self.scene.add_object(object).unwrap());
    }

    fn add_mesh(&mut self, random: &mut Random) {
        let size = random.between(0.5, 1.5) as f32;
        self.meshes.push(self.scene.add(Mesh::cuboid("box", Vec3::splat(size)).unwrap()).unwrap());
    }

    fn add_material(&mut self, random: &mut Random) {
        let texture = self.scene.add(texture(random)).unwrap();
        let blend = if random.below(3) == 0 { Blend::Alpha } else { Blend::None };
        let material = Material { texture: Some(texture), blend, opacity: 0.7, ..Material::default() };
        self.materials.push((self.scene.add(material).unwrap(), texture));
    }

    /// Removes a material, and the objects that have it.
    fn remove_material(&mut self, random: &mut Random) {
        let (material, texture) = self.materials.swap_remove(random.below(self.materials.len()));
        self.remove_objects(|object| object.material == material);
        self.scene.remove(material).unwrap();
        self.scene.remove(texture).unwrap();
    }

    fn remove_mesh(&mut self, random: &mut Random) {
        let mesh = self.meshes.swap_remove(random.below(self.meshes.len()));
        self.remove_objects(|object| object.mesh == mesh);
        self.scene.remove(mesh).unwrap();
    }

    /// Removes objects, and leaves at least one in the world.
    fn remove_objects(&mut self, is_removed: impl Fn(&RenderObject) -> bool) {
        let scene = &mut self.scene;
        self.objects.retain(|handle| {
            let stays = !is_removed(&scene.object(*handle).unwrap());
            if !stays {
                scene.remove_object(*handle).unwrap();
            }
            stays
        });
        if self.objects.is_empty() {
            self.add_object(&mut Random::stream(5));
        }
    }
}

fn camera(index: usize, size: [u32; 2]) -> Camera {
    Camera {
        size,
        ..Camera::looking_at(format!("camera {index}"), DVec3::new(0.0, 2.0, 9.0 + index as f64), DVec3::ZERO)
    }
}

fn position(random: &mut Random) -> DVec3 {
    DVec3::new(random.between(-4.0, 4.0), random.between(-2.0, 2.0), random.between(-4.0, 4.0))
}

fn light(random: &mut Random) -> Light {
    match random.below(3) {
        0 => Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: random.below(2) == 0 },
        _ => Light::Point {
            position: position(random),
            intensity: Vec3::splat(20.0),
            range: 12.0,
            casts_shadow: random.below(4) == 0,
        },
    }
}

fn texture(random: &mut Random) -> Texture {
    let side = 4 << random.below(3);
    let pixels = (0..side * side * 4).map(|_| random.below(256) as u8).collect();
    Texture::new("noise", side as u32, side as u32, pixels).unwrap()
}
