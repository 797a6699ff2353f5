//! Cameras.

use glam::{DMat3, DQuat, DVec3, Quat, Vec2};

use super::projection::MAX_SHIFT;
use super::transform::is_unit;
use super::{ClipPlane, LayerMask, Projection, Redraw, SceneError, ViewFilter, ViewKind, WholePicture};

/// A camera. In camera space, −Z is forward, +Y is up and +X is to the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The name of the camera and of its view, in reports and for views that
    /// [read](crate::process::Declare::samples_view) its targets.
    pub name: String,
    /// In the world, in metres.
    pub position: DVec3,
    /// From camera space to the world; of unit length.
    pub orientation: Quat,
    /// How positions are projected onto the picture.
    pub projection: Projection,
    /// How far the picture's centre is to the right of the view direction, and above it, in halves of the picture's
    /// width and height: the lens shift of an off-centre frustum. 0 for most cameras, and always without perspective.
    /// [`Camera::tile`] and [`Camera::jittered`] set it.
    pub shift: Vec2,
    /// The picture of which it draws a part; `None` if it draws a whole one. [`Camera::tile`] and [`Camera::jittered`]
    /// set it.
    pub whole: Option<WholePicture>,
    /// Only what is in front of this plane is drawn: an oblique near plane. `None` for most cameras, and always without
    /// perspective.
    pub clip_plane: Option<ClipPlane>,
    /// The distance of the near plane, in metres, 1e-27 or more.
    pub near: f32,
    /// The distance of the far plane, in metres. In perspective it may be infinite, depth does not depend on it, and
    /// only objects that are entirely beyond it are culled.
    pub far: f32,
    /// Width and height of the picture, in pixels.
    pub size: [u32; 2],
    /// Multiplies [`Quality::level_of_detail`](crate::quality::Quality::level_of_detail) in this camera's view: 1 for
    /// most cameras, more where coarser objects will do, and 0 for full detail. Finite, and not negative.
    pub level_of_detail_scale: f32,
    /// Only objects that belong to one of these layers are drawn, whichever process draws them: all but the mirror in
    /// its own reflection, or all but what only another player sees.
    pub layers: LayerMask,
    /// Only objects that it lets pass are drawn, of those in the layers: by a list of objects, and by their materials.
    pub filter: ViewFilter,
    /// Whether processes [sample other views](crate::process::Declare::samples_view) in this one. Without it, what
    /// shows another view looks as if the frame did not have that: in the faces of a cube map, say, so that a ball may
    /// show a screen's surroundings and the screen the ball. What views held [in the frame
    /// before](crate::process::Declare::samples_view_previous) is shown all the same.
    pub samples_views: bool,
    /// The purpose of the picture, which determines the render processes that draw it.
    pub kind: ViewKind,
    /// How often the picture is drawn. Between redraws, what it shows is as old as the latest one.
    pub redraw: Redraw,
}

impl Camera {
    /// A camera at `position` that looks at `target`, upright (+Y), with a vertical field of view of 60°, a near plane
    /// at 5 cm and a picture of 960 × 540 pixels.
    pub fn looking_at(name: impl Into<String>, position: DVec3, target: DVec3) -> Self {
        let offset = target - position;
        // Squares of the offset itself could leave the range of f64. If it is 0 or not finite, the quotient is NaN.
        let forward = (offset / offset.abs().max_element()).normalize_or(DVec3::NEG_Z);
        let aside = forward.cross(DVec3::Y);
        // Looking straight up or down, any perpendicular serves as the right vector.
        let right = if aside.length_squared() > MIN_ASIDE_SQUARED { aside.normalize() } else { DVec3::X };
        let axes = DMat3::from_cols(right, right.cross(forward), -forward);
        Self {
            name: name.into(),
            position,
            orientation: DQuat::from_mat3(&axes).normalize().as_quat(),
            projection: Projection::Perspective { field_of_view: 60_f32.to_radians() },
            shift: Vec2::ZERO,
            whole: None,
            clip_plane: None,
            near: 0.05,
            far: f32::INFINITY,
            size: [960, 540],
            level_of_detail_scale: 1.0,
            layers: LayerMask::ALL,
            filter: ViewFilter::ALL,
            samples_views: true,
            kind: ViewKind::Main,
            redraw: Redraw::EveryFrame,
        }
    }

    /// The name of a view that only this camera's view reads, as
    /// [`Declare::samples_view`](crate::process::Declare::samples_view) says: `main/mirror` for the view `mirror` of
    /// the camera `main`.
    pub fn child_name(&self, view: &str) -> String {
        child_name(&self.name, view)
    }

