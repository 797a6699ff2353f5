//! The functions of `drawloom.wgsl` in Rust, for all CPU shaders.

use super::built_in::{mix, normalize, rgb, with_alpha};
use super::{PassInputs, ShaderMaterial, ShaderObject, ShaderView};
use crate::raster::{Real, Vector, Vector2, Vector3, Vector4};
use crate::scene::Projection;

impl<R: Real> ShaderObject<R> {
    /// From object space to a position relative to the camera, along the world's axes, in metres: `relative_position`.
    pub fn relative_position(&self, position: Vector3<R>) -> Vector3<R> {
        self.origin + self.orientation.rotate(self.scale * position) - self.camera
    }

    /// A normal from object space to the world's axes, of unit length; 0 if there is none: `world_normal`. It works for
    /// a scale of 0 along one axis too.
    pub fn world_normal(&self, normal: Vector3<R>) -> Vector3<R> {
        let largest = self.scale.0.into_iter().fold(R::zero(), |largest, size| largest.max(size.abs()));
        // Products of the unnormalized scale could leave the range of f32.
        let scale = if largest > R::zero() { self.scale.map(|size| size / largest) } else { Vector::splat(R::one()) };
        let [x, y, z] = scale.0;
        let mirrored = if x * y * z < R::zero() { -R::one() } else { R::one() };
        // Cofactors need no division, unlike the inverse.
        normalize(self.orientation.rotate(Vector([y * z, z * x, x * y]) * mirrored * normal))
    }
}

impl<R: Real> ShaderView<R> {
    /// From a position relative to the camera, along the world's axes, to clip space: `clip_position`. CPU shaders that
    /// call it with the same position draw at exactly the same depth.
    pub fn clip_position(&self, relative: Vector3<R>) -> Vector4<R> {
        let [right, up, back, origin] = self.clip_from_relative;
        let [x, y, z] = relative.0;
        let clip = right * x + up * y + back * z + origin;
        if self.projection == Projection::Paraboloid { self.paraboloid_position(rgb(clip)) } else { clip }
    }

    /// From the camera's axes to clip space, by a paraboloid mapping (Brabec et al. 2002).
    fn paraboloid_position(&self, position: Vector3<R>) -> Vector4<R> {
        let distance = position.length();
        let nonzero = distance.max(R::of(1e-30));
        let forward = -position[2] / nonzero;
        let depth = (self.far - distance) / (self.far - self.near);
        let divisor = nonzero * (R::one() + forward).max(R::of(0.1));
        // The mapping is singular straight behind the camera. Everything near that direction is outside of the picture
        // and clipped.
        let depth = if forward < R::of(-0.6) { -R::one() } else { depth };
        Vector([position[0] / divisor, position[1] / divisor, depth, R::one()])
    }

    /// From a pixel's clip coordinates and depth to its position relative to the camera, along the world's axes, in
    /// metres: `position_from_depth`. In perspective, a depth of 0 is infinitely far away.
    pub fn position_from_depth(&self, clip: Vector2<R>, depth: R) -> Vector3<R> {
        let across = self.right * clip[0] + self.up * clip[1];
        if self.is_perspective() {
            let ray = across + self.forward;
            let [right, up, back, origin] = self.clip_from_relative.map(|column| column[2]);
            // 0 unless the near plane is oblique.
            let depth_at_infinity = Vector([right, up, back]).dot(ray);
            return ray * (origin / (depth - depth_at_infinity).max(R::zero()));
        }
        across + self.forward * mix(self.far, self.near, depth)
    }

    /// The direction from a position relative to the camera towards the eye, of unit length: `direction_to_eye`.
    pub fn direction_to_eye(&self, relative: Vector3<R>) -> Vector3<R> {
        if self.is_perspective() { -normalize(relative) } else { -self.forward }
    }

    pub(in crate::process) fn is_perspective(&self) -> bool {
        matches!(self.projection, Projection::Perspective { .. })
    }
}

impl<R: Real> PassInputs<'_, R> {
    /// The diffuse colour and opacity of the material in a slot at texture coordinates with these derivatives:
    /// `diffuse_at`.
    pub fn diffuse_at(
        &self,
        slot: u32,
        material: &ShaderMaterial<R>,
        uv: Vector2<R>,
        dpdx: Vector2<R>,
        dpdy: Vector2<R>,
    ) -> Vector4<R> {
        with_alpha(material.diffuse, material.opacity) * self.materials.texture_at(slot, 0, uv, [dpdx, dpdy])
    }

    /// Whether the material in a slot is a mask that has a hole at texture coordinates: `is_cut_out`.
    pub fn is_cut_out(&self, slot: u32, material: &ShaderMaterial<R>, uv: Vector2<R>) -> bool {
        let alpha = || material.opacity * self.materials.texture_at(slot, 0, uv, [Vector::zero(); 2])[3];
        material.alpha_cutoff > R::zero() && alpha() < material.alpha_cutoff
    }
}

/// Texture coordinates of a vertex that can be interpolated: `bounded_uv`.
pub fn bounded_uv<R: Real>(uv: Vector2<R>) -> Vector2<R> {
    let farthest = R::of(MAX_UV);
    uv.map(|value| value.max(-farthest).min(farthest))
}

