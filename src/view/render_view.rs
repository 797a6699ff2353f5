//! A camera's view within a frame.

use glam::{DMat4, DVec3, DVec4, Mat4, Vec2, Vec3};

use super::Frustum;
use crate::command::Selection;
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
    /// The main view whose maps of directional lights light it, by index: see [`ShadowMaps`](super::ShadowMaps). `None`
    /// for the views of maps, and without a main view.
    pub main_view: Option<usize>,
    /// The layer that it draws of the targets that all views of its kind share.
    pub layer: u32,
    /// How many frames before this one the view was drawn: 0 if this frame draws it. Camera, frustum and light are
    /// those that it was drawn with.
    pub age: u32,
    /// Which view it is from frame to frame.
    pub(crate) id: ViewId,
}

/// What a view is known by from frame to frame, whatever its index: the
/// [`ViewRegistry`](super::view_registry::ViewRegistry) gives it to each view of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct ViewId {
    /// Where tables keep what belongs to the view. When the view is gone, another one has its slot, and so its memory.
    pub(crate) slot: u32,
    /// A number that no other view has had. What was kept for another identity is not this view's.
    pub(crate) identity: u64,
}

impl RenderView {
    /// The view of `camera`.
    pub fn new(camera: &Camera) -> Self {
        Self {
            camera: camera.clone(),
            frustum: Frustum::new(camera),
            valid_light: None,
            main_view: None,
            layer: 0,
            age: 0,
            id: ViewId::default(),
        }
    }

    /// The camera's name, which reports use.
    pub fn name(&self) -> &str {
        &self.camera.name
    }

    /// The kind of picture that it draws.
    pub fn kind(&self) -> ViewKind {
        self.camera.kind
    }

    /// Whether its targets hold what an earlier frame drew. Then no render process draws in it, but others read its
    /// targets: see [`Redraw`](crate::scene::Redraw).
    pub fn is_cached(&self) -> bool {
        self.age > 0
    }

    /// Whether what is in front of the near plane is drawn as if it were on it: in the map of a directional light,
    /// where it casts a shadow.
    pub fn clamps_depth(&self) -> bool {
        self.camera.clamps_depth()
    }

    /// Which of the objects that a process draws it draws in this view.
    pub fn selection_of(&self, process: Selection) -> Selection {
        process.visible_in(self.camera.layers)
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
    pub fn precise_clip_from_relative(&self) -> DMat4 {
        let camera = &self.camera;
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let projection = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let scale = 1.0 / (f64::from(field_of_view) * 0.5).tan();
                let shift = camera.shift.as_dvec2();
                let back = DVec4::new(shift.x, shift.y, 0.0, -1.0);
                let end = DVec4::Z * f64::from(camera.near);
                DMat4::from_cols(DVec4::X * (scale / aspect), DVec4::Y * scale, back, end)
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
        let matrix = projection * DMat4::from_quat(camera.orientation.as_dquat().normalize().inverse());
        match self.oblique_depth() {
            Some(depth) => {
                let rows = matrix.transpose();
                DMat4::from_cols(rows.x_axis, rows.y_axis, depth, rows.w_axis).transpose()
            }
            None => matrix,
        }
    }

    /// Whether depth is measured from the camera's clip plane: not if that is nearer than the near plane wherever it is
    /// in the picture.
    pub fn has_oblique_near_plane(&self) -> bool {
        self.oblique_depth().is_some()
    }

    /// The row of the matrix that makes the clip plane the near plane, if there is one that the camera is behind, or
    /// in, and if some of it is beyond the near plane in the picture.
    ///
    /// For a position p relative to the camera, let w = forward · p, and π = normal · p + offset its distance in front
    /// of the plane. The row is w − a π: it equals w, for a depth of 1, on the plane. The depth of a position at
    /// distance t along the ray r is 1 − a normal · r − a offset ÷ t. It falls with t, as the offset is negative,
    /// towards 1 − a normal · r, which is 0 or more everywhere in the picture if a is at most 1 ÷ (the largest normal ·
    /// r of its corners). In f32 the sum of the row's products is off by up to 8u (1 + a) |r|, so a is less by so much
    /// that depth stays positive: what is far away is not clipped.
    ///
    /// With the offset, depth loses what tells positions apart: from a camera in the plane, all positions of a ray have
    /// the same depth. So the plane is as far away as [`MIN_CLIP_DISTANCE`] at least.
    fn oblique_depth(&self) -> Option<DVec4> {
        let plane = self.camera.clip_plane?;
        if !matches!(self.camera.projection, Projection::Perspective { .. }) {
            return None;
        }
        let behind = -plane.distance(self.camera.position);
        if behind < 0.0 {
            return None;
        }
        let [right, up, center] = self.precise_picture_axes();
        let forward = self.camera.orientation.as_dquat().normalize() * DVec3::NEG_Z;
        let normal = plane.normal.as_dvec3().normalize();
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| right * x + up * y + center);
        let slopes = corners.map(|ray| normal.dot(ray));
        let near = f64::from(self.camera.near);
        // A ray of a corner is in front of the plane from a distance of behind ÷ slope on.
        if slopes.iter().all(|slope| slope * near >= behind) {
            return None;
        }
        let distance = behind.max(near * MIN_CLIP_DISTANCE);
        let largest = slopes.into_iter().fold(MIN_OBLIQUE_SLOPE, f64::max);
        let longest = corners.into_iter().map(DVec3::length).fold(0.0, f64::max);
        let rounding = 8.0 * UNIT_ROUNDOFF * (1.0 + 1.0 / largest) * longest;
        let scale = (1.0 - rounding.min(MAX_DEPTH_MARGIN)) / largest;
        Some((forward - normal * scale).extend(distance * scale))
    }

