//! Projects objects into a view's picture in f64, with bounds of a device's errors.

use glam::{DMat3, DVec2, DVec3, Quat, Vec3};

use crate::raster::Plane;
use crate::scene::{Camera, Projection};

/// A camera for occlusion culling. Camera space has the axes right, down and forward, so its last coordinate is the
/// depth in metres. The picture is in pixels from its upper left corner.
///
/// **Nearness** is the reversed depth that devices write to depth buffers: near ÷ depth in perspective, and
/// (far − depth) ÷ (far − near) without.
#[derive(Clone, Debug)]
pub(super) struct OcclusionCamera {
    position: DVec3,
    /// Rotates from world to camera axes.
    rotation: DMat3,
    is_perspective: bool,
    /// Pixels per metre; in perspective, at a depth of 1 m.
    focal: f64,
    /// Where the view direction meets the picture: its centre, unless the camera has a shift.
    center: DVec2,
    size: DVec2,
    /// How far the picture reaches from `center`, in pixels.
    reach: DVec2,
    near: f64,
    far: f64,
    /// The most pixels by which a point or an edge moves in the picture if it moves by a metre, at a depth of 1 m.
    pixels_per_metre: f64,
}

/// The transform from object space to camera space.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraFromObject {
    rotation: DMat3,
    scale: DVec3,
    origin: DVec3,
    /// A bound of the distance in metres between a transformed point and where a device draws it: see
    /// [`OcclusionCamera::slack`].
    pub(super) slack: f64,
    /// A bound of the distance in metres between the camera and any point of the object.
    pub(super) distance: f64,
}

