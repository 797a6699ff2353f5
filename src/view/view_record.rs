//! A view and its lights as shaders read them.

use glam::{DVec3, Mat4, Vec3};

use super::{FixedPosition, RenderView};
use crate::scene::{Light, SceneRef};

/// A view as shaders read it: `View` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ViewRecord {
    /// See [`RenderView::clip_from_relative`].
    pub clip_from_relative: Mat4,
    /// The lower halves of the camera's position.
    pub position_low: [u32; 3],
    /// How many lights there are.
    pub light_count: u32,
    /// The upper halves of the camera's position.
    pub position_high: [i32; 3],
    /// The near plane's distance in metres.
    pub near: f32,
    /// See [`RenderView::picture_axes`].
    pub right: Vec3,
    /// In pixels.
    pub width: f32,
    /// See [`RenderView::picture_axes`].
    pub up: Vec3,
    /// In pixels.
    pub height: f32,
    /// The way the camera looks.
    pub forward: Vec3,
    /// Keeps what follows at a multiple of 16 bytes, as WGSL wants it.
    pub padding: f32,
    /// The scene's ambient light.
    pub ambient: Vec3,
    /// Makes the size a multiple of 16 bytes, as WGSL wants it.
    pub padding_end: f32,
}

impl ViewRecord {
    /// The record of `view`; `None` where its camera is farther out than [`FixedPosition::REACH`].
    pub fn new(view: &RenderView, scene: &SceneRef<'_>, light_count: usize) -> Option<Self> {
        let (position_low, position_high) = FixedPosition::new(view.camera.position)?.halves();
        let [right, up, forward] = view.picture_axes();
        let [width, height] = view.camera.size.map(|pixels| pixels as f32);
        Some(Self {
            clip_from_relative: view.clip_from_relative(),
            position_low,
            light_count: light_count as u32,
            position_high,
            near: view.camera.near,
            right,
            width,
            up,
            height,
            forward,
            padding: 0.0,
            ambient: scene.ambient,
            padding_end: 0.0,
        })
    }
}

/// A light as shaders read it, relative to one view's camera: `Light` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LightRecord {
    /// Relative to the camera, in metres.
    pub position: Vec3,
    /// 0 directional, 1 point, 2 spot, 3 hemispherical.
    pub kind: u32,
    /// The way it travels.
    pub direction: Vec3,
    /// Where it ends, in metres.
    pub range: f32,
    /// At 1 m, or on a surface that faces a directional light.
    pub intensity: Vec3,
    /// The cosine at which a spot light begins to fade.
    pub cone_begin: f32,
    /// The cosine at which a spot light is gone.
    pub cone_end: f32,
    /// Makes the size a multiple of 16 bytes, as WGSL wants it.
    pub padding: [f32; 3],
}

impl LightRecord {
    /// The record of `light` for a camera at `origin`.
    pub fn new(light: &Light, origin: DVec3) -> Self {
        let nothing = <Self as bytemuck::Zeroable>::zeroed();
        let relative = |position: DVec3| (position - origin).as_vec3();
        match *light {
            Light::Directional { direction, illuminance } => {
                Self { kind: 0, direction: direction.normalize(), intensity: illuminance, ..nothing }
            }
            Light::Point { position, intensity, range } => {
                Self { kind: 1, position: relative(position), intensity, range, ..nothing }
            }
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle } => Self {
                kind: 2,
                position: relative(position),
                direction: direction.normalize(),
                intensity,
                range,
                cone_begin: inner_angle.cos(),
                cone_end: outer_angle.cos(),
                ..nothing
            },
            Light::Hemispherical { position, direction, intensity, range } => Self {
                kind: 3,
                position: relative(position),
                direction: direction.normalize(),
                intensity,
                range,
                ..nothing
            },
        }
    }
}