    /// [`RenderView::picture_axes`] in f64.
    pub(crate) fn precise_picture_axes(&self) -> [DVec3; 3] {
        let camera = &self.camera;
        let [width, height] = camera.size.map(f64::from);
        let orientation = camera.orientation.as_dquat().normalize();
        let half = camera.projection.half_height();
        let [right, up] = [orientation * DVec3::X * half * (width / height), orientation * DVec3::Y * half];
        let shift = camera.shift.as_dvec2();
        [right, up, orientation * DVec3::NEG_Z + right * shift.x + up * shift.y]
    }

    /// The picture's axes in the world: right and up, each as long as half the picture (in perspective, at a distance
    /// of 1), and forward, which in perspective is the ray of the picture's centre, a [shift](Camera::shift) from the
    /// view direction. The ray of a pixel at (x, y) in clip space has the direction x·right + y·up + forward in
    /// perspective; otherwise it starts at x·right + y·up and has the direction forward.
    pub fn picture_axes(&self) -> [Vec3; 3] {
        let half = match self.camera.projection {
            Projection::Perspective { field_of_view } => (field_of_view * 0.5).tan(),
            Projection::Orthographic { height } => height * 0.5,
            Projection::Paraboloid => 1.0,
        };
        let axis = |direction: Vec3| self.camera.orientation.normalize() * direction;
        let [right, up] = [axis(Vec3::X) * half * self.camera.aspect(), axis(Vec3::Y) * half];
        let shift = self.camera.shift;
        let forward = axis(Vec3::NEG_Z);
        [right, up, if shift == Vec2::ZERO { forward } else { forward + right * shift.x + up * shift.y }]
    }
}

/// The least distance of a clip plane from the camera, as a share of [`Camera::near`](Camera::near).
const MIN_CLIP_DISTANCE: f64 = 1.0 / 16.0;

/// At most this share of the range of depth is left unused.
const MAX_DEPTH_MARGIN: f64 = 0.5;

/// Half a unit in the last place of the f32 from 0.5 to 1.
const UNIT_ROUNDOFF: f64 = 1.0 / (1_u32 << 24) as f64;