impl OcclusionCamera {
    /// Converts a camera.
    pub(super) fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size.map(f64::from);
        let back = DMat3::from_quat(camera.orientation.as_dquat().normalize().inverse());
        let (is_perspective, focal) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                (true, height / (2.0 * (f64::from(field_of_view) * 0.5).tan()))
            }
            Projection::Orthographic { height: metres } => (false, height / f64::from(metres)),
            // A picture of zero size hides nothing.
            Projection::Paraboloid => (false, 0.0),
        };
        let size = DVec2::new(width, height);
        let shift = camera.shift.as_dvec2();
        let center = size / 2.0 * (1.0 + shift * DVec2::new(-1.0, 1.0));
        let reach = size / 2.0 * (1.0 + shift.abs());
        let pixels_per_metre = if is_perspective { focal + reach.length() } else { focal };
        Self {
            position: camera.position,
            rotation: DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)) * back,
            is_perspective,
            focal,
            center,
            size,
            reach,
            near: f64::from(camera.near),
            far: f64::from(camera.far),
            pixels_per_metre,
        }
    }

    /// Transforms a point from world to camera space.
    pub(super) fn camera_from_world(&self, point: DVec3) -> DVec3 {
        self.rotation * (point - self.position)
    }

    /// A bound of a device's position error, in metres, for an object's vertex. `distance` is the distance between the
    /// camera and the object's origin, plus that between the origin and the vertex.
    ///
    /// A device works in f32, with a unit roundoff of u = 2⁻²⁴. Let p be a vertex with |s p| ≤ e after scaling, and d
    /// the distance of the object's origin from the camera, so `distance` is d + e. Scaling and rotating cost some 6u
    /// e, the difference of the two positions u d, the sum u (d + e), and the camera's axes with their own rounding 6u
    /// (d + e): less than 16u (d + e) = 2⁻²⁰ (d + e) in all. Positions are rounded to steps of 2⁻³⁰ m, an error of half
    /// a step for each of the two in each coordinate: less than 2⁻²⁹. The rounding of f64 here is 2⁻²⁹ of the former.
    pub(super) fn slack(&self, distance: f64) -> f64 {
        distance * F32_ERROR + FIXED_POINT_ERROR
    }

    /// The transform of an object that extends `extent` metres from its origin.
    pub(super) fn camera_from_object(
        &self,
        position: DVec3,
        orientation: Quat,
        scale: Vec3,
        extent: f64,
    ) -> CameraFromObject {
        let origin = self.camera_from_world(position);
        let distance = origin.length() + extent;
        let rotation = self.rotation * DMat3::from_quat(orientation.as_dquat().normalize());
        CameraFromObject { rotation, scale: scale.as_dvec3(), origin, slack: self.slack(distance), distance }
    }

    /// The upper left and lower right corners of a rectangle of the picture that contains a sphere beyond depth 0.
    pub(super) fn sphere_bounds(&self, center: DVec3, radius: f64) -> [DVec2; 2] {
        let [low, high] = [center.truncate() - radius, center.truncate() + radius];
        if !self.is_perspective {
            return [low, high].map(|corner| self.center + corner * self.focal);
        }
        // A bound on its own side of the picture's centre is farthest out at the nearest depth; one on the other side,
        // at the farthest.
        let [near, far] = [center.z - radius, center.z + radius].map(|depth| self.focal / depth);
        let low = DVec2::select(low.cmplt(DVec2::ZERO), low * near, low * far);
        let high = DVec2::select(high.cmplt(DVec2::ZERO), high * far, high * near);
        [self.center + low, self.center + high]
    }

    /// The same for a box beyond depth 0, given by its centre and half axes.
    pub(super) fn box_bounds(&self, center: DVec3, [a, b, c]: [DVec3; 3]) -> [DVec2; 2] {
        let ([one, other], [low, high]) = ([a + b, a - b], [center - c, center + c]);
        let corners =
            [low - one, low + one, low - other, low + other, high - one, high + one, high - other, high + other];
        let empty = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        corners
            .iter()
            .map(|&corner| self.project(corner))
            .fold(empty, |[low, high], point| [low.min(point), high.max(point)])
    }

    /// The approximate width of a sphere in the picture, in pixels.
    pub(super) fn apparent_width(&self, center: DVec3, radius: f64) -> f64 {
        2.0 * self.focal * radius / if self.is_perspective { center.length() } else { 1.0 }
    }

    /// The least depth in metres at which geometry with this slack is not clipped by the near plane.
    pub(super) fn min_depth(&self, slack: f64) -> f64 {
        self.near + slack
    }

    /// The depth at which an occluder that crosses the near plane is clipped. In perspective it is at least 1/256 of
    /// the occluder's distance, so that rounding errors are magnified no more than 256 times.
    pub(super) fn clip_depth(&self, placement: &CameraFromObject, slack: f64) -> f64 {
        let min_depth = if self.is_perspective { placement.distance / 256.0 } else { 0.0 };
        self.near.max(min_depth) + 2.0 * slack
    }

    /// Whether a point is within the picture.
    pub(super) fn is_in_picture(&self, point: DVec2) -> bool {
        point.cmpge(DVec2::ZERO).all() && point.cmplt(self.size).all()
    }

    /// Whether the projection is perspective.
    pub(super) fn is_perspective(&self) -> bool {
        self.is_perspective
    }

    /// Projects a point in camera space, beyond depth 0, into the picture.
    pub(super) fn project(&self, point: DVec3) -> DVec2 {
        let scale = if self.is_perspective { self.focal / point.z } else { self.focal };
        self.center + point.truncate() * scale
    }

    /// A bound of a device's error in the picture, in pixels, for geometry beyond `depth` with a position error of up
    /// to `slack` metres.
    ///
    /// A line of the picture is a plane through the eye, n · e = 0 with |n| = 1, and its pixels are those where n · (x,
    /// y, focal) = 0. Where it crosses the picture, |n.z| focal ≤ r |n.xy| for the half diagonal r, so 1 ≤ |n.xy|² (1 +
    /// r² ÷ focal²); a point at a distance of slack from the plane is at most slack × focal ÷ (depth |n.xy|) ≤ slack
    /// (focal + r) ÷ depth from the line. A point of the picture moves no farther. Devices also snap to 1/256 of a
    /// pixel, and the viewport transform has an error of a few unit roundoffs of the picture's size.
    pub(super) fn pixel_error(&self, slack: f64, depth: f64) -> f64 {
        let scale = if self.is_perspective { self.pixels_per_metre / depth } else { self.pixels_per_metre };
        SNAPPING_ERROR + self.reach.max_element() * F32_ERROR + slack * scale
    }

    /// The greatest nearness that a device may compute for a depth; the tolerance, 2⁻¹⁸, is some 64 unit roundoffs.
    pub(super) fn max_nearness(&self, depth: f64) -> f64 {
        if self.is_perspective {
            self.near / depth * (1.0 + DEPTH_ERROR)
        } else {
            (self.far - depth) / (self.far - self.near) + DEPTH_ERROR
        }
    }

    /// The least nearness that a device may compute for a depth.
    pub(super) fn min_nearness(&self, depth: f64) -> f64 {
        if self.is_perspective {
            self.near / depth * (1.0 - DEPTH_ERROR)
        } else {
            (self.far - depth) / (self.far - self.near) - DEPTH_ERROR
        }
    }

    /// The least nearness of a face's plane as a linear function of the picture: its change per pixel to the right, its
    /// change per pixel down, and its value at the picture's origin. `None` for a back face.
    ///
    /// A ray e = z (x, y, 1) meets n · e = d where 1 ÷ z = n · (x, y, 1) ÷ d, which is linear in the picture. Without
    /// perspective z = (d − n.x x − n.y y) ÷ n.z is.
    ///
    /// A device interpolates depth between corners, so its error may be some unit roundoffs of the depth of the nearest
    /// corner, which is at least `min_depth` away.
    pub(super) fn nearness_plane(&self, face: &Plane, min_depth: f64) -> Option<[f64; 3]> {
        let Plane { normal, offset } = *face;
        let slope = normal.truncate() / self.focal;
        let start = slope.dot(self.center);
        if self.is_perspective {
            let scale = self.near / offset * (1.0 - DEPTH_ERROR);
            let interpolated = self.near / min_depth.max(self.near) * INTERPOLATION_ERROR;
            (offset < 0.0).then_some([slope.x * scale, slope.y * scale, (normal.z - start) * scale - interpolated])
        } else {
            let scale = 1.0 / (normal.z * (self.far - self.near));
            let at_origin = (self.far * normal.z - offset - start) * scale - DEPTH_ERROR;
            (normal.z < 0.0).then_some([slope.x * scale, slope.y * scale, at_origin])
        }
    }
}

