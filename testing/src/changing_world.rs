//! An engine's world that changes at random, and reports what changed.

use std::ops::Range;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Blend, Bounds, Changes, ColumnValues, Material, Mesh, Scene, SceneError, SceneRef};

use crate::random::Random;
use crate::scenes::{cube, field};
use crate::tinted::TINT;

/// An engine's own storage of objects.
pub struct ChangingWorld {
    /// Cameras, lights and assets.
    pub scene: Scene,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
    tints: Vec<[f32; 4]>,
    /// Handles that objects may have; some may be stale.
    known_meshes: Vec<Handle<Mesh>>,
    known_materials: Vec<Handle<Material>>,
    changes: Report,
    /// The number of objects before the latest step.
    count_before: usize,
    random: Random,
}

/// What the world reports of its last step.
enum Report {
    Unknown,
    Objects(Vec<u32>),
    Ranges(Vec<Range<u32>>),
}

impl ChangingWorld {
    /// A field of `count` objects.
    pub fn new(seed: u64, count: usize) -> Self {
        let scene = field(count);
        let objects = scene.as_scene_ref();
        Self {
            positions: objects.positions.to_vec(),
            orientations: objects.orientations.to_vec(),
            scales: objects.scales.to_vec(),
            bounds: objects.bounds.to_vec(),
            meshes: objects.meshes.to_vec(),
            materials: objects.materials.to_vec(),
            tints: vec![[0.5, 0.25, 1.0, 1.0]; count],
            known_meshes: scene.assets().iter().map(|(handle, _)| handle).collect(),
            known_materials: scene.assets().iter().map(|(handle, _)| handle).collect(),
            changes: Report::Unknown,
            count_before: 0,
            random: Random::stream(seed),
            scene,
        }
    }

