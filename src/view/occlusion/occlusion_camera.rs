//! Where things are in a view's picture, in f64, and how far a device may put them from there.

use glam::{DMat3, DVec2, DVec3, Quat, Vec3};

use crate::raster::Plane;
use crate::scene::{Camera, Projection};

/// A camera as occlusion needs it. Its axes are right, down and forward, so the last coordinate is the depth in metres; its
/// pictures are in pixels from the upper left.
///
/// **Nearness** is what devices write as depth: near ÷ depth in perspective, and (far − depth) ÷ (far − near) without.
#[derive(Clone, Debug)]
pub(super) struct OcclusionCamera {
    position: DVec3,
    /// From the world's axes.
    turn: DMat3,
    is_perspective: bool,
    /// Pixels a metre; in perspective at a depth of 1 m.
    focal: f64,
    /// The picture's.
    center: DVec2,
    near: f64,
    far: f64,
    /// How many pixels a metre to the side, or in perspective of depth, moves a place or an edge in the picture at a depth of 1 m.
    reach: f64,
}

/// Where an object is: from object space to a camera's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// Turns.
    turn: DMat3,
    scale: DVec3,
    origin: DVec3,
    /// How far from here a device may draw the object's places, in metres. See [`OcclusionCamera::slack`].
    pub(super) slack: f64,
    /// No place of the object is farther from the camera, in metres.
    pub(super) distance: f64,
}

