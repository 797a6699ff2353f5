//! Lights.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::SceneError;
use super::scene_ref::is_unit;

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
        /// Whether objects keep it from what is behind them.
        casts_shadow: bool,
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
        /// Whether objects keep it from what is behind them. A shadow map sees up to 85° from the axis; what the light reaches
        /// beyond that is lit.
        casts_shadow: bool,
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
        /// Whether objects keep it from what is behind them.
        casts_shadow: bool,
    },
}

impl Light {
    /// The range at which the brightest channel of `intensity` has fallen to 1/255: 16·√I.
    pub fn range_for(intensity: Vec3) -> f32 {
        16.0 * intensity.max_element().max(0.0).sqrt()
    }

    /// What kind of light it is.
    pub fn kind(&self) -> LightKind {
        match self {
            Self::Directional { .. } => LightKind::Directional,
            Self::Point { .. } => LightKind::Point,
            Self::Spot { .. } => LightKind::Spot,
            Self::Hemispherical { .. } => LightKind::Hemispherical,
        }
    }

    /// Whether objects keep it from what is behind them. Point lights cast no shadows.
    pub fn casts_shadow(&self) -> bool {
        match *self {
            Self::Directional { casts_shadow, .. }
            | Self::Spot { casts_shadow, .. }
            | Self::Hemispherical { casts_shadow, .. } => casts_shadow,
            Self::Point { .. } => false,
        }
    }

    /// A sphere that holds all that it reaches: its centre in the world and its radius, in metres. `None` for a directional
    /// light, which reaches everything.
    pub fn reach(&self) -> Option<(DVec3, f32)> {
        match *self {
            Self::Directional { .. } => None,
            Self::Point { position, range, .. }
            | Self::Spot { position, range, .. }
            | Self::Hemispherical { position, range, .. } => Some((position, range)),
        }
    }

    /// Whether it gives no light at all.
    pub(crate) fn is_dark(&self) -> bool {
        let (Self::Directional { illuminance: color, .. }
        | Self::Point { intensity: color, .. }
        | Self::Spot { intensity: color, .. }
        | Self::Hemispherical { intensity: color, .. }) = *self;
        color == Vec3::ZERO
    }

    /// Says what is wrong with it, if anything.
    pub(crate) fn check(&self, index: usize) -> Result<(), SceneError> {
        let problem = match *self {
            Self::Directional { direction, illuminance, .. } => {
                direction_problem(direction).or_else(|| color_problem(illuminance))
            }
            Self::Point { position, intensity, range } => {
                place_problem(position, range).or_else(|| color_problem(intensity))
            }
            Self::Spot { position, direction, intensity, range, inner_angle, outer_angle, .. } => {
                place_problem(position, range)
                    .or_else(|| color_problem(intensity))
                    .or_else(|| direction_problem(direction))
                    .or_else(|| cone_problem(inner_angle, outer_angle))
            }
            Self::Hemispherical { position, direction, intensity, range, .. } => place_problem(position, range)
                .or_else(|| color_problem(intensity))
                .or_else(|| direction_problem(direction)),
        };
        problem.map_or(Ok(()), |reason| Err(SceneError::InvalidLight { light: index, reason }))
    }
}

/// What kind a [`Light`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum LightKind {
    /// [`Light::Directional`].
    Directional,
    /// [`Light::Point`].
    Point,
    /// [`Light::Spot`].
    Spot,
    /// [`Light::Hemispherical`].
    Hemispherical,
}

impl LightKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Directional, Self::Point, Self::Spot, Self::Hemispherical];

    /// In small letters, as reports print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Directional => "directional",
            Self::Point => "point",
            Self::Spot => "spot",
            Self::Hemispherical => "hemispherical",
        }
    }
}

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
