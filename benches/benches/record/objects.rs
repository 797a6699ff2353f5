//! The data that the hand-written techniques compute for each object and each camera.

use bytemuck::{Pod, Zeroable};
use drawloom::glam::{DVec3, Mat4};
use drawloom::scene::{Camera, Material, SceneRef};
use drawloom::view::RenderView;
use drawloom::view::internal::Frustum;

/// An object's layout in shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct GpuObject {
    pub world_from_object: Mat4,
    material: u32,
    /// Pads to a multiple of 16 bytes.
    padding: [u32; 3],
}

impl GpuObject {
    pub fn new(scene: &SceneRef<'_>, object: usize) -> Self {
        let position = scene.positions[object].as_vec3();
        Self {
            world_from_object: Mat4::from_scale_rotation_translation(
                scene.scales[object],
                scene.orientations[object],
                position,
            ),
            material: scene.materials[object].index(),
            padding: [0; 3],
        }
    }
}

/// A bounding sphere, by which all techniques cull.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sphere {
    pub center: DVec3,
    pub radius: f32,
}

impl Sphere {
    pub fn new(scene: &SceneRef<'_>, object: usize) -> Self {
        let (bounds, scale) = (scene.bounds[object], scene.scales[object]);
        let center = scene.orientations[object] * (scale * bounds.center);
        Self { center: scene.positions[object] + center.as_dvec3(), radius: bounds.radius * scale.abs().max_element() }
    }

    pub fn is_visible(&self, frustum: &Frustum) -> bool {
        frustum.intersects_sphere(self.center, self.radius)
    }
}

/// The matrix that the shaders read for a camera.
pub fn clip_from_world(camera: &Camera) -> Mat4 {
    RenderView::new(camera).clip_from_relative() * Mat4::from_translation(-camera.position.as_vec3())
}

/// The materials' colours, by slot.
pub fn colors(scene: &SceneRef<'_>) -> Vec<[f32; 4]> {
    scene.assets.iter::<Material>().map(|(_, material)| material.diffuse.extend(1.0).to_array()).collect()
}
