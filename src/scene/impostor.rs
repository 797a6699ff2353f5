//! The cameras of impostors, and when their pictures are wrong by too much.

use std::f32::consts::PI;

use glam::DVec3;

use super::projection::MIN_FIELD_OF_VIEW;
use super::{Camera, Projection, ViewKind};

/// The error of a picture is known up to the rounding of its camera's f32, in radii.
const ROUNDING: f64 = 1e-6;

impl Camera {
    /// The camera whose picture an impostor shows: of what lies within `radius` metres around `center`, seen from this
    /// camera's position (M 10.1). What the impostor stands for belongs in the result's [layers](Camera::layers), and
    /// in no other camera's. The impostor is a square at `center` with the camera's orientation and a half-width of
    /// [`Camera::impostor_half_width`]; from this camera's position it looks as the original does.
    ///
    /// `before` is the result of an earlier frame. It is returned again, so that the view need not be drawn again,
    /// while it has the same name and side and what it shows is displaced, where it is, by at most about `radius` ·
    /// `max_angle` metres. This is the sum of three errors: this camera sees the original turned by up to `max_angle`
    /// radians against the picture, from another distance, or with another radius than the picture was drawn for. The
    /// picture of something very small or far away is wider than it, and what its camera rounds displaces it by up to
    /// two millionths of its distance: less than a hundredth of a pixel of this camera.
    ///
    /// The result [samples no views](Camera::samples_views). It is `None` if this camera is inside of the radius, where
    /// only the original looks right.
    pub fn impostor(
        &self,
        name: &str,
        (center, radius): (DVec3, f64),
        side: u32,
        before: Option<&Self>,
        max_angle: f64,
    ) -> Option<Self> {
        let distance = center.distance(self.position);
        if distance.is_nan() || distance <= radius {
            return None;
        }
        let is_close = |before: &&Self| {
            let is_same = before.name == name && before.size == [side; 2];
            is_same && self.impostor_error(before, (center, radius)) <= max_angle + ROUNDING
        };
        if let Some(before) = before.filter(is_close) {
            return Some(before.clone());
        }
        let field_of_view = sphere_field_of_view(distance, radius);
        Some(Self {
            projection: Projection::Perspective { field_of_view },
            near: (0.5 * (distance - radius)) as f32,
            size: [side; 2],
            samples_views: false,
            kind: ViewKind::Reflection,
            ..Self::looking_at(name, self.position, center)
        })
    }

    /// Half the width of the picture, in metres, at a distance in metres: of the square at the centre of what an
    /// [impostor](Camera::impostor) stands for.
    pub fn impostor_half_width(&self, center: DVec3) -> f64 {
        self.projection.half_height() * center.distance(self.position)
    }

    /// By how much the picture of `before` displaces what this camera sees within a radius around a centre, in radii.
    /// It is NaN or infinite if the picture shows something else.
    fn impostor_error(&self, before: &Self, (center, radius): (DVec3, f64)) -> f64 {
        let Projection::Perspective { field_of_view } = before.projection else { return f64::INFINITY };
        let [distance, drawn_from] = [self, before].map(|camera| center.distance(camera.position));
        if drawn_from <= radius {
            return f64::INFINITY;
        }
        let forward = before.orientation.as_dquat().normalize() * DVec3::NEG_Z;
        let turn = forward.angle_between(center - self.position);
        let [half_width, needed] = [field_of_view, sphere_field_of_view(drawn_from, radius)].map(half_sine);
        let size = (half_width / needed - 1.0).abs();
        // What lies x metres beside the centre and z metres before it is drawn at x · d / (d − z) on the square, seen
        // from a distance of d. Of two distances this differs by at most radius² / 2 · |d − d'| / ((d − radius) · (d' −
        // radius)), as x · z is at most radius² / 2.
        let perspective = 0.5 * radius * (distance - drawn_from).abs() / ((distance - radius) * (drawn_from - radius));
        turn + size + perspective
    }
}

