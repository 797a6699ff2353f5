//! A light as shaders read it.

use glam::{DVec3, Quat, Vec3};

use super::RenderView;
use crate::scene::{Light, Projection};

/// A light as shaders read it, relative to one view's camera: `Light` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuLight {
    /// Where it is, relative to the camera, in metres; for a directional light, where its shadow map is seen from.
    pub position: Vec3,
    /// 0 directional, 1 point, 2 spot, 3 hemispherical.
    pub kind: u32,
    /// The way it travels.
    pub direction: Vec3,
    /// Where it ends, in metres; for a directional light, where its shadow map does.
    pub range: f32,
    /// At 1 m, or on a surface that faces a directional light.
    pub intensity: Vec3,
    /// The cosine at which a spot light begins to fade.
    pub cone_begin: f32,
    /// The cosine at which a spot light is gone; 0 for a hemispherical one.
    pub cone_end: f32,
    /// The layer of its shadow map; [`GpuLight::NO_SHADOW_MAP`] without one.
    pub shadow_layer: u32,
    /// Half as wide as the shadow map: at 1 m for a spot light, in metres for a directional one.
    pub shadow_half: f32,
    /// Where the shadow map begins, in metres.
    pub shadow_near: f32,
    /// From the axes of the shadow map's camera to the world's.
    pub shadow_orientation: Quat,
}

impl GpuLight {
    /// The [`GpuLight::shadow_layer`] of a light without a shadow map.
    pub const NO_SHADOW_MAP: u32 = u32::MAX;

    /// The record of `light` for a camera at `origin`, with the view that draws its shadow map if there is one.
    pub fn new(light: &Light, origin: DVec3, shadow_map: Option<&RenderView>) -> Self {
        let relative = |position: DVec3| (position - origin).as_vec3();
        let mut record = Self {
            kind: light.kind() as u32,
            shadow_layer: Self::NO_SHADOW_MAP,
            shadow_orientation: Quat::IDENTITY,
            ..bytemuck::Zeroable::zeroed()
        };
        match *light {
            Light::Directional { direction, illuminance, .. } => {
                (record.direction, record.intensity) = (direction.normalize(), illuminance);
            }
            Light::Point { position, intensity, range } => {
                (record.position, record.intensity, record.range) = (relative(position), intensity, range);
            }
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, .. } => {
                (record.position, record.intensity, record.range) = (relative(position), intensity, range);
                record.direction = direction.normalize();
                (record.cone_begin, record.cone_end) = (inner_angle.cos(), outer_angle.cos());
            }
            Light::Hemispherical { position, direction, intensity, range, .. } => {
                (record.position, record.intensity, record.range) = (relative(position), intensity, range);
                record.direction = direction.normalize();
            }
        }
        if let Some(map) = shadow_map {
            record.shadow_layer = map.layer;
            record.shadow_near = map.camera.near;
            record.shadow_orientation = map.camera.orientation;
            record.shadow_half = map.picture_axes()[1].length();
            if let Projection::Orthographic { .. } = map.camera.projection {
                (record.position, record.range) = (relative(map.camera.position), map.camera.far);
            }
        }
        record
    }
}
