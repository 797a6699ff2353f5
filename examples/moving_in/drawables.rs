//! What the engine draws: the interface of drawables, and three kinds of them.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Quat, Vec3, Vec4};

use super::engine::{DrawPass, MAIN, MIRROR, SHADOW};

/// The bits of all views.
pub const ALL_VIEWS: u32 = 1 << SHADOW | 1 << MIRROR | 1 << MAIN;

pub trait Drawable: Send + Sync {
    /// The index of its material. All its draws have one.
    fn material(&self) -> usize;

    /// The index of the mesh that it draws first.
    fn mesh(&self) -> usize;

    /// The bits of the views that may show it.
    fn views(&self) -> u32 {
        ALL_VIEWS
    }

    fn bounding_sphere(&self) -> Sphere;

    /// Moves it to its position at `time`, in seconds.
    fn update(&mut self, _time: f32) {}

    /// Appends its instances. Their number never changes.
    fn write_instances(&self, instances: &mut Vec<Instance>);

    /// Draws it. `instances` are its instances in the instance buffer.
    fn draw(&self, pass: &mut DrawPass<'_, '_>, instances: Range<u32>);
}

#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    pub center: Vec3,
    pub radius: f32,
}

/// What the shaders read of an instance.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    world_from_object: Mat4,
    tint: Vec4,
}

/// An object with one mesh that never moves.
#[derive(Clone, Copy)]
pub struct Prop {
    pub mesh: usize,
    pub material: usize,
    pub views: u32,
    pub position: Vec3,
    pub scale: Vec3,
    pub tint: Vec3,
}

impl Prop {
    fn instance(&self) -> Instance {
        let rotation = Quat::from_rotation_y(self.position.x * 0.7);
        let world_from_object = Mat4::from_scale_rotation_translation(self.scale, rotation, self.position);
        Instance { world_from_object, tint: self.tint.extend(1.0) }
    }
}

impl Drawable for Prop {
    fn material(&self) -> usize {
        self.material
    }

    fn mesh(&self) -> usize {
        self.mesh
    }

    fn views(&self) -> u32 {
        self.views
    }

    fn bounding_sphere(&self) -> Sphere {
        // All meshes fit into a cube from -1 to 1.
        Sphere { center: self.position, radius: self.scale.length() }
    }

    fn write_instances(&self, instances: &mut Vec<Instance>) {
        instances.push(self.instance());
    }

    fn draw(&self, pass: &mut DrawPass<'_, '_>, instances: Range<u32>) {
        pass.set_material(self.material);
        pass.set_mesh(self.mesh);
        pass.draw(instances);
    }
}

/// An object that drifts around the world's centre, and bobs up and down.
pub struct Floater {
    pub prop: Prop,
    /// Its position at the beginning.
    pub start: Vec3,
    /// In radians.
    pub phase: f32,
}

impl Drawable for Floater {
    fn material(&self) -> usize {
        self.prop.material
    }

    fn mesh(&self) -> usize {
        self.prop.mesh
    }

    fn bounding_sphere(&self) -> Sphere {
        self.prop.bounding_sphere()
    }

    fn update(&mut self, time: f32) {
        self.prop.position = Quat::from_rotation_y(time * 0.1) * self.start;
        self.prop.position.y = 2.0 + (time + self.phase).sin();
    }

    fn write_instances(&self, instances: &mut Vec<Instance>) {
        self.prop.write_instances(instances);
    }

    fn draw(&self, pass: &mut DrawPass<'_, '_>, instances: Range<u32>) {
        self.prop.draw(pass, instances);
    }
}

/// Plants that are culled together. Those with the same mesh are drawn together.
pub struct Thicket {
    /// By mesh. All have the same material.
    pub plants: [[Prop; 2]; 2],
    pub center: Vec3,
    pub radius: f32,
}

impl Drawable for Thicket {
    fn material(&self) -> usize {
        self.plants[0][0].material
    }

    fn mesh(&self) -> usize {
        self.plants[0][0].mesh
    }

    fn bounding_sphere(&self) -> Sphere {
        Sphere { center: self.center, radius: self.radius }
    }

    fn write_instances(&self, instances: &mut Vec<Instance>) {
        instances.extend(self.plants.as_flattened().iter().map(Prop::instance));
    }

    fn draw(&self, pass: &mut DrawPass<'_, '_>, instances: Range<u32>) {
        pass.set_material(self.material());
        for (plants, first) in self.plants.iter().zip(instances.step_by(2)) {
            pass.set_mesh(plants[0].mesh);
            pass.draw(first..first + 2);
        }
    }
}
