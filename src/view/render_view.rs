//! One camera's trip through the frame.

use glam::{Mat4, Vec3, Vec4};

use super::Frustum;
use crate::scene::{Camera, ViewKind};

/// A camera, what it sees, and what kind of picture it makes (M listing 10.4). Its targets and its queue are kept by the
/// backend under the view's index.
#[derive(Clone, Debug)]
pub struct RenderView {
    /// The camera.
    pub camera: Camera,
    /// What it sees.
    pub frustum: Frustum,
}

impl RenderView {
    /// The view of `camera`.
    pub fn new(camera: &Camera) -> Self {
        Self { camera: camera.clone(), frustum: Frustum::new(camera) }
    }

    /// What it is called in reports: the camera's name.
    pub fn name(&self) -> &str {
        &self.camera.name
    }

    /// What its picture is for.
    pub fn kind(&self) -> ViewKind {
        self.camera.kind
    }

    /// From world axes relative to the camera to clip space: reversed depth (1 at the near plane, 0 infinitely far away).
    pub fn clip_from_relative(&self) -> Mat4 {
        let camera = &self.camera;
        let projection = perspective_infinite_reverse(camera);
        projection * Mat4::from_quat(camera.orientation.normalize().inverse())
    }

    /// The axes of the picture in the world: right and up, each as long as half the picture is at a distance of 1, and
    /// forward. A pixel at (x, y) in clip space sees along x·right + y·up + forward.
    pub fn picture_axes(&self) -> [Vec3; 3] {
        let tangent = (self.camera.field_of_view * 0.5).tan();
        let axis = |direction: Vec3| self.camera.orientation.normalize() * direction;
        [axis(Vec3::X) * tangent * self.camera.aspect(), axis(Vec3::Y) * tangent, axis(Vec3::NEG_Z)]
    }
}

fn perspective_infinite_reverse(camera: &Camera) -> Mat4 {
    let scale_y = 1.0 / (camera.field_of_view * 0.5).tan();
    let scale_x = scale_y / camera.aspect();
    Mat4::from_cols(Vec4::X * scale_x, Vec4::Y * scale_y, Vec4::NEG_W, Vec4::Z * camera.near)
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Vec4Swizzles};

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
    fn picture_axes_lead_to_the_pictures_corners() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::new(-1.0, 0.3, 2.0));
        let view = RenderView::new(&camera);
        let [right, up, forward] = view.picture_axes();
        let clip = view.clip_from_relative() * (right + up + forward).extend(1.0);
        assert!((clip.xy() / clip.w - glam::Vec2::ONE).length() < 1e-6);
    }
}