/// Where no ray of the picture comes closer to the clip plane's normal than this, nothing in front of the plane is
/// visible, and the row stays finite.
const MIN_OBLIQUE_SLOPE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use glam::{Vec4, Vec4Swizzles};

    use super::*;
    use crate::scene::ClipPlane;

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

    #[test]
    fn depth_is_one_on_the_clip_plane_and_stays_positive_beyond_it() {
        let normal = Vec3::new(0.6, 0.0, -0.8);
        for shift in [Vec2::ZERO, Vec2::new(2.0, -1.0)] {
            let clip_plane = Some(ClipPlane { point: DVec3::new(0.0, 0.0, -4.0), normal });
            let camera = Camera { shift, clip_plane, ..Camera::looking_at("mirror", DVec3::ZERO, DVec3::NEG_Z) };
            let view = RenderView::new(&camera);
            assert!(view.has_oblique_near_plane());
            let [right, up, center] = view.picture_axes();
            for (x, y) in [(0.0, 0.0), (0.9, 0.9), (-0.9, 0.4), (0.3, -0.9)] {
                let ray = right * x + up * y + center;
                // normal · (ray t − point) = 0.
                let on_plane = 3.2 / normal.dot(ray);
                let clip_at = |distance: f32| view.clip_from_relative() * (ray * distance).extend(1.0);
                let depth_at = |distance: f32| clip_at(distance).z / clip_at(distance).w;
                assert!(clip_at(1.0).abs_diff_eq(Vec4::new(x, y, clip_at(1.0).z, 1.0), 1e-5));
                if on_plane <= 0.0 {
                    assert!(depth_at(1.0) > 1.0 && depth_at(1e6) > 1.0, "nothing on this ray is in front of the plane");
                    continue;
                }
                assert!((depth_at(on_plane) - 1.0).abs() < 1e-5);
                assert!(depth_at(on_plane * 0.99) > 1.0 && depth_at(on_plane * 1.01) < 1.0);
                assert!(depth_at(on_plane * 1e6) > 0.0);
            }
        }
    }

    /// At infinity, depth is least in a corner of the picture whose ray is nearest to the plane's normal, and there it
    /// is 0 but for a margin for the rounding of f32.
    #[test]
    fn the_least_depth_of_an_oblique_picture_is_hardly_more_than_zero() {
        for normal in [[0.3, 0.5, -0.8], [-0.3, 0.5, -0.8], [0.3, -0.5, -0.8], [-0.3, -0.5, -0.8], [0.0, 0.0, -1.0]] {
            for (shift, size) in [(Vec2::ZERO, [640, 360]), (Vec2::new(0.5, -1.0), [300, 400])] {
                let normal = Vec3::from(normal).normalize();
                let clip_plane = Some(ClipPlane { point: DVec3::NEG_Z, normal });
                let camera =
                    Camera { shift, size, clip_plane, ..Camera::looking_at("mirror", DVec3::ZERO, DVec3::NEG_Z) };
                let view = RenderView::new(&camera);
                let [right, up, center] = view.picture_axes();
                let depth_at_infinity = |(x, y): (f32, f32)| {
                    let ray: Vec3 = right * x + up * y + center;
                    (view.clip_from_relative() * ray.extend(0.0)).z
                };
                let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
                let rays: Vec<Vec3> = corners.iter().map(|(x, y)| right * *x + up * *y + center).collect();
                let largest = rays.iter().map(|ray| normal.dot(*ray)).fold(0.0, f32::max);
                let longest = rays.iter().map(|ray| ray.length()).fold(0.0, f32::max);
                let depths = corners.map(depth_at_infinity);
                let least = depths.into_iter().fold(f32::INFINITY, f32::min);
                // The margin, and the rounding that it is for.
                let most = 16.0 * UNIT_ROUNDOFF as f32 * (1.0 + 1.0 / largest) * longest;
                assert!(least >= 0.0 && least <= most, "{normal} {shift}: {depths:?}, at most {most}");
            }
        }
    }

    /// Where the camera touches the plane, what is behind the plane is clipped, what is in front of it is not, however
    /// far away, and nearer positions have the greater depth.
    #[test]
    fn a_clip_plane_clips_as_exactly_for_a_camera_that_touches_it() {
        for away in [0.0, 1e-300, 1e-12, 1e-9, 1e-6, 1e-3, 0.05 / 16.0, 0.01, 1.0, 1e3] {
            for (normal, world) in
                [([0.0, 0.0, -1.0], 0.0), ([0.6, 0.0, -0.8], 1e9), ([0.0, 0.8, -0.6], 1e6), ([0.0, 1.0, -0.05], 0.0)]
            {
                let normal = Vec3::from(normal).normalize();
                let position = DVec3::splat(world);
                let clip_plane = Some(ClipPlane { point: position + normal.as_dvec3() * away, normal });
                let camera = Camera {
                    clip_plane,
                    ..Camera::looking_at("portal", position, position + DVec3::new(0.2, -0.1, -0.9))
                };
                let view = RenderView::new(&camera);
                let [right, up, center] = view.picture_axes();
                // From the camera as the plane sees it: rounding a point in the world moves it.
                let away = -clip_plane.map_or(0.0, |plane| plane.distance(position));
                if !view.has_oblique_near_plane() {
                    let in_front =
                        |(x, y): (f32, f32)| f64::from(normal.dot(right * x + up * y + center)) * 0.05 >= away - 1e-9;
                    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
                    assert!(away < 0.0 || corners.into_iter().all(in_front), "{normal}, {away:e} m");
                    continue;
                }
                for (x, y) in [(0.0, 0.0), (0.9, 0.9), (-0.9, 0.9), (0.9, -0.9), (-0.9, -0.9)] {
                    let ray = right * x + up * y + center;
                    let slope = f64::from(normal.dot(ray));
                    let depth_at = |distance: f64| {
                        let clip = view.clip_from_relative() * (ray * distance as f32).extend(1.0);
                        clip.z / clip.w
                    };
                    if slope < 1e-3 {
                        assert!([0.1, 1.0, 1e6].iter().all(|distance| depth_at(*distance) > 1.0), "{normal} {away}");
                        continue;
                    }
                    // The plane, or a 16th of the near plane's distance.
                    let begin = away.max(0.05 / 16.0) / slope;
                    // The sums of the matrix and the ray are off by some u of the distance.
                    let depths = [0.5, 0.99, 1.01, 2.0, 8.0, 64.0].map(|times| depth_at(begin * times));
                    let context = format!("{normal}, {away:e} m: {depths:?}");
                    assert!(depths.is_sorted_by(|near, far| near > far), "{context}");
                    assert!(depths[1] > 1.0 && depths[2] < 1.0, "{context}");
                    assert!([1e6, 1e9, 1e12, 1e20].iter().all(|far| depth_at(*far) > 0.0), "{context}");
                }
            }
        }
    }

    #[test]
    fn a_clip_plane_behind_the_camera_clips_nothing() {
        let clip_plane = Some(ClipPlane { point: DVec3::Z, normal: Vec3::NEG_Z });
        let camera = Camera { clip_plane, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        assert!(!RenderView::new(&camera).has_oblique_near_plane());
    }
}
