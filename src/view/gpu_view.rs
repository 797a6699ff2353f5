//! The GPU layout of a view.

use glam::{DMat4, DVec3, Mat4, Vec3};

use super::{FixedPosition, LightClass, RenderView};
use crate::scene::Projection;

/// The GPU layout of a view: `View` in `drawloom.wgsl`.
///
/// # Precision
///
/// Transforming a vertex from object to clip space rounds some thirty times, each time by at most u = 2⁻²⁴ of the
/// vertex's distance. For a vertex at least as far from the camera as its mesh's radius (around the mesh's own origin),
/// and at least 10 cm, the error of its viewing angle is below 30u in the worst case, and some 6u where the roundings'
/// signs are mixed, wherever in the world the camera is. In pixels, the error is f + r²/f times that, r pixels from the
/// centre of a picture whose focal length f is H / (2 tan(fov / 2)). 6u are 1e-3 pixels in the corners of a picture of
/// 1920 × 1080 pixels for fields of view from 27° to 90°. Narrower ones magnify the rounding of directions, and wider
/// ones stretch the edges: 0.3 pixels at 0.1°, 0.06 in the corners at 179°. Shadow maps of 1024² have an error of at
/// most 1e-3 of their pixels for spot lights from 12° to 68° from the axis, and for other lights always. An
/// orthographic main camera keeps to it up to a distance of 2.5 times its picture's height; beyond, the error grows
/// with the distance. `testing/src/precision` measures all of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuView {
    /// 0, and read by no shader. Lavapipe of Mesa 22.3 inlines the first four bytes of a uniform buffer into shaders
    /// that branch on a member of it: it compiles them anew for each pass, and never frees what it compiled. What no
    /// shader reads is not inlined.
    pub _unread: [f32; 4],
    /// From world axes relative to the origin below to clip space: see [`RenderView::clip_from_relative`].
    pub clip_from_relative: Mat4,
    /// The lower halves of the origin that vertices are relative to: the camera's position. The camera of a directional
    /// light's shadow map is far from everything it sees, so its origin is midway between its near and far planes.
    pub position_low: [u32; 3],
    /// The number of lights that reach the view.
    pub light_count: u32,
    /// The upper halves of that origin.
    pub position_high: [i32; 3],
    /// The near plane's distance in metres.
    pub near: f32,
    /// See [`RenderView::picture_axes`].
    pub right: Vec3,
    /// The picture's width in pixels.
    pub width: f32,
    /// See [`RenderView::picture_axes`].
    pub up: Vec3,
    /// The picture's height in pixels.
    pub height: f32,
    /// The view direction.
    pub forward: Vec3,
    /// 0: perspective, 1: orthographic, 2: orthographic with depth clamped at the near plane, 3: paraboloid.
    pub projection: u32,
    /// The scene's ambient light.
    pub ambient: Vec3,
    /// The far plane's distance in metres; infinite for most cameras.
    pub far: f32,
    /// For each class of lights, by [`LightClass::index`]: where they end among the view's lights. They begin where
    /// those of the class before end. Shaders read vectors of four.
    pub light_ends: [u32; LightClass::COUNT.next_multiple_of(4)],
}

impl GpuView {
    /// Whether `view` has a layout: see [`GpuView::new`].
    pub(crate) fn is_in_reach(view: &RenderView) -> bool {
        FixedPosition::new(origin(view)).is_some()
    }

    /// The layout of `view` in a scene with this ambient light, whose lights have no classes; `None` if its camera is
    /// beyond [`FixedPosition::MAX_COORDINATE`].
    pub fn new(view: &RenderView, ambient: Vec3, light_count: usize) -> Option<Self> {
        let (position, clip_from_relative) = origin_and_matrix(view);
        let (position_low, position_high) = FixedPosition::new(position)?.halves();
        let [right, up, forward] = view.picture_axes();
        let [width, height] = view.camera.size.map(|pixels| pixels as f32);
        Some(Self {
            _unread: [0.0; 4],
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
                Projection::Orthographic { .. } => 1 + u32::from(view.clamps_depth()),
                Projection::Paraboloid => 3,
            },
            ambient,
            far: view.camera.far,
            light_ends: bytemuck::Zeroable::zeroed(),
        })
    }
}

