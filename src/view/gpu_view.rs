//! A view as shaders read it.

use glam::{DMat4, DVec3, Mat4, Vec3};

use super::{FixedPosition, RenderView};
use crate::scene::{Projection, SceneRef, ViewKind};

/// A view as shaders read it: `View` in `drawloom.wgsl`.
///
/// # How precise
///
/// Of some thirty roundings on a vertex's way from its object to clip space, each of u = 2⁻²⁴ at most and relative to how far the
/// vertex is, a few add up: for a vertex that is at least as far from the camera as its mesh's radius (around the mesh's own
/// origin), and 10 cm, the angle under which it is seen is off by less than 30u, whatever their signs, and by some 6u where
/// signs are mixed, wherever in the world the camera is. In pixels that is f + r²/f times as much, r pixels from the middle
/// of a picture whose focal length f is H / (2 tan(fov / 2)). 6u are 1e-3 pixels in the corners of a picture of 1920 × 1080
/// pixels for fields of view from 27° to 90°. Narrower ones magnify what f32 can say of a direction, and wider ones are
/// stretched at the edge: 0.3 pixels at 0.1°, 0.06 in the corners at 179°. Spot lights' maps of 1024² hold 1e-3 of their pixels from
/// 12° to 68° from the axis, and those of other lights always. A main camera without perspective holds it up to 2.5 times its
/// picture's height; beyond, as much more as it is farther. `testing/src/precision` measures all of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuView {
    /// From world axes relative to the place below to clip space: see [`RenderView::clip_from_relative`].
    pub clip_from_relative: Mat4,
    /// The lower halves of the place that everything is taken relative to: the camera's, but for a directional light's shadow map,
    /// which is far away from all that it sees: there it is midway between its near and its far plane.
    pub position_low: [u32; 3],
    /// How many lights reach it.
    pub light_count: u32,
    /// The upper halves of that place.
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

impl GpuView {
    /// The record of `view`; `None` where its camera is farther out than [`FixedPosition::REACH`].
    pub fn new(view: &RenderView, scene: &SceneRef<'_>, light_count: usize) -> Option<Self> {
        let (position, clip_from_relative) = placed(view);
        let (position_low, position_high) = FixedPosition::new(position)?.halves();
        let [right, up, forward] = view.picture_axes();
        let [width, height] = view.camera.size.map(|pixels| pixels as f32);
        Some(Self {
            clip_from_relative,
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

/// What a view's vertices are taken relative to, and the matrix from there to clip space.
///
/// An orthographic shadow map is seen from many radii before what it covers, and along parallel rays the distance is nothing but
/// a place for f32 to lose digits in. So its place is midway between the near and the far plane, from where all that it draws is
/// half as far at most, and the matrix begins with the way there.
fn placed(view: &RenderView) -> (DVec3, Mat4) {
    let camera = &view.camera;
    let matrix = view.precise_clip_from_relative();
    match camera.projection {
        Projection::Orthographic { .. } if camera.kind == ViewKind::Shadow => {
            let along = (f64::from(camera.near) + f64::from(camera.far)) * 0.5;
            let way = camera.orientation.as_dquat().normalize() * DVec3::NEG_Z * along;
            let place = camera.position + way;
            if FixedPosition::new(place).is_none() {
                return (camera.position, matrix.as_mat4());
            }
            // What was added may differ from `way` by a rounding, and the picture is not to move by that.
            let way = place - camera.position;
            (place, (matrix * DMat4::from_translation(way)).as_mat4())
        }
        _ => (camera.position, matrix.as_mat4()),
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{Camera, Scene};

    /// Where a place in the world comes to lie in clip space.
    fn clip(record: &GpuView, place: DVec3) -> Vec3 {
        let metres = |low: u32, high: i32| f64::from(high) * 4.0 + f64::from(low) / f64::from(1_u32 << 30);
        let origin =
            DVec3::from_array([0, 1, 2].map(|axis| metres(record.position_low[axis], record.position_high[axis])));
        record.clip_from_relative.project_point3((place - origin).as_vec3())
    }

    #[test]
    fn a_directional_shadow_map_shows_the_same_from_midway() {
        let scene = Scene::new();
        for position in [DVec3::ZERO, DVec3::new(1e3, -5e8, 4e9)] {
            let camera = Camera {
                projection: Projection::Orthographic { height: 10.0 },
                near: 5.0,
                far: 95.0,
                ..Camera::looking_at("plan", position, position + DVec3::new(-1.0, 2.0, 0.5))
            };
            let map = Camera { kind: ViewKind::Shadow, ..camera.clone() };
            let [plain, moved] =
                [&camera, &map].map(|camera| GpuView::new(&RenderView::new(camera), &scene.as_scene_ref(), 0).unwrap());
            assert_ne!(plain.position_low, moved.position_low);
            for (x, y, depth) in [(0.0, 0.0, 5.0), (4.0, -3.0, 50.0), (-2.0, 1.0, 95.0)] {
                let place = position + camera.orientation.as_dquat() * DVec3::new(x, y, -depth);
                let [plain, moved] = [clip(&plain, place), clip(&moved, place)];
                assert!(plain.abs_diff_eq(moved, 1e-5), "{plain} is not {moved}");
            }
        }
    }

    #[test]
    fn a_shadow_map_at_the_end_of_the_world_stays_within_reach() {
        let camera = Camera {
            kind: ViewKind::Shadow,
            projection: Projection::Orthographic { height: 10.0 },
            far: 1e6,
            ..Camera::looking_at("map", DVec3::X * 4.2949e9, DVec3::X * 5e9)
        };
        assert!(GpuView::new(&RenderView::new(&camera), &Scene::new().as_scene_ref(), 0).is_some());
    }
}