/// The field of view, in radians, of the picture of a sphere from outside of it. Within the limits of a camera: the
/// picture of a very small or far sphere shows more than the sphere, and one from very close to it slightly less.
fn sphere_field_of_view(distance: f64, radius: f64) -> f32 {
    let exact = (2.0 * (radius / distance).asin()) as f32;
    // A radius that is negative or NaN leads to a field of view that no camera may have, of which the frame's error
    // tells.
    if exact >= 0.0 { exact.clamp(MIN_FIELD_OF_VIEW, PI.next_down()) } else { exact }
}

/// The sine of half an angle.
fn half_sine(angle: f32) -> f64 {
    (0.5 * f64::from(angle)).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTER: DVec3 = DVec3::new(2.0, 1.0, -3.0);
    const RADIUS: f64 = 1.5;
    const SIDE: u32 = 64;
    const MAX_ANGLE: f64 = 0.05;

    fn viewer(distance: f64) -> Camera {
        let position = CENTER + DVec3::new(0.6, 0.0, 0.8) * distance;
        Camera::looking_at("main", position, CENTER)
    }

    fn is_kept(viewer: &Camera, before: &Camera, sphere: (DVec3, f64), side: u32, max_angle: f64) -> bool {
        viewer.impostor("tree", sphere, side, Some(before), max_angle).unwrap() == *before
    }

    #[test]
    fn an_impostor_is_drawn_again_where_its_picture_is_wrong() {
        let (viewer_before, sphere) = (viewer(10.0), (CENTER, RADIUS));
        let before = viewer_before.impostor("tree", sphere, SIDE, None, MAX_ANGLE).unwrap();
        let kept_by = |viewer: &Camera| is_kept(viewer, &before, sphere, SIDE, MAX_ANGLE);
        assert!(is_kept(&viewer_before, &before, sphere, SIDE, 0.0));
        // From another direction.
        let around = |angle: f64| {
            let position = CENTER + glam::DQuat::from_rotation_y(angle) * (viewer_before.position - CENTER);
            Camera { position, ..viewer_before.clone() }
        };
        assert!(kept_by(&around(0.9 * MAX_ANGLE)) && !kept_by(&around(1.1 * MAX_ANGLE)));
        // From another distance: 0.5 · 1.5 · |d − 10| / (8.5 · (d − 1.5)) is 0.05 at 6.93 m and at 21.12 m.
        assert!([7.0, 9.0, 21.0].iter().all(|distance| kept_by(&viewer(*distance))));
        assert!([2.0, 6.8, 21.3, 100.0].iter().all(|distance| !kept_by(&viewer(*distance))));
        // Both errors add up.
        assert!(!kept_by(&Camera { position: CENTER + (around(0.04).position - CENTER) * 1.15, ..viewer(1.0) }));
        // Another radius, another side, another name, and another place.
        let kept_with = |sphere, side| is_kept(&viewer_before, &before, sphere, side, MAX_ANGLE);
        assert!(kept_with((CENTER, RADIUS * 1.02), SIDE));
        assert!(!kept_with((CENTER, RADIUS * 1.1), SIDE) && !kept_with((CENTER, RADIUS * 0.9), SIDE));
        assert!(!kept_with(sphere, SIDE * 2));
        assert_eq!(viewer_before.impostor("other", sphere, SIDE, Some(&before), MAX_ANGLE).unwrap().name, "other");
        let [near, far] = [0.3, 1.0].map(|offset| (CENTER + DVec3::Y * offset, RADIUS));
        assert!(kept_with(near, SIDE) && !kept_with(far, SIDE));
        // A camera of something else.
        let orthographic = Projection::Orthographic { height: 2.0 * RADIUS as f32 };
        let other = Camera { projection: orthographic, ..before.clone() };
        assert!(!is_kept(&viewer_before, &other, sphere, SIDE, f64::MAX));
        // What the engine changes in the result stays.
        let changed = Camera { redraw: crate::scene::Redraw::OnCameraChange, ..before.clone() };
        assert!(is_kept(&viewer_before, &changed, sphere, SIDE, MAX_ANGLE));
    }
}