impl CameraFromObject {
    /// Transforms a point.
    pub(super) fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * (self.scale * point) + self.origin
    }

    /// Transforms a vector along one of the object's axes, given by its length in object space.
    pub(super) fn transform_axis(&self, axis: usize, length: f64) -> DVec3 {
        self.rotation.col(axis) * (self.scale[axis] * length)
    }

    /// Transforms a face's plane. Its normal is divided by the scale, so it points outwards for a mirrored object, too.
    pub(super) fn transform_face(&self, face: &Plane) -> Plane {
        let normal = face.normal / self.scale;
        let length = normal.length();
        let normal = self.rotation * (normal / length);
        Plane { normal, offset: face.offset / length + normal.dot(self.origin) }
    }

    /// Whether no scale is 0.
    pub(super) fn is_invertible(&self) -> bool {
        self.scale.cmpne(DVec3::ZERO).all()
    }

    /// The greatest factor by which distances grow.
    pub(super) fn max_scale(&self) -> f64 {
        self.scale.abs().max_element()
    }
}

/// 16 unit roundoffs of f32.
const F32_ERROR: f64 = 1.0 / 1_048_576.0;

/// Two steps of a [`FixedPosition`](crate::view::FixedPosition).
const FIXED_POINT_ERROR: f64 = 2.0 / 1_073_741_824.0;

/// The grid to which devices snap vertices, in pixels.
const SNAPPING_ERROR: f64 = 1.0 / 256.0;

/// 4 unit roundoffs of f32: of z ÷ w, of the interpolation weight, of their product and of the sum.
const INTERPOLATION_ERROR: f64 = 4.0 / 16_777_216.0;

