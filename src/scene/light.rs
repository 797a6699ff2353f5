//! Lights.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::scene_ref::is_unit;
use super::{Camera, SceneError, ViewKind};

/// A light. Colours are linear; directions are of unit length, in the world, the way the light travels.
///
/// Lights with a position fall off with the square of the distance, and are brought smoothly to 0 at their `range` by
/// the factor (1 − (d/range)⁴)².
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// So far away that its rays are parallel.
    Directional {
        /// The way it travels.
        direction: Vec3,
        /// On a surface that faces it, per channel.
        illuminance: Vec3,
    },
    /// The same in every direction.
    Point {
        /// In the world, in metres.
        position: DVec3,
        /// At 1 m, per channel.
        intensity: Vec3,
        /// Where it ends, in metres.
        range: f32,
    },
    /// A cone.
    Spot {
        /// In the world, in metres.
        position: DVec3,
        /// The cone's axis.
        direction: Vec3,
        /// On the axis at 1 m, per channel.
        intensity: Vec3,
        /// Where it ends, in metres.
        range: f32,
        /// Between the axis and where it begins to fade, in radians.
        inner_angle: f32,
        /// Between the axis and where it is gone, in radians, up to π/2.
        outer_angle: f32,
    },
    /// A small lit surface that faces `direction`: it falls off with the cosine from its axis, and nothing goes backwards
    /// (the light of L 4.2.2).
    Hemispherical {
        /// In the world, in metres.
        position: DVec3,
        /// The axis.
        direction: Vec3,
        /// On the axis at 1 m, per channel.
        intensity: Vec3,
        /// Where it ends, in metres.
        range: f32,
    },
}

impl Light {
    /// The range at which the brightest channel of `intensity` has fallen to 1/255: 16·√I.
    pub fn range_for(intensity: Vec3) -> f32 {
        16.0 * intensity.max_element().max(0.0).sqrt()
    }

    /// The camera of the light's shadow map, `side` pixels wide and high, to be added to a scene's cameras: a view for each
    /// light that is to cast shadows (M 10.4). It sees what the light reaches, from a thousandth of its range on.
    ///
    /// `None` for all but spot lights, whose light alone fits into a perspective picture; a cone of more than 170° is seen up
    /// to that.
    ///
    /// ```
    /// use drawloom::glam::{DVec3, Vec3};
    /// use drawloom::scene::{Light, Scene, ViewKind};
    ///
    /// let mut scene = Scene::new();
    /// let lamp = Light::Spot {
    ///     position: DVec3::Y * 4.0,
    ///     direction: Vec3::NEG_Y,
    ///     intensity: Vec3::splat(10.0),
    ///     range: 20.0,
    ///     inner_angle: 0.4,
    ///     outer_angle: 0.5,
    /// };
    /// scene.lights.push(lamp);
    /// scene.cameras.extend(lamp.shadow_camera("lamp", 1024));
    /// assert_eq!(scene.cameras[0].kind, ViewKind::Shadow);
    /// ```
    pub fn shadow_camera(&self, name: impl Into<String>, side: u32) -> Option<Camera> {
        let Self::Spot { position, direction, range, outer_angle, .. } = *self else { return None };
        let target = position + direction.as_dvec3();
        Some(Camera {
            field_of_view: (2.0 * outer_angle).min(WIDEST_SHADOW),
            near: range * 1e-3,
            size: [side; 2],
            kind: ViewKind::Shadow,
            ..Camera::looking_at(name, position, target)
        })
    }

    /// Says what is wrong with it, if anything.
    pub(crate) fn check(&self, index: usize) -> Result<(), SceneError> {
        let problem = match *self {
            Self::Directional { direction, illuminance } => {
                direction_problem(direction).or_else(|| color_problem(illuminance))
            }
            Self::Point { position, intensity, range } => {
                place_problem(position, range).or_else(|| color_problem(intensity))
            }
            Self::Spot { position, direction, intensity, range, inner_angle, outer_angle } => {
                place_problem(position, range)
                    .or_else(|| color_problem(intensity))
                    .or_else(|| direction_problem(direction))
                    .or_else(|| cone_problem(inner_angle, outer_angle))
            }
            Self::Hemispherical { position, direction, intensity, range } => place_problem(position, range)
                .or_else(|| color_problem(intensity))
                .or_else(|| direction_problem(direction)),
        };
        problem.map_or(Ok(()), |reason| Err(SceneError::InvalidLight { light: index, reason }))
    }
}

/// In radians. Towards 180° the middle of a perspective picture shrinks to nothing.
const WIDEST_SHADOW: f32 = 2.967;

fn direction_problem(direction: Vec3) -> Option<&'static str> {
    (!is_unit(direction.length_squared())).then_some("its direction is not of unit length")
}

fn color_problem(color: Vec3) -> Option<&'static str> {
    (!color.is_finite() || color.min_element() < 0.0).then_some("its intensity is negative or not finite")
}

fn place_problem(position: DVec3, range: f32) -> Option<&'static str> {
    if !position.is_finite() {
        Some("its position is not finite")
    } else if !(range > 0.0 && range.is_finite()) {
        Some("its range is not a positive distance")
    } else {
        None
    }
}

fn cone_problem(inner: f32, outer: f32) -> Option<&'static str> {
    let ordered = inner >= 0.0 && inner < outer && outer <= FRAC_PI_2;
    // Shaders fade between the cosines, which must differ.
    let distinct = inner.cos() > outer.cos();
    (!ordered || !distinct)
        .then_some("its cone's angles are not 0 <= inner < outer <= 90 degrees, or too close to fade")
}