/// From here on all f32 are integers, so the fraction of a texture coordinate is 0.
const MAX_UV: f64 = 8_388_608.0;

/// A direction as a point of the unfolded octahedron, each coordinate from -1 to 1 (Cigolle et al. 2014).
pub fn octahedral_from_direction<R: Real>(direction: Vector3<R>) -> Vector2<R> {
    let [x, y, z] = direction.0;
    let size = x.abs() + y.abs() + z.abs();
    let point = Vector([x / size, y / size]);
    if z >= R::zero() { point } else { fold(point) }
}

/// The direction, of unit length, of a point of the unfolded octahedron.
pub fn direction_from_octahedral<R: Real>(point: Vector2<R>) -> Vector3<R> {
    let z = R::one() - point[0].abs() - point[1].abs();
    let Vector([x, y]) = if z >= R::zero() { point } else { fold(point) };
    normalize(Vector([x, y, z]))
}

fn fold<R: Real>(point: Vector2<R>) -> Vector2<R> {
    let [x, y] = point.0;
    let sign = |value: R| if value >= R::zero() { R::one() } else { -R::one() };
    Vector([(R::one() - y.abs()) * sign(x), (R::one() - x.abs()) * sign(y)])
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec2, DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::test_inputs::{UNIT, direction, paraboloid, view_values, views};
    use crate::quality::NormalFormat;
    use crate::raster::Quaternion;
    use crate::view::RenderView;

    fn object<R: Real>(orientation: DQuat, scale: DVec3) -> ShaderObject<R> {
        ShaderObject {
            camera: Vector3::zero(),
            origin: Vector3::of(DVec3::new(3.0, -2.0, 1.0)),
            orientation: Quaternion::of(orientation),
            scale: Vector3::of(scale),
            material: 0,
            index: 0,
        }
    }

    fn as_double<R: Real>(vector: Vector3<R>) -> DVec3 {
        DVec3::from(vector.0.map(R::as_f64))
    }

    /// The angle between two directions in degrees, by its sine too: the cosine alone is inaccurate for small angles.
    fn angle(one: DVec3, other: DVec3) -> f64 {
        one.cross(other).length().atan2(one.dot(other)).to_degrees()
    }

    proptest! {
        /// The oracle divides by the scale, as the inverse of the transpose does.
        #[test]
        fn objects_are_transformed_as_by_a_matrix(
            turn in prop::array::uniform3(-3.0..3.0_f64),
            scale in prop::array::uniform3((0.1..9.0_f64, any::<bool>())),
            normal in direction(),
            size in -9..9_i32,
        ) {
            let orientation = DQuat::from_scaled_axis(turn.into());
            let scale = DVec3::from(scale.map(|(size, mirrored)| if mirrored { -size } else { size })) * 10_f64.powi(size);
            let object = object::<f64>(orientation, scale);
            let position = as_double(object.relative_position(Vector3::of(normal)));
            let matrix = glam::DMat4::from_scale_rotation_translation(scale, orientation, DVec3::new(3.0, -2.0, 1.0));
            prop_assert!(position.distance(matrix.transform_point3(normal)) < 1e-12 * (1.0 + scale.abs().max_element()));
            let turned = as_double(object.world_normal(Vector3::of(normal)));
            prop_assert!(turned.distance((orientation * (normal / scale)).normalize()) < 1e-12);
        }

        /// Each of the four sums has three additions, so every product is rounded four times at most.
        #[test]
        fn clip_space_in_f32_is_that_of_f64(position in prop::array::uniform3(-1e3..1e3_f32)) {
            for view in views() {
                let [single, double] = [view_values::<f32>(&view).clip_position(Vector3::of_single(position.into())).0.map(f64::from),
                    view_values::<f64>(&view).clip_position(Vector3::of_single(position.into())).0];
                let columns = view.clip_from_relative().to_cols_array_2d().map(|column| column.map(|value| f64::from(value.abs())));
                for row in 0..4 {
                    let sizes: f64 = (0..3).map(|axis| columns[axis][row] * f64::from(position[axis].abs())).sum();
                    prop_assert!((single[row] - double[row]).abs() <= 4.001 * UNIT * (sizes + columns[3][row]));
                }
            }
        }

        #[test]
        fn position_from_depth_inverts_clip_position(pixel in prop::array::uniform2(-1.0..1.0_f64), depth in 0.01..1.0_f64) {
            for view in views() {
                let view = view_values::<f64>(&view);
                let relative = view.position_from_depth(Vector(pixel), depth);
                let [x, y, z, w] = view.clip_position(relative).0;
                if !w.is_finite() {
                    // Beyond what an oblique near plane leaves at infinity.
                    continue;
                }
                prop_assert!(w > 0.0);
                // The views' matrices are of f32.
                let found = DVec3::new(x, y, z) / w;
                prop_assert!(found.distance(DVec2::from(pixel).extend(depth)) < 1e-5, "{found} {pixel:?} {depth}");
            }
        }

        /// A position at an angle of θ from the axis is mapped to tan(θ/2) from the centre.
        #[test]
        fn a_paraboloid_maps_an_angle_to_the_tangent_of_its_half(angle in 0.0..1.9_f64, around in -3.0..3.0_f64, distance in 0.2..9.0_f64) {
            let camera = paraboloid();
            let view = view_values::<f64>(&RenderView::new(&camera));
            let [right, up] = [view.right, view.up].map(as_double);
            let across = right * around.cos() + up * around.sin();
            let position = (as_double(view.forward) * angle.cos() + across * angle.sin()) * distance;
            let [x, y, z, w] = view.clip_position(Vector3::of(position)).0;
            let expected = DVec2::from_angle(around) * (angle / 2.0).tan();
            prop_assert!(DVec2::new(x, y).distance(expected) < 1e-6);
            let depth = (f64::from(camera.far) - distance) / f64::from(camera.far - camera.near);
            prop_assert!((z - depth).abs() < 1e-6 && w == 1.0);
        }

        /// A half float from 0.5 to 1 is up to 2⁻¹² off; smaller ones are nearer, which is left out here.
        #[test]
        fn decoded_normals_are_within_their_formats_bound(normal in direction()) {
            let point = octahedral_from_direction(Vector3::<f64>::of(normal));
            let steps = |count: f64| point.map(|value| ((value * 0.5 + 0.5) * count).round() / count * 2.0 - 1.0);
            let half = point.map(|value| (value * 2048.0).round() / 2048.0);
            for (stored, bound) in [
                (steps(255.0), NormalFormat::Octahedral8.max_error_degrees()),
                (steps(1023.0), NormalFormat::Octahedral10.max_error_degrees()),
                (steps(65535.0), NormalFormat::Octahedral16.max_error_degrees()),
                (half, NormalFormat::HalfFloat.max_error_degrees()),
            ] {
                let found = as_double(direction_from_octahedral(stored));
                prop_assert!((found.length() - 1.0).abs() < 1e-12);
                prop_assert!(angle(found, normal) <= bound, "{} {bound}", angle(found, normal));
            }
        }

        /// The sum of three numbers rounds twice and the quotient once, so the point is off by 3.001u of each
        /// coordinate a and b, where a + b ≤ 1. Folded and unfolded, which rounds once each, that is 3u·a + 2u, and the
        /// third coordinate is off by 7u. Where it is so near to 0 that it gets the wrong sign, the others are off by
        /// 6u + 3u·a; that is most: 11.9u in all. The octahedron is 1/√3 from its middle at least, so the direction is
        /// 20.6u off. Bringing it to unit length adds
        /// 4.5u.
        #[test]
        fn octahedral_in_f32_is_that_of_f64(normal in direction()) {
            let there = octahedral_from_direction(Vector3::<f32>::of(normal));
            let back = as_double(direction_from_octahedral(there));
            let [x, y, z] = normal.to_array().map(|value| f64::from(value as f32));
            prop_assert!(back.distance(DVec3::new(x, y, z).normalize()) <= 26.0 * UNIT);
        }
    }

    #[test]
    fn a_depth_of_zero_is_infinitely_far_away_in_perspective() {
        for view in views().into_iter().filter(|view| matches!(view.camera.projection, Projection::Perspective { .. }))
        {
            let view = view_values::<f64>(&view);
            let relative = as_double(view.position_from_depth(Vector([0.3, -0.4]), 0.0));
            // All of them look along -Z.
            assert!(relative.length() > 1e30 && relative.z < 0.0, "{relative}");
        }
    }

    #[test]
    fn positions_behind_a_paraboloid_are_clipped() {
        let view = view_values::<f32>(&RenderView::new(&paraboloid()));
        let behind = view.clip_position(-view.forward * 2.0);
        assert_eq!(behind[2], -1.0);
        // The light's own position has no direction.
        assert!(view.clip_position(Vector::zero()).0.iter().all(|value| value.is_finite()));
    }

    #[test]
    fn a_normal_of_length_zero_stays_zero_and_flat_objects_have_normals() {
        let flat = object::<f32>(DQuat::IDENTITY, DVec3::new(2.0, 0.0, 3.0));
        assert_eq!(flat.world_normal(Vector([0.6, 0.8, 0.0])), Vector([0.0, 1.0, 0.0]));
        let nothing = object::<f32>(DQuat::IDENTITY, DVec3::ZERO);
        assert_eq!(nothing.world_normal(Vector([0.0, 0.0, 1.0])), Vector([0.0, 0.0, 1.0]));
        let huge = object::<f32>(DQuat::IDENTITY, DVec3::new(1e20, -1e20, 1e20));
        assert_eq!(huge.world_normal(Vector([0.0, 1.0, 0.0])), Vector([0.0, -1.0, 0.0]));
        assert_eq!(flat.world_normal(Vector::zero()), Vector::zero());
        let view = view_values::<f32>(&views()[0]);
        assert_eq!(view.direction_to_eye(Vector::zero()), Vector::zero());
        assert_eq!(view.direction_to_eye(Vector3::of_single(Vec3::NEG_Z * 4.0)), Vector([0.0, 0.0, 1.0]));
    }
}