/// The origin that a view's vertices are relative to, and the matrix from there to clip space.
fn origin_and_matrix(view: &RenderView) -> (DVec3, Mat4) {
    let (origin, matrix) = (origin(view), view.precise_clip_from_relative());
    // The origin was rounded: the matrix translates by the actual difference, so that the picture does not move.
    let offset = origin - view.camera.position;
    let matrix = if offset == DVec3::ZERO { matrix } else { matrix * DMat4::from_translation(offset) };
    (origin, matrix.as_mat4())
}

/// The origin that a view's vertices are relative to.
///
/// The camera of an orthographic shadow map is many radii away from what it covers. Along parallel rays that distance
/// serves no purpose and costs f32 precision. So the origin is midway between the near and far planes, which at least
/// halves the distances, and the matrix includes the translation to it.
fn origin(view: &RenderView) -> DVec3 {
    let camera = &view.camera;
    if !camera.clamps_depth() {
        return camera.position;
    }
    let along = (f64::from(camera.near) + f64::from(camera.far)) * 0.5;
    let origin = camera.position + camera.orientation.as_dquat().normalize() * DVec3::NEG_Z * along;
    if FixedPosition::new(origin).is_some() { origin } else { camera.position }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{Camera, ViewKind};

    /// The clip-space position of a point in the world.
    fn clip(gpu_view: &GpuView, point: DVec3) -> Vec3 {
        let metres = |low: u32, high: i32| f64::from(high) * 4.0 + f64::from(low) / f64::from(1_u32 << 30);
        let origin =
            DVec3::from_array([0, 1, 2].map(|axis| metres(gpu_view.position_low[axis], gpu_view.position_high[axis])));
        gpu_view.clip_from_relative.project_point3((point - origin).as_vec3())
    }

    #[test]
    fn moving_the_origin_of_a_directional_shadow_map_keeps_its_picture() {
        for position in [DVec3::ZERO, DVec3::new(1e3, -5e8, 4e9)] {
            let camera = Camera {
                projection: Projection::Orthographic { height: 10.0 },
                near: 5.0,
                far: 95.0,
                ..Camera::looking_at("plan", position, position + DVec3::new(-1.0, 2.0, 0.5))
            };
            let map = Camera { kind: ViewKind::Shadow, ..camera.clone() };
            let [plain, moved] =
                [&camera, &map].map(|camera| GpuView::new(&RenderView::new(camera), Vec3::ZERO, 0).unwrap());
            assert_ne!(plain.position_low, moved.position_low);
            for (x, y, depth) in [(0.0, 0.0, 5.0), (4.0, -3.0, 50.0), (-2.0, 1.0, 95.0)] {
                let point = position + camera.orientation.as_dquat() * DVec3::new(x, y, -depth);
                let [plain, moved] = [clip(&plain, point), clip(&moved, point)];
                assert!(plain.abs_diff_eq(moved, 1e-5), "{plain} is not {moved}");
            }
        }
    }

    #[test]
    fn a_view_is_in_reach_if_its_camera_or_the_middle_of_its_shadow_map_is() {
        let far = FixedPosition::MAX_COORDINATE + 1e3;
        let parallel = Projection::Orthographic { height: 10.0 };
        let at = |x: f64| Camera { far: 1e6, ..Camera::looking_at("view", DVec3::X * x, DVec3::ZERO) };
        let map = |x: f64| Camera { kind: ViewKind::Shadow, projection: parallel, ..at(x) };
        let cases = [
            (at(0.0), true),
            (at(far), false),
            (at(f64::NAN), false),
            (Camera { projection: parallel, ..at(far) }, false),
            (map(far), true),
            (map(2.0 * far), false),
        ];
        for (camera, expected) in cases {
            let view = RenderView::new(&camera);
            let has_layout = GpuView::new(&view, Vec3::ZERO, 0).is_some();
            assert_eq!((GpuView::is_in_reach(&view), has_layout), (expected, expected), "{camera:?}");
        }
    }

    #[test]
    fn a_shadow_map_at_the_edge_of_the_world_keeps_its_camera_as_origin() {
        let camera = Camera {
            kind: ViewKind::Shadow,
            projection: Projection::Orthographic { height: 10.0 },
            far: 1e6,
            ..Camera::looking_at("map", DVec3::X * 4.2949e9, DVec3::X * 5e9)
        };
        assert!(GpuView::new(&RenderView::new(&camera), Vec3::ZERO, 0).is_some());
    }
}
