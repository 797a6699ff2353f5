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