    /// The scene, with what the last step reported.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            layers: &[],
            columns: &[],
            changes: match &self.changes {
                Report::Unknown => Changes::Unknown,
                Report::Objects(objects) => Changes::Objects(objects),
                Report::Ranges(ranges) => Changes::Ranges(ranges),
            },
            ..self.scene.as_scene_ref()
        }
    }

    /// The colour of each object, which `as_scene_ref` leaves out.
    pub fn tints(&self) -> ColumnValues<'_> {
        TINT.values(&self.tints)
    }

    /// Makes some changes, and returns their names.
    ///
    /// # Errors
    /// Returns an error if an asset cannot be changed.
    pub fn step(&mut self) -> Result<String, SceneError> {
        let mut changed = Vec::new();
        let mut names = Vec::new();
        self.count_before = self.positions.len();
        for _ in 0..self.random.below(4) {
            names.push(self.change(&mut changed)?);
        }
        self.changes = self.report(changed);
        Ok(names.join(", "))
    }

    fn change(&mut self, changed: &mut Vec<u32>) -> Result<&'static str, SceneError> {
        let kind = self.random.below(16);
        if self.positions.is_empty() && matches!(kind, 0..8 | 14) {
            return Ok("nothing");
        }
        Ok(match kind {
            0 | 1 => {
                for _ in 0..=self.random.below(20) {
                    let object = self.any_object(changed);
                    self.positions[object] += self.random.direction() * self.random.between(0.0, 5.0);
                    self.orientations[object] *= Quat::from_rotation_x(0.3);
                }
                "moved"
            }
            2 => {
                let object = self.any_object(changed);
                self.scales[object].y = -self.scales[object].y;
                "mirrored"
            }
            3 => {
                let (object, mesh) = (self.any_object(changed), self.random.below(self.known_meshes.len()));
                self.meshes[object] = self.known_meshes[mesh];
                "another mesh"
            }
            4 => {
                let (object, material) = (self.any_object(changed), self.random.below(self.known_materials.len()));
                self.materials[object] = self.known_materials[material];
                "another material"
            }
            5 => {
                let object = self.any_object(changed);
                let invalid = [DVec3::NAN, DVec3::splat(1e12), DVec3::ZERO];
                self.positions[object] = invalid[self.random.below(invalid.len())];
                "an invalid position"
            }
            6 => {
                let object = self.any_object(changed);
                self.remove(object);
                "removed"
            }
            7 => {
                let left = self.random.below(self.positions.len() + 1);
                (0..self.random.below(70)).for_each(|_| {
                    if self.positions.len() > left {
                        self.remove(self.positions.len() - 1);
                    }
                });
                "shrunk"
            }
            8 => {
                let count = self.random.below(100);
                (0..count).for_each(|_| self.add(changed));
                "grown"
            }
            9 => {
                let camera = self.random.below(self.scene.cameras.len());
                self.scene.cameras[camera].position += self.random.direction();
                "a camera moved"
            }
            10 => {
                let index = self.random.below(self.known_materials.len());
                if let Ok(material) = self.scene.assets().get(self.known_materials[index]).cloned() {
                    let blends = [Blend::None, Blend::None, Blend::Alpha];
                    let blend = blends[self.random.below(blends.len())];
                    let double_sided = !material.double_sided;
                    self.scene.replace(self.known_materials[index], Material { blend, double_sided, ..material })?;
                }
                "a material replaced"
            }
            11 => {
                let index = self.random.below(self.known_meshes.len());
                if self.scene.assets().iter::<Mesh>().count() > 1 {
                    // The world goes on to use the stale handle.
                    drop(self.scene.remove(self.known_meshes[index]));
                }
                "a mesh removed"
            }
            12 => {
                self.known_meshes.push(self.scene.add(cube())?);
                "a mesh added"
            }
            14 => {
                let object = self.any_object(changed);
                let [red, green, blue] = self.random.vector(0.0, 1.0).to_array();
                self.tints[object] = [red, green, blue, 0.5];
                "another tint"
            }
            _ => {
                self.positions = self.positions.to_vec();
                self.meshes = self.meshes.to_vec();
                self.tints = self.tints.to_vec();
                "other storage"
            }
        })
    }

    fn any_object(&mut self, changed: &mut Vec<u32>) -> usize {
        let object = self.random.below(self.positions.len());
        changed.push(object as u32);
        object
    }

    /// Removes an object; the last one takes its place.
    fn remove(&mut self, object: usize) {
        self.positions.swap_remove(object);
        self.orientations.swap_remove(object);
        self.scales.swap_remove(object);
        self.bounds.swap_remove(object);
        self.meshes.swap_remove(object);
        self.materials.swap_remove(object);
        self.tints.swap_remove(object);
    }

    /// Adds an object, and reports it only if one with its index was removed in the same step.
    fn add(&mut self, changed: &mut Vec<u32>) {
        let random = &mut self.random;
        if self.positions.len() < self.count_before {
            changed.push(self.positions.len() as u32);
        }
        let mesh = self.known_meshes[random.below(self.known_meshes.len())];
        self.positions.push(random.vector(-20.0, 20.0).as_dvec3());
        self.orientations.push(Quat::IDENTITY);
        self.scales.push(random.vector(0.2, 1.0));
        self.bounds.push(self.scene.assets().get(mesh).map_or(Bounds::default(), Mesh::bounds));
        self.meshes.push(mesh);
        self.materials.push(self.known_materials[random.below(self.known_materials.len())]);
        self.tints.push(random.vector(0.0, 1.0).extend(1.0).to_array());
    }

    /// Reports changes in one of the possible ways: repeated, in any order, with more objects than changed, and with
    /// objects that do not exist.
    fn report(&mut self, mut changed: Vec<u32>) -> Report {
        let count = self.positions.len() as u32;
        match self.random.below(5) {
            0 => Report::Unknown,
            1 | 2 => {
                changed.extend_from_within(..changed.len() / 2);
                if self.random.below(3) == 0 {
                    changed.extend([count, u32::MAX, 0]);
                }
                let order = self.random.order(changed.len());
                Report::Objects(order.into_iter().map(|index| changed[index]).collect())
            }
            _ => {
                let around = |&object: &u32| object.saturating_sub(2)..object.saturating_add(1 + object % 100);
                let mut ranges: Vec<_> = changed.iter().map(around).collect();
                if self.random.below(3) == 0 {
                    ranges.extend([count..u32::MAX, Range { start: 7, end: 3 }]);
                }
                Report::Ranges(ranges)
            }
        }
    }
}