    /// Width ÷ height of the picture.
    pub fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// Whether what is in front of the near plane is drawn as if it were on it.
    pub(crate) fn clamps_depth(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. }) && self.kind.rules().clamps_depth
    }

    /// The whole of this picture.
    pub(super) fn as_whole(&self) -> WholePicture {
        let (projection, shift, position) = (self.projection, self.shift, self.position);
        self.whole.unwrap_or(WholePicture { projection, shift, position })
    }

    /// The picture of which it draws a part, unless it sees more than that, by more than the pixel of a jitter.
    pub(crate) fn whole_picture(&self) -> Option<WholePicture> {
        let whole = self.whole?;
        let is_part = match (self.projection, whole.projection) {
            (Projection::Perspective { .. }, Projection::Perspective { .. }) => {
                self.projection.half_height() <= whole.projection.half_height() * (1.0 + 1e-6)
            }
            (Projection::Orthographic { height }, Projection::Orthographic { height: of_whole }) => {
                let aside = self.orientation.as_dquat().normalize().inverse() * (self.position - whole.position);
                let pixel = f64::from(height) / f64::from(self.size[1]);
                let room = (f64::from(of_whole) - f64::from(height)) * 0.5;
                let room = DVec3::new(room * f64::from(self.aspect()), room, 0.0) + pixel;
                aside.abs().cmple(room).all()
            }
            _ => false,
        };
        is_part.then_some(whole)
    }

    /// Checks all fields but `size`: a size of 0 × 0, as of a minimised window, has an error of its own,
    /// `FrameError::EmptyTarget`.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let reason = if let Some(reason) = self.pose_problem() {
            reason
        } else if !(self.near > 0.0 && self.near.is_finite()) {
            "its near plane is not a positive distance"
        } else if self.near < MIN_NEAR {
            "its near plane is nearer than 1e-27 m"
        } else if self.far.is_nan() || self.far <= self.near {
            "its far plane is not beyond its near plane"
        } else if !self.shift.is_finite() || self.shift.abs().max_element() > MAX_SHIFT {
            "its shift is not between -65536 and 65536"
        } else if let Some(reason) = self.whole.and_then(|whole| whole.problem()) {
            reason
        } else if !(self.level_of_detail_scale >= 0.0 && self.level_of_detail_scale.is_finite()) {
            "its level_of_detail_scale is negative or not finite"
        } else if let Some(reason) = self.clip_plane.and_then(|plane| plane.problem()) {
            reason
        } else if self.redraw == Redraw::Interval(0) {
            "it is redrawn every 0 frames"
        } else if let Some(reason) = self.projection_problem() {
            reason
        } else {
            return Ok(());
        };
        Err(SceneError::InvalidCamera { camera: self.name.clone(), reason })
    }

    /// What is wrong with its position or orientation; `None` if nothing is.
    fn pose_problem(&self) -> Option<&'static str> {
        if !self.position.is_finite() {
            Some("its position is not finite")
        } else if !is_unit(self.orientation.length_squared()) {
            Some("its orientation is not of unit length")
        } else {
            None
        }
    }

    fn projection_problem(&self) -> Option<&'static str> {
        let is_in_range = self.projection.is_in_range();
        match self.projection {
            Projection::Perspective { .. } => {
                (!is_in_range).then_some("its field of view is not between 0.0001 and 180 degrees")
            }
            _ if self.far.is_infinite() => Some("without perspective its far plane must be finite"),
            _ if self.shift != Vec2::ZERO => Some("without perspective it can have no shift"),
            _ if self.clip_plane.is_some() => Some("without perspective it can have no clip plane"),
            Projection::Orthographic { .. } => {
                (!is_in_range).then_some("its height is not a distance of 1e-6 m or more")
            }
            Projection::Paraboloid => {
                (!self.kind.rules().allows_paraboloid).then_some("only a shadow view can use a paraboloid projection")
            }
        }
    }
}

/// See [`Camera::child_name`].
pub(crate) fn child_name(parent: &str, view: &str) -> String {
    format!("{parent}/{view}")
}

/// The smallest distance of the near plane, in metres. Depth is `near` divided by distance, and the world is up to
/// 1.5e10 m across: with a near plane below 2e-28 m, depth would underflow in f32.
const MIN_NEAR: f32 = 1e-27;

/// The square of the smallest angle in radians, between the view direction and the vertical, at which the right vector
/// is that of the angle. The axes are perpendicular and of unit length up to the rounding of f64, also where the
/// fallback is used.
const MIN_ASIDE_SQUARED: f64 = 1e-32;