impl OcclusionCamera {
    /// That of a camera.
    pub(super) fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size.map(f64::from);
        let back = DMat3::from_quat(camera.orientation.as_dquat().normalize().inverse());
        let (is_perspective, focal) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                (true, height / (2.0 * (f64::from(field_of_view) * 0.5).tan()))
            }
            Projection::Orthographic { height: metres } => (false, height / f64::from(metres)),
            // Nothing is hidden in a picture of no size.
            Projection::Paraboloid => (false, 0.0),
        };
        let center = DVec2::new(width, height) / 2.0;
        let reach = if is_perspective { focal + center.length() } else { focal };
        Self {
            position: camera.position,
            turn: DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)) * back,
            is_perspective,
            focal,
            center,
            near: f64::from(camera.near),
            far: f64::from(camera.far),
            reach,
        }
    }

    /// A place of the world, from here.
    pub(super) fn relative(&self, place: DVec3) -> DVec3 {
        self.turn * (place - self.position)
    }

    /// How far from its place a device may draw an object's vertex, in metres, if neither the object's origin nor the vertex is
    /// farther from the camera than some distance less what the vertex is from the origin.
    ///
    /// A device works in f32, with a unit roundoff of u = 2⁻²⁴. Let p be a vertex with |s p| ≤ e after scaling, and d the distance of
    /// the object's origin from the camera, so `distance` is d + e. Scaling and turning cost some 6u e, the difference of the two
    /// positions u d, the sum u (d + e), and the camera's axes with the rounding of their own 6u (d + e): less than
    /// 16u (d + e) = 2⁻²⁰ (d + e) in all. Positions are rounded to steps of 2⁻³⁰ m, which is half of one for each of the two in
    /// each coordinate: less than 2⁻²⁹. What f64 rounds here is 2⁻²⁹ of the former.
    pub(super) fn slack(&self, distance: f64) -> f64 {
        distance * SINGLE + STEP
    }

    /// Where an object is that reaches `extent` metres from its origin.
    pub(super) fn place(&self, position: DVec3, orientation: Quat, scale: Vec3, extent: f64) -> Placement {
        let origin = self.relative(position);
        let distance = origin.length() + extent;
        let turn = self.turn * DMat3::from_quat(orientation.as_dquat().normalize());
        Placement { turn, scale: scale.as_dvec3(), origin, slack: self.slack(distance), distance }
    }

    /// A rectangle of the picture that holds a ball beyond depth 0: between its upper left and its lower right.
    pub(super) fn around_ball(&self, center: DVec3, radius: f64) -> [DVec2; 2] {
        let [low, high] = [center.truncate() - radius, center.truncate() + radius];
        if !self.is_perspective {
            return [low, high].map(|place| self.center + place * self.focal);
        }
        // What is on the near side of the picture's middle is farthest from it where it is nearest.
        let [near, far] = [center.z - radius, center.z + radius].map(|depth| self.focal / depth);
        let low = DVec2::select(low.cmplt(DVec2::ZERO), low * near, low * far);
        let high = DVec2::select(high.cmplt(DVec2::ZERO), high * far, high * near);
        [self.center + low, self.center + high]
    }

    /// The same of a box beyond depth 0: its centre and half its sides.
    pub(super) fn around_box(&self, center: DVec3, [a, b, c]: [DVec3; 3]) -> [DVec2; 2] {
        let ([one, other], [low, high]) = ([a + b, a - b], [center - c, center + c]);
        let corners =
            [low - one, low + one, low - other, low + other, high - one, high + one, high - other, high + other];
        let around = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        corners
            .iter()
            .map(|&corner| self.picture(corner))
            .fold(around, |[low, high], place| [low.min(place), high.max(place)])
    }

    /// How wide a ball looks, in pixels, as far as that is a question of its distance.
    pub(super) fn apparent(&self, center: DVec3, radius: f64) -> f64 {
        2.0 * self.focal * radius / if self.is_perspective { center.length() } else { 1.0 }
    }

    /// The depth, in metres, that all of an object lies beyond if it can be drawn as it is, `slack` included.
    pub(super) fn nearest(&self, slack: f64) -> f64 {
        self.near + slack
    }

    /// The depth that an occluder which crosses the near plane is cut off at, since what is nearer is not drawn: in perspective so
    /// far that what is left is drawn at no more than 256 times its size at its own distance, or rounding would eat it up.
    pub(super) fn cut(&self, placement: &Placement, slack: f64) -> f64 {
        let least = if self.is_perspective { placement.distance / 256.0 } else { 0.0 };
        self.near.max(least) + 2.0 * slack
    }

    /// Whether a place of the picture is in it.
    pub(super) fn is_in_picture(&self, place: DVec2) -> bool {
        place.cmpge(DVec2::ZERO).all() && place.cmplt(self.center * 2.0).all()
    }

    /// Whether places are the smaller the farther away they are.
    pub(super) fn is_perspective(&self) -> bool {
        self.is_perspective
    }

    /// Where in the picture a place is, beyond depth 0.
    pub(super) fn picture(&self, place: DVec3) -> DVec2 {
        let scale = if self.is_perspective { self.focal / place.z } else { self.focal };
        self.center + place.truncate() * scale
    }

    /// How far in pixels from its place in the picture a device may draw what is beyond `depth`, where places are up to `slack`
    /// metres off.
    ///
    /// A line of the picture is a plane through the eye, n · e = 0 with |n| = 1, and its pixels are those where
    /// n · (x, y, focal) = 0. Where it crosses the picture, |n.z| focal ≤ r |n.xy| for the half diagonal r, so
    /// 1 ≤ |n.xy|² (1 + r² ÷ focal²); a place that is off the plane by the slack is off the line by
    /// slack × focal ÷ (depth |n.xy|) ≤ slack (focal + r) ÷ depth. A place of the picture moves no farther. Devices also snap to 1/256
    /// of a pixel, and place the picture with an error of a few unit roundoffs of its size.
    pub(super) fn margin(&self, slack: f64, depth: f64) -> f64 {
        let scale = if self.is_perspective { self.reach / depth } else { self.reach };
        SNAP + self.center.max_element() * SINGLE + slack * scale
    }

    /// How near a depth is at most, as devices compute it: 2⁻¹⁸ is some 64 unit roundoffs.
    pub(super) fn nearness_at_most(&self, depth: f64) -> f64 {
        if self.is_perspective {
            self.near / depth * (1.0 + DEPTH)
        } else {
            (self.far - depth) / (self.far - self.near) + DEPTH
        }
    }

    /// How near a depth is at least.
    pub(super) fn nearness_at_least(&self, depth: f64) -> f64 {
        if self.is_perspective {
            self.near / depth * (1.0 - DEPTH)
        } else {
            (self.far - depth) / (self.far - self.near) - DEPTH
        }
    }

    /// How near a face's plane is at least: what a pixel to the right adds, and one down, and what it is at the picture's origin.
    /// `None` for a face that is not seen.
    ///
    /// A ray e = z (x, y, 1) meets n · e = d where 1 ÷ z = n · (x, y, 1) ÷ d, which is linear in the picture. Without perspective
    /// z = (d − n.x x − n.y y) ÷ n.z is.
    ///
    /// A device interpolates depth between corners, so it may be off by some unit roundoffs of what it is at the nearest of them, which
    /// is at least `nearest` away.
    pub(super) fn plane(&self, face: &Plane, nearest: f64) -> Option<[f64; 3]> {
        let Plane { normal, offset } = *face;
        let slope = normal.truncate() / self.focal;
        let start = slope.dot(self.center);
        if self.is_perspective {
            let scale = self.near / offset * (1.0 - DEPTH);
            let interpolated = self.near / nearest.max(self.near) * INTERPOLATED;
            (offset < 0.0).then_some([slope.x * scale, slope.y * scale, (normal.z - start) * scale - interpolated])
        } else {
            let scale = 1.0 / (normal.z * (self.far - self.near));
            let at_origin = (self.far * normal.z - offset - start) * scale - DEPTH;
            (normal.z < 0.0).then_some([slope.x * scale, slope.y * scale, at_origin])
        }
    }
}

