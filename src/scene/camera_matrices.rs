//! Cameras that see what an engine's matrices show.

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Vec2};

use super::{Camera, Projection, SceneError};

impl Camera {
    /// A camera that sees what an engine's matrices show in a picture of this size, so that the engine's own draws are
    /// culled by what they show. `view` takes positions from the world to camera space, and may turn and move;
    /// `projection` takes them to wgpu's clip space, where depth is from 0 to 1. It may be with or without perspective,
    /// off centre, with depth forward or reversed, and with a far plane or, in perspective, without.
    ///
    /// Only what the matrices show is taken over: without perspective the camera may stand elsewhere.
    ///
    /// ```
    /// use drawloom::glam::DVec3;
    /// use drawloom::glam::dcamera::rh::{proj::directx, view};
    /// use drawloom::scene::{Camera, Projection};
    ///
    /// let view = view::look_at_mat4(DVec3::new(0.0, 2.0, 9.0), DVec3::ZERO, DVec3::Y);
    /// let projection = directx::perspective(1.2, 16.0 / 9.0, 0.1, 500.0);
    /// let camera = Camera::from_matrices("main", view, projection, [1280, 720])?;
    /// assert!(matches!(camera.projection, Projection::Perspective { field_of_view } if (field_of_view - 1.2).abs() < 1e-5));
    /// # Ok::<(), drawloom::scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// If the matrices do something else: mirror, scale, shear, or fit a picture of another aspect.
    pub fn from_matrices(
        name: impl Into<String>,
        view: DMat4,
        projection: DMat4,
        size: [u32; 2],
    ) -> Result<Self, SceneError> {
        let base = Self { size, ..Self::looking_at(name, DVec3::ZERO, DVec3::NEG_Z) };
        let camera = base.clone().placed_by(view).and_then(|camera| camera.projecting_by(projection));
        let camera = camera.map_err(|reason| SceneError::InvalidCamera { camera: base.name, reason })?;
        camera.check()?;
        Ok(camera)
    }

    /// It stands where a matrix from the world to camera space says.
    fn placed_by(mut self, view: DMat4) -> Result<Self, &'static str> {
        let axes = DMat3::from_mat4(view);
        let deviation = axes * axes.transpose() - DMat3::IDENTITY;
        if !view.is_finite() || view.row(3) != DVec4::W {
            return Err("its view matrix has a number that is not finite, or a perspective");
        }
        if deviation.to_cols_array().iter().any(|number| number.abs() > MAX_DEVIATION) {
            return Err("its view matrix scales or shears");
        }
        if axes.determinant() < 0.0 {
            return Err("its view matrix mirrors");
        }
        let to_world = axes.transpose();
        self.position = to_world * -view.w_axis.truncate();
        self.orientation = DQuat::from_mat3(&to_world).normalize().as_quat();
        Ok(self)
    }

    /// It projects as a matrix from camera space to clip space does.
    fn projecting_by(mut self, matrix: DMat4) -> Result<Self, &'static str> {
        let scale = DVec2::new(matrix.x_axis.x, matrix.y_axis.y);
        let is_perspective = matrix.z_axis.w != 0.0;
        let offset = if is_perspective { matrix.z_axis } else { matrix.w_axis };
        let expected = if is_perspective {
            [DVec4::X * scale.x, DVec4::Y * scale.y, offset.truncate().extend(-1.0), DVec4::Z * matrix.w_axis.z]
        } else {
            [DVec4::X * scale.x, DVec4::Y * scale.y, DVec4::Z * matrix.z_axis.z, offset.truncate().extend(1.0)]
        };
        if !matrix.is_finite() || matrix != DMat4::from_cols_slice(&expected.map(|axis| axis.to_array()).concat()) {
            return Err("its projection matrix turns or shears, looks along +Z, or has a number that is not finite");
        }
        if scale.min_element() <= 0.0 {
            return Err("its projection matrix mirrors");
        }
        let deviation = (scale.x * f64::from(self.aspect()) / scale.y - 1.0).abs();
        if deviation.is_nan() || deviation > MAX_ASPECT_DEVIATION {
            return Err("its projection matrix fits a picture of another aspect");
        }
        // Depth is a + b ÷ distance in perspective, and a + b × distance without; 0 is at one of the planes, 1 at the
        // other one.
        let planes = |a: f64, b: f64, distance: fn(f64, f64) -> f64| {
            let [at_zero, at_one] = [distance(-a, b), distance(1.0 - a, b)];
            if (b < 0.0) == is_perspective { [at_zero, at_one] } else { [at_one, at_zero] }
        };
        let [near, far] = if is_perspective {
            planes(-matrix.z_axis.z, matrix.w_axis.z, |depth, b| if depth == 0.0 { f64::INFINITY } else { b / depth })
        } else {
            planes(matrix.w_axis.z, -matrix.z_axis.z, |depth, b| depth / b)
        };
        if is_perspective {
            self.projection = Projection::Perspective { field_of_view: (2.0 * scale.y.recip().atan()) as f32 };
            self.shift = Vec2::new(offset.x as f32, offset.y as f32);
            (self.near, self.far) = (near as f32, far as f32);
        } else {
            // The near plane may be behind the engine's camera, and the picture beside it.
            let back = (MIN_NEAR_OF_PARALLEL * (far - near) - near).max(0.0);
            let aside = DVec3::new(-offset.x / scale.x, -offset.y / scale.y, back);
            self.position += self.orientation.as_dquat().normalize() * aside;
            self.projection = Projection::Orthographic { height: (2.0 / scale.y) as f32 };
            (self.near, self.far) = ((near + back) as f32, (far + back) as f32);
        }
        Ok(self)
    }
}

