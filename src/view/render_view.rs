//! A camera's view within a frame.

use glam::{DMat4, DVec4, Mat4, Vec3};

use super::Frustum;
use crate::scene::{Camera, Projection, ViewKind};

/// A camera's rendering of the scene within a frame (M listing 10.4). The backend keeps its targets and its view queue
/// under the view's index.
#[derive(Clone, Debug)]
pub struct RenderView {
    /// The camera.
    pub camera: Camera,
    /// The camera's frustum.
    pub frustum: Frustum,
    /// The light whose shadow map the view draws: its index among the frame's valid lights.
    pub valid_light: Option<usize>,
    /// The layer that it draws of the targets that all views of its kind share.
    pub layer: u32,
    /// Whether its targets still hold an earlier frame's shadow map. Then no render process draws into it, but others
    /// read its targets: see [`ShadowQuality::interval`](crate::quality::ShadowQuality::interval).
    pub is_cached: bool,
}

impl RenderView {
    /// The view of `camera`.
    pub fn new(camera: &Camera) -> Self {
        Self { camera: camera.clone(), frustum: Frustum::new(camera), valid_light: None, layer: 0, is_cached: false }
    }

    /// The camera's name, which reports use.
    pub fn name(&self) -> &str {
        &self.camera.name
    }

    /// The kind of picture that it draws.
    pub fn kind(&self) -> ViewKind {
        self.camera.kind
    }

    /// From world axes relative to the camera to clip space. Depth is reversed: 1 at the near plane, and 0 at the far
    /// plane or, in perspective, at infinity. No matrix projects onto a paraboloid; there the matrix leads to camera
    /// axes.
    ///
    /// It is computed in f64 and rounded once: the error of each element is at most half a unit in the last place.
    pub fn clip_from_relative(&self) -> Mat4 {
        self.precise_clip_from_relative().as_mat4()
    }

    /// [`RenderView::clip_from_relative`] before rounding.
    pub(crate) fn precise_clip_from_relative(&self) -> DMat4 {
        let camera = &self.camera;
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let projection = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let scale = 1.0 / (f64::from(field_of_view) * 0.5).tan();
                let end = DVec4::Z * f64::from(camera.near);
                DMat4::from_cols(DVec4::X * (scale / aspect), DVec4::Y * scale, DVec4::NEG_W, end)
            }
            Projection::Orthographic { height } => {
                let scale = 2.0 / f64::from(height);
                let far = f64::from(camera.far);
                let depth = 1.0 / (far - f64::from(camera.near));
                let end = DVec4::new(0.0, 0.0, far * depth, 1.0);
                DMat4::from_cols(DVec4::X * (scale / aspect), DVec4::Y * scale, DVec4::Z * depth, end)
            }
            Projection::Paraboloid => DMat4::IDENTITY,
        };
        projection * DMat4::from_quat(camera.orientation.as_dquat().normalize().inverse())
    }

    /// The picture's axes in the world: right and up, each as long as half the picture (in perspective, at a distance
    /// of 1), and forward. The ray of a pixel at (x, y) in clip space has the direction x·right + y·up + forward in
    /// perspective; otherwise it starts at x·right + y·up and has the direction forward.
    pub fn picture_axes(&self) -> [Vec3; 3] {
        let half = match self.camera.projection {
            Projection::Perspective { field_of_view } => (field_of_view * 0.5).tan(),
            Projection::Orthographic { height } => height * 0.5,
            Projection::Paraboloid => 1.0,
        };
        let axis = |direction: Vec3| self.camera.orientation.normalize() * direction;
        [axis(Vec3::X) * half * self.camera.aspect(), axis(Vec3::Y) * half, axis(Vec3::NEG_Z)]
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Vec4, Vec4Swizzles};

    use super::*;

    #[test]
    fn depth_is_one_at_the_near_plane_and_falls_towards_zero() {
        let mut camera = Camera::looking_at("main", DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
        camera.near = 0.25;
        let view = RenderView::new(&camera);
        let [_, _, forward] = view.picture_axes();
        let depth_at = |distance: f32| {
            let clip = view.clip_from_relative() * (forward * distance).extend(1.0);
            clip.z / clip.w
        };
        assert!((depth_at(0.25) - 1.0).abs() < 1e-6);
        assert!((depth_at(2.5) - 0.1).abs() < 1e-6);
        assert!(depth_at(1e9) > 0.0);
    }

    #[test]
    fn orthographic_depth_falls_linearly_from_one_to_zero() {
        let camera = Camera {
            projection: Projection::Orthographic { height: 8.0 },
            near: 2.0,
            far: 10.0,
            ..Camera::looking_at("plan", DVec3::ZERO, DVec3::new(-1.0, 2.0, 0.5))
        };
        let view = RenderView::new(&camera);
        let [right, up, forward] = view.picture_axes();
        for (distance, depth) in [(2.0, 1.0), (4.0, 0.75), (10.0, 0.0)] {
            let clip = view.clip_from_relative() * (right - up + forward * distance).extend(1.0);
            assert!(clip.abs_diff_eq(Vec4::new(1.0, -1.0, depth, 1.0), 1e-6), "{clip}");
        }
    }

    #[test]
    fn picture_axes_lead_to_the_pictures_corners() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::new(-1.0, 0.3, 2.0));
        let view = RenderView::new(&camera);
        let [right, up, forward] = view.picture_axes();
        let clip = view.clip_from_relative() * (right + up + forward).extend(1.0);
        assert!((clip.xy() / clip.w - glam::Vec2::ONE).length() < 1e-6);
    }
}