impl Placement {
    /// A place of object space.
    pub(super) fn place(&self, place: DVec3) -> DVec3 {
        self.turn * (self.scale * place) + self.origin
    }

    /// A vector along one of the object's axes, that long in object space.
    pub(super) fn axis(&self, axis: usize, length: f64) -> DVec3 {
        self.turn.col(axis) * (self.scale[axis] * length)
    }

    /// A face, which stays where it is outside also of a mirrored object: normals go by the inverse of the scale.
    pub(super) fn face(&self, face: &Plane) -> Plane {
        let normal = face.normal / self.scale;
        let length = normal.length();
        let normal = self.turn * (normal / length);
        Plane { normal, offset: face.offset / length + normal.dot(self.origin) }
    }

    /// Whether the object has any volume left.
    pub(super) fn has_volume(&self) -> bool {
        self.scale.cmpne(DVec3::ZERO).all()
    }

    /// By how much distances grow at most.
    pub(super) fn stretch(&self) -> f64 {
        self.scale.abs().max_element()
    }
}

/// 16 unit roundoffs of f32.
const SINGLE: f64 = 1.0 / 1_048_576.0;

/// Twice a step of a [`FixedPosition`](crate::view::FixedPosition).
const STEP: f64 = 2.0 / 1_073_741_824.0;

/// The grid that devices snap corners of triangles to, in pixels.
const SNAP: f64 = 1.0 / 256.0;

/// 4 unit roundoffs of f32: of z ÷ w, of the share, of their product and of the sum.
const INTERPOLATED: f64 = 4.0 / 16_777_216.0;