/// See [`OcclusionCamera::max_nearness`].
const DEPTH_ERROR: f64 = 1.0 / 262_144.0;

#[cfg(test)]
mod tests {
    use glam::Vec4;
    use proptest::prelude::*;

    use super::*;
    use crate::view::RenderView;

    prop_compose! {
        fn any_camera()(
            position in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..9.0_f64,
            towards in prop::array::uniform3(-1.0..1.0_f64),
            degrees in 1.0..150.0_f32,
            size in prop::array::uniform2(1_u32..4000),
            is_orthographic in prop::bool::ANY,
            shift in prop::array::uniform2(-2.0..2.0_f32),
        ) -> Camera {
            let position = DVec3::from(position) * 10_f64.powf(exponent);
            let mut camera = Camera::looking_at("any", position, position + DVec3::from(towards));
            camera.projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            if is_orthographic {
                (camera.projection, camera.far) = (Projection::Orthographic { height: degrees }, 1e4);
            } else if size[0] % 2 == 0 {
                camera.shift = shift.into();
            }
            Camera { size, ..camera }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        /// Computes the same in f32, step by step as shaders do.
        #[test]
        fn a_device_draws_within_the_slack(
            camera in any_camera(),
            slope in prop::array::uniform2(-1.2..1.2_f32),
            distance in -4.0..4.0_f64,
            arm in prop::array::uniform3(-1.0..1.0_f32),
            length in -5.0..3.0_f32,
            turn in prop::array::uniform4(-1.0..1.0_f32),
            stretch in 0.1..10.0_f32,
        ) {
            let camera = Camera { near: 1e-6, ..camera };
            let occlusion_camera = OcclusionCamera::new(&camera);
            let view = RenderView::new(&camera);
            let [right, up, forward] = view.picture_axes().map(|axis| axis.as_dvec3());
            let ray = right * f64::from(slope[0]) + up * f64::from(slope[1]);
            let along = 10_f64.powf(distance);
            let target = camera.position + if occlusion_camera.is_perspective() { (ray + forward) * along } else { ray + forward * along };
            let orientation = Quat::from_array(turn);
            prop_assume!(orientation.length_squared() > 0.1);
            let orientation = orientation.normalize();
            let vertex = Vec3::from(arm) * 10_f32.powf(length);
            let scale = Vec3::new(stretch, -1.0, 1.0 / stretch);
            let position = target - orientation.as_dquat() * (scale * vertex).as_dvec3();

            let extent = (scale.as_dvec3() * vertex.as_dvec3()).length();
            let placement = occlusion_camera.camera_from_object(position, orientation, scale, extent);
            let exact = placement.transform_point(vertex.as_dvec3());
            prop_assume!(exact.z - placement.slack > occlusion_camera.min_depth(placement.slack));

            let steps = |point: DVec3| (point * 2_f64.powi(30)).round();
            let origin = ((steps(position) - steps(camera.position)) * 2_f64.powi(-30)).as_vec3();
            let clip: Vec4 = view.clip_from_relative() * (origin + orientation * (scale * vertex)).extend(1.0);
            let [width, height] = camera.size.map(|pixels| pixels as f32);
            let drawn = DVec2::new(f64::from((clip.x / clip.w * 0.5 + 0.5) * width), f64::from((0.5 - clip.y / clip.w * 0.5) * height));
            let depth = exact.z - placement.slack;
            let pixel_error = occlusion_camera.pixel_error(placement.slack, depth) - SNAPPING_ERROR;
            let error = (drawn - occlusion_camera.project(exact)).abs().max_element();
            prop_assert!(error <= pixel_error, "{error} pixels, and the bound is {pixel_error}");
            let nearness = f64::from(clip.z / clip.w);
            let min = occlusion_camera.min_nearness(exact.z + placement.slack);
            let max = occlusion_camera.max_nearness(depth);
            prop_assert!((min..=max).contains(&nearness), "{min} {nearness} {max}");
            // The bounds are no wider than they must be.
            let from_slack = if occlusion_camera.is_perspective() { max / depth } else { 1.0 / f64::from(camera.far - camera.near) };
            let width = 2.0 * (DEPTH_ERROR * max.max(1.0) + placement.slack * from_slack);
            prop_assert!(max - min <= width * 1.001, "{min} {max}, {width} apart");
        }

        #[test]
        fn a_transformed_face_contains_its_transformed_corners(
            camera in any_camera(),
            corners in prop::array::uniform4(prop::array::uniform3(-9.0..9.0_f64)),
            scale in prop::array::uniform3(-3.0..3.0_f32),
            turn in prop::array::uniform4(-1.0..1.0_f32),
            offset in prop::array::uniform3(-50.0..50.0_f64),
            near in -1.0..3.0_f32,
        ) {
            let camera = Camera { near: 10_f32.powf(near), ..camera };
            let [a, b, c, inside] = corners.map(DVec3::from);
            let normal = (b - a).cross(c - a);
            let orientation = Quat::from_array(turn);
            let is_usual = Vec3::from(scale).abs().min_element() > 0.05 && orientation.length() > 0.1;
            prop_assume!(normal.length() > 1.0 && is_usual);
            let normal = normal.normalize() * -normal.dot(inside - a).signum();
            let face = Plane { normal, offset: normal.dot(a) };
            prop_assume!(face.signed_distance(inside) < -0.1);

            let occlusion_camera = OcclusionCamera::new(&camera);
            let position = camera.position + DVec3::from(offset);
            let placement = occlusion_camera.camera_from_object(position, orientation.normalize(), scale.into(), 50.0);
            let placed = placement.transform_face(&face);
            let points = [a, b, c].map(|point| placement.transform_point(point));
            prop_assert!(points.iter().all(|&point| placed.signed_distance(point).abs() < 1e-5));
            prop_assert!(placed.signed_distance(placement.transform_point(inside)) < 0.0);
            // If the camera is in front of the face, its plane has the corners' nearness at the corners.
            let eye = if occlusion_camera.is_perspective() { DVec3::ZERO } else { points[0] - DVec3::Z };
            let plane = occlusion_camera.nearness_plane(&placed, f64::INFINITY);
            prop_assert_eq!(plane.is_some(), placed.signed_distance(eye) > 0.0);
            let is_edge_on = placed.signed_distance(eye) < if occlusion_camera.is_perspective() { 1.0 } else { 0.01 };
            if let Some([right, down, offset]) = plane.filter(|_| !is_edge_on) {
                for point in points.into_iter().filter(|point| point.z > 1.0) {
                    let pixel = occlusion_camera.project(point);
                    let found = right * pixel.x + down * pixel.y + offset;
                    let expected = occlusion_camera.min_nearness(point.z);
                    let tolerance = 1e-6 * occlusion_camera.max_nearness(point.z).abs().max(1e-3);
                    prop_assert!((found - expected).abs() <= tolerance, "{found} {expected}");
                }
            }
        }

        #[test]
        fn rectangles_contain_what_they_bound(
            camera in any_camera(),
            center in prop::array::uniform3(-20.0..20.0_f64),
            sides in prop::array::uniform3(prop::array::uniform3(-3.0..3.0_f64)),
            share in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let occlusion_camera = OcclusionCamera::new(&camera);
            let sides = sides.map(DVec3::from);
            let reach: f64 = sides.iter().map(|side| side.length()).sum();
            let [x, y, z] = center;
            let center = DVec3::new(x, y, z.abs() + reach + 0.1);
            let point = center + sides[0] * share[0] + sides[1] * share[1] + sides[2] * share[2];
            for [low, high] in [occlusion_camera.box_bounds(center, sides), occlusion_camera.sphere_bounds(center, reach)] {
                let picture = occlusion_camera.project(point);
                prop_assert!(picture.cmpge(low - 1e-6).all() && picture.cmple(high + 1e-6).all(), "{low} {picture} {high}");
            }
        }
    }
}
