//! A view as shaders read it.

use glam::{Mat4, Vec3};

use super::{FixedPosition, RenderView};
use crate::scene::{Projection, SceneRef, ViewKind};

/// A view as shaders read it: `View` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ViewRecord {
    /// See [`RenderView::clip_from_relative`].
    pub clip_from_relative: Mat4,
    /// The lower halves of the camera's position.
    pub position_low: [u32; 3],
    /// How many lights reach it.
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
    /// 0 perspective, 1 orthographic, 2 the same with what lies before the near plane drawn onto it, 3 paraboloid.
    pub projection: u32,
    /// The scene's ambient light.
    pub ambient: Vec3,
    /// The far plane's distance in metres; infinite for most cameras.
    pub far: f32,
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
            projection: match view.camera.projection {
                Projection::Perspective { .. } => 0,
                Projection::Orthographic { .. } => 1 + u32::from(view.kind() == ViewKind::Shadow),
                Projection::Paraboloid => 3,
            },
            ambient: scene.ambient,
            far: view.camera.far,
        })
    }
}
