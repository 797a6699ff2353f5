//! The GPU layout of a light.

use glam::{DVec3, Quat, Vec3};

use super::RenderView;
use crate::scene::{Light, LightFields, Projection};

/// The GPU layout of a light, relative to one view's camera: `Light` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuLight {
    /// The position relative to the camera, in metres; for a directional light, the position of its shadow map's
    /// camera.
    pub position: Vec3,
    /// 0 directional, 1 point, 2 spot, 3 hemispherical.
    pub kind: u32,
    /// The direction in which the light travels.
    pub direction: Vec3,
    /// The light's range in metres; for a directional light, the far plane of its shadow map.
    pub range: f32,
    /// The illuminance at 1 m; for a directional light, that of a surface that faces it.
    pub intensity: Vec3,
    /// The cosine of the angle at which a spot light begins to fade.
    pub cone_begin: f32,
    /// The cosine of the angle at which a spot light ends; 0 for a hemispherical light.
    pub cone_end: f32,
    /// The layer of its shadow map, the first layer if it has several, or [`GpuLight::NO_SHADOW_MAP`].
    /// [`LightTable`](super::LightTable) has the light as each further map shows it.
    pub shadow_layer: u32,
    /// Half the shadow map's extent: at a distance of 1 m for a spot or point light, in metres for a directional one.
    pub shadow_half: f32,
    /// The near plane of the shadow map, in metres.
    pub shadow_near: f32,
    /// Rotates from the axes of the shadow map's camera to world axes.
    pub shadow_orientation: Quat,
}

impl GpuLight {
    /// The [`GpuLight::shadow_layer`] of a light without a shadow map.
    pub const NO_SHADOW_MAP: u32 = u32::MAX;

    /// The layout of `light` for a camera at `origin`. `shadow_map` is the view that draws its shadow map, if any.
    pub fn new(light: &Light, origin: DVec3, shadow_map: Option<&RenderView>) -> Self {
        let relative = |position: DVec3| (position - origin).as_vec3();
        let LightFields { position, direction, color, range, cone } = light.fields();
        let [cone_begin, cone_end] = cone.map_or([0.0; 2], |angles| angles.map(f32::cos));
        let mut gpu_light = Self {
            position: position.map_or(Vec3::ZERO, |position| relative(*position)),
            kind: light.kind() as u32,
            direction: direction.map_or(Vec3::ZERO, |direction| direction.normalize()),
            range: range.copied().unwrap_or(0.0),
            intensity: *color,
            cone_begin,
            cone_end,
            shadow_layer: Self::NO_SHADOW_MAP,
            shadow_half: 0.0,
            shadow_near: 0.0,
            shadow_orientation: Quat::IDENTITY,
        };
        if let Some(map) = shadow_map {
            gpu_light.shadow_layer = map.layer;
            gpu_light.shadow_near = map.camera.near;
            gpu_light.shadow_orientation = map.camera.orientation;
            gpu_light.shadow_half = map.picture_axes()[1].length();
            if let Projection::Orthographic { .. } = map.camera.projection {
                (gpu_light.position, gpu_light.range) = (relative(map.camera.position), map.camera.far);
            }
        }
        gpu_light
    }
}