/// See [`OcclusionCamera::nearness_at_most`].
const DEPTH: f64 = 1.0 / 262_144.0;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::Vec4;
    use proptest::prelude::*;

    use super::*;
    use crate::view::RenderView;

    prop_compose! {
        fn any_camera()(
            place in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..9.0_f64,
            towards in prop::array::uniform3(-1.0..1.0_f64),
            degrees in 1.0..150.0_f32,
            size in prop::array::uniform2(1_u32..4000),
            is_flat in prop::bool::ANY,
        ) -> Camera {
            let position = DVec3::from(place) * 10_f64.powf(exponent);
            let mut camera = Camera::looking_at("any", position, position + DVec3::from(towards));
            camera.projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            if is_flat {
                (camera.projection, camera.far) = (Projection::Orthographic { height: degrees }, 1e4);
            }
            Camera { size, ..camera }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        /// The same in f32, step by step as shaders do it.
        #[test]
        fn a_device_draws_within_the_slack(
            camera in any_camera(),
            aside in prop::array::uniform2(-1.2..1.2_f32),
            distance in -1.0..4.0_f64,
            arm in prop::array::uniform3(-1.0..1.0_f32),
            length in -3.0..3.0_f32,
            turn in prop::array::uniform4(-1.0..1.0_f32),
            stretch in 0.1..10.0_f32,
        ) {
            let eye = OcclusionCamera::new(&camera);
            let view = RenderView::new(&camera);
            let [right, up, forward] = view.picture_axes().map(|axis| axis.as_dvec3());
            let ray = right * f64::from(aside[0]) + up * f64::from(aside[1]);
            let along = 10_f64.powf(distance);
            let target = camera.position + if eye.is_perspective() { (ray + forward) * along } else { ray + forward * along };
            let orientation = Quat::from_array(turn);
            prop_assume!(orientation.length_squared() > 0.1);
            let orientation = orientation.normalize();
            let vertex = Vec3::from(arm) * 10_f32.powf(length);
            let scale = Vec3::new(stretch, -1.0, 1.0 / stretch);
            let position = target - orientation.as_dquat() * (scale * vertex).as_dvec3();

            let extent = (scale.as_dvec3() * vertex.as_dvec3()).length();
            let placement = eye.place(position, orientation, scale, extent);
            let exact = placement.place(vertex.as_dvec3());
            prop_assume!(exact.z - placement.slack > eye.nearest(placement.slack));

            let steps = |place: DVec3| (place * 2_f64.powi(30)).round();
            let origin = ((steps(position) - steps(camera.position)) * 2_f64.powi(-30)).as_vec3();
            let clip: Vec4 = view.clip_from_relative() * (origin + orientation * (scale * vertex)).extend(1.0);
            let [width, height] = camera.size.map(|pixels| pixels as f32);
            let drawn = DVec2::new(f64::from((clip.x / clip.w * 0.5 + 0.5) * width), f64::from((0.5 - clip.y / clip.w * 0.5) * height));
            let depth = exact.z - placement.slack;
            let margin = eye.margin(placement.slack, depth) - SNAP;
            let off = (drawn - eye.picture(exact)).abs().max_element();
            prop_assert!(off <= margin, "{off} pixels, and {margin} are allowed for");
            let nearness = f64::from(clip.z / clip.w);
            let least = eye.nearness_at_least(exact.z + placement.slack);
            let most = eye.nearness_at_most(depth);
            prop_assert!((least..=most).contains(&nearness), "{least} {nearness} {most}");
        }

        #[test]
        fn a_face_goes_with_its_places(
            camera in any_camera(),
            corners in prop::array::uniform4(prop::array::uniform3(-9.0..9.0_f64)),
            scale in prop::array::uniform3(-3.0..3.0_f32),
            turn in prop::array::uniform4(-1.0..1.0_f32),
            aside in prop::array::uniform3(-50.0..50.0_f64),
        ) {
            let [a, b, c, inside] = corners.map(DVec3::from);
            let normal = (b - a).cross(c - a);
            let orientation = Quat::from_array(turn);
            let is_usual = Vec3::from(scale).abs().min_element() > 0.05 && orientation.length() > 0.1;
            prop_assume!(normal.length() > 1.0 && is_usual);
            let normal = normal.normalize() * -normal.dot(inside - a).signum();
            let face = Plane { normal, offset: normal.dot(a) };
            prop_assume!(face.signed_distance(inside) < -0.1);

            let eye = OcclusionCamera::new(&camera);
            let position = camera.position + DVec3::from(aside);
            let placement = eye.place(position, orientation.normalize(), scale.into(), 50.0);
            let placed = placement.face(&face);
            let places = [a, b, c].map(|place| placement.place(place));
            prop_assert!(places.iter().all(|&place| placed.signed_distance(place).abs() < 1e-5));
            prop_assert!(placed.signed_distance(placement.place(inside)) < 0.0);
            // Where it is seen and the eye outside, it is as near at each place of the picture as its corners there.
            if let Some([right, down, offset]) = eye.plane(&placed, f64::INFINITY) {
                for place in places.into_iter().filter(|place| place.z > 1.0 && placed.offset < -1.0) {
                    let pixel = eye.picture(place);
                    let found = right * pixel.x + down * pixel.y + offset;
                    let least = eye.nearness_at_least(place.z);
                    prop_assert!((found - least).abs() <= 1e-4 * eye.nearness_at_most(place.z).abs(), "{found} {least}");
                }
            }
        }

        #[test]
        fn rectangles_hold_what_they_are_around(
            camera in any_camera(),
            center in prop::array::uniform3(-20.0..20.0_f64),
            sides in prop::array::uniform3(prop::array::uniform3(-3.0..3.0_f64)),
            share in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let eye = OcclusionCamera::new(&camera);
            let sides = sides.map(DVec3::from);
            let reach: f64 = sides.iter().map(|side| side.length()).sum();
            let [x, y, z] = center;
            let center = DVec3::new(x, y, z.abs() + reach + 0.1);
            let place = center + sides[0] * share[0] + sides[1] * share[1] + sides[2] * share[2];
            for [low, high] in [eye.around_box(center, sides), eye.around_ball(center, reach)] {
                let picture = eye.picture(place);
                prop_assert!(picture.cmpge(low - 1e-6).all() && picture.cmple(high + 1e-6).all(), "{low} {picture} {high}");
            }
        }
    }
}