/// How much the product of two axes may deviate from that of perpendicular ones of unit length: matrices of f32 that were
/// multiplied a few times do by less.
const MAX_DEVIATION: f64 = 1e-4;

/// How much the aspect may deviate from the picture's: a picture of another size, in pixels, has it.
const MAX_ASPECT_DEVIATION: f64 = 1e-3;

/// The least distance of the near plane without perspective, by the depth of what is seen.
const MIN_NEAR_OF_PARALLEL: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use glam::camera::rh::proj::directx;
    use glam::dcamera;
    use proptest::prelude::*;

    use super::*;
    use crate::view::internal::Frustum;

    const SIZE: [u32; 2] = [800, 500];

    fn any_view() -> impl Strategy<Value = DMat4> {
        let number = || -50.0..50.0_f64;
        ((number(), number(), number()), (-3.0..3.0_f64, -1.5..1.5_f64, -3.0..3.0_f64)).prop_map(|(place, turn)| {
            let turn = DQuat::from_euler(glam::EulerRot::YXZ, turn.0, turn.1, turn.2);
            DMat4::from_rotation_translation(turn, DVec3::new(place.0, place.1, place.2)).inverse()
        })
    }

    fn any_projection() -> impl Strategy<Value = DMat4> {
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        (0..6, 0.2..2.5_f32, 0.05..2.0_f32, 1.0..200.0_f32, (-0.8..0.8_f32, -0.8..0.8_f32), -20.0..3.0_f32).prop_map(
            move |(kind, angle, near, depth, (x, y), before)| {
                let far = near + depth;
                let (half, first, last) = (angle * 10.0, before, before + depth);
                let matrix = match kind {
                    0 => directx::perspective(angle, aspect, near, far),
                    1 => directx::perspective_infinite(angle, aspect, near),
                    2 => directx::perspective_infinite_reverse(angle, aspect, near),
                    3 => directx::perspective(angle, aspect, far, near),
                    4 => directx::orthographic(-half * aspect, half * aspect, -half, half, first, last),
                    _ => directx::orthographic(
                        (x - 1.0) * half * aspect,
                        (x + 1.0) * half * aspect,
                        (y - 1.0) * half,
                        (y + 1.0) * half,
                        last,
                        first,
                    ),
                };
                let mut matrix = matrix;
                if kind < 4 {
                    // Off centre.
                    (matrix.z_axis.x, matrix.z_axis.y) = (x, y);
                }
                matrix.as_dmat4()
            },
        )
    }

    proptest! {
        #[test]
        fn a_camera_sees_the_points_that_the_matrices_show(
            view in any_view(),
            projection in any_projection(),
            points in prop::collection::vec(prop::array::uniform3(-60.0..60.0_f64), 200),
        ) {
            let camera = Camera::from_matrices("main", view, projection, SIZE).unwrap();
            let frustum = Frustum::new(&camera);
            for point in points.into_iter().map(DVec3::from_array) {
                let clip = projection * view * point.extend(1.0);
                let inside = [clip.w - clip.x.abs(), clip.w - clip.y.abs(), clip.z, clip.w - clip.z];
                // Points at an edge may be on either side, by the rounding of f32.
                let margin = 1e-3 * clip.abs().max_element().max(1.0);
                let depth_margin = 1e-5 * clip.w.abs().max(1.0);
                let least = inside[0].min(inside[1]) / margin;
                let least_depth = inside[2].min(inside[3]) / depth_margin;
                let is_seen = frustum.intersects_sphere(point, 0.0);
                if least > 1.0 && least_depth > 1.0 {
                    prop_assert!(is_seen, "{point}: {inside:?}, {camera:?}");
                }
                if least < -1.0 || least_depth < -1.0 {
                    prop_assert!(!is_seen, "{point}: {inside:?}, {camera:?}");
                }
            }
        }
    }

    #[test]
    fn matrices_that_a_camera_cannot_follow_are_refused_with_the_reason() {
        let view = dcamera::rh::view::look_at_mat4(DVec3::Z, DVec3::ZERO, DVec3::Y);
        let projection = dcamera::rh::proj::directx::perspective(1.0, 1.6, 0.1, 10.0);
        let mut sheared = projection;
        sheared.y_axis.x = 0.1;
        let scale = |x, y, z| DMat4::from_scale(DVec3::new(x, y, z));
        let cases = [
            (view * scale(2.0, 2.0, 2.0), projection, "its view matrix scales or shears"),
            (view * scale(-1.0, 1.0, 1.0), projection, "its view matrix mirrors"),
            (view * f64::NAN, projection, "its view matrix has a number that is not finite"),
            (projection, projection, "its view matrix has a number that is not finite, or a perspective"),
            (view, sheared, "its projection matrix turns or shears"),
            (view, dcamera::lh::proj::directx::perspective(1.0, 1.6, 0.1, 10.0), "looks along +Z"),
            (view, projection * view, "its projection matrix turns or shears"),
            (view, projection * f64::INFINITY, "its projection matrix turns or shears"),
            (view, scale(1.0, -1.0, 1.0) * projection, "its projection matrix mirrors"),
            (view, dcamera::rh::proj::directx::perspective(1.0, 1.0, 0.1, 10.0), "another aspect"),
            (view, dcamera::rh::proj::vulkan::perspective(1.0, 1.6, 0.1, 10.0), "its projection matrix mirrors"),
            (view, DMat4::ZERO, "its projection matrix turns or shears"),
            (view, dcamera::rh::proj::directx::perspective(1.0, 1.6, 5.0, 5.0), "not finite"),
        ];
        for (view, projection, expected) in cases {
            let error = Camera::from_matrices("main", view, projection, SIZE).unwrap_err().to_string();
            assert!(error.contains("main") && error.contains(expected), "{error}");
        }
        assert!(Camera::from_matrices("main", view, projection, [0, 0]).is_err());
    }
}
