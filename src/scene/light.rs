//! Lights.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::SceneError;
use super::transform::is_unit;

/// A light source. Colours are linear. Directions have unit length, are in world space, and point away from the light.
///
/// Lights with a position fall off with the square of the distance, and the factor (1 − (d/range)⁴)² brings them
/// smoothly to 0 at their `range`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// A light at infinity: its rays are parallel.
    Directional {
        /// The direction of the rays.
        direction: Vec3,
        /// The illuminance of a surface that faces the light, per channel.
        illuminance: Vec3,
        /// Whether objects cast shadows in this light.
        casts_shadow: bool,
    },
    /// Equal intensity in all directions.
    Point {
        /// In the world, in metres.
        position: DVec3,
        /// Illuminance at 1 m, per channel.
        intensity: Vec3,
        /// The distance at which the light ends, in metres.
        range: f32,
        /// Whether objects cast shadows in this light. Its shadow maps are the six faces of a cube, and each is a layer
        /// of the texture that all shadow maps of a frame share. A device allows 256 layers or more: 42 such lights
        /// whose range a camera sees. More are drawn without a shadow: see [`ShadowMaps`](crate::view::ShadowMaps).
        casts_shadow: bool,
    },
    /// A cone.
    Spot {
        /// In the world, in metres.
        position: DVec3,
        /// The cone's axis.
        direction: Vec3,
        /// Illuminance on the axis at 1 m, per channel.
        intensity: Vec3,
        /// The distance at which the light ends, in metres.
        range: f32,
        /// The angle from the axis at which the light begins to fade, in radians.
        inner_angle: f32,
        /// The angle from the axis at which the light ends, in radians, up to π/2.
        outer_angle: f32,
        /// Whether objects cast shadows in this light. A shadow map covers up to 85° from the axis; beyond that
        /// there are no shadows.
        casts_shadow: bool,
    },
    /// A small emissive surface that faces `direction`: intensity falls off with the cosine of the angle from the axis,
    /// and is 0 behind the surface (the light of L 4.2.2).
    Hemispherical {
        /// In the world, in metres.
        position: DVec3,
        /// The axis.
        direction: Vec3,
        /// Illuminance on the axis at 1 m, per channel.
        intensity: Vec3,
        /// The distance at which the light ends, in metres.
        range: f32,
        /// Whether objects cast shadows in this light.
        casts_shadow: bool,
    },
}

/// The position, direction, colour, range and angles of a light, by the kind of reference that `$light` is: what a kind
/// lacks is `None`.
macro_rules! fields_of {
    ($light:expr) => {
        match $light {
            Light::Directional { direction, illuminance, .. } => (None, Some(direction), illuminance, None, None),
            Light::Point { position, intensity, range, .. } => (Some(position), None, intensity, Some(range), None),
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, .. } => {
                (Some(position), Some(direction), intensity, Some(range), Some([inner_angle, outer_angle]))
            }
            Light::Hemispherical { position, direction, intensity, range, .. } => {
                (Some(position), Some(direction), intensity, Some(range), None)
            }
        }
    };
}

impl Light {
    /// The range at which the brightest channel of `intensity` has fallen to 1/255: 16·√I.
    pub fn range_for(intensity: Vec3) -> f32 {
        16.0 * intensity.max_element().max(0.0).sqrt()
    }

    /// The intensity or, of a directional light, the illuminance.
    pub fn color_mut(&mut self) -> &mut Vec3 {
        self.fields_mut().color
    }

    /// The sphere that the light reaches: its centre in the world and its radius, in metres. `None` for a directional
    /// light, which reaches everything.
    pub fn bounding_sphere(&self) -> Option<(DVec3, f32)> {
        let LightFields { position, range, .. } = self.fields();
        Some((*position?, *range?))
    }

    /// The light's fields, whatever its kind.
    #[inline]
    pub(crate) fn fields(&self) -> LightFields<'_> {
        let (position, direction, color, range, cone) = fields_of!(self);
        LightFields { position, direction, color, range, cone: cone.map(|angles| angles.map(|angle| *angle)) }
    }

    /// Those that can be changed whatever the kind.
    pub(crate) fn fields_mut(&mut self) -> LightFieldsMut<'_> {
        let (position, direction, color, range, _) = fields_of!(self);
        LightFieldsMut { position, direction, color, range }
    }

    /// The same light, but ending where the illuminance of its brightest channel has fallen to `cut_off`, if that is
    /// nearer than its range: see [`Quality::light_cut_off`](crate::quality::Quality::light_cut_off). A `cut_off` of 0
    /// changes nothing, and none changes a directional light, which does not fall off.
    pub(crate) fn cut_off_at(mut self, cut_off: f32) -> Self {
        if let LightFieldsMut { range: Some(range), color, .. } = self.fields_mut()
            && cut_off > 0.0
        {
            // No quotient of two f32 leaves the range of f64. The range of a light must not be 0.
            let end = (f64::from(color.max_element()) / f64::from(cut_off)).sqrt() as f32;
            *range = range.min(end.max(f32::MIN_POSITIVE));
        }
        self
    }

    /// Whether the light is black.
    pub(crate) fn is_dark(&self) -> bool {
        *self.fields().color == Vec3::ZERO
    }

    /// # Errors
    /// If a number is not finite or out of its range. `index` is the light's index in the scene, for the message.
    pub(crate) fn check(&self, index: usize) -> Result<(), SceneError> {
        let LightFields { position, direction, color, range, cone } = self.fields();
        let problem = position
            .zip(range)
            .and_then(|(position, range)| position_problem(*position, *range))
            .or_else(|| color_problem(*color))
            .or_else(|| direction_problem(*direction?))
            .or_else(|| cone_problem(cone?));
        problem.map_or(Ok(()), |reason| Err(SceneError::InvalidLight { light: index, reason }))
    }
}

/// The fields of a light of any kind; `None` where its kind has none.
pub(crate) struct LightFields<'a> {
    pub(crate) position: Option<&'a DVec3>,
    pub(crate) direction: Option<&'a Vec3>,
    /// The intensity, or the illuminance.
    pub(crate) color: &'a Vec3,
    pub(crate) range: Option<&'a f32>,
    /// The angles from the axis at which it begins to fade and at which it ends.
    pub(crate) cone: Option<[f32; 2]>,
}

/// See [`LightFields`].
pub(crate) struct LightFieldsMut<'a> {
    pub(crate) position: Option<&'a mut DVec3>,
    pub(crate) direction: Option<&'a mut Vec3>,
    pub(crate) color: &'a mut Vec3,
    pub(crate) range: Option<&'a mut f32>,
}

/// Defines the kinds of lights by the table of their properties: a row for each variant of [`Light`], in the order of
/// the light classes. A variant without a row does not compile.
macro_rules! light_kinds {
    ($($kind:ident: $volume:expr, $maps:expr, $name:literal;)+) => {
        /// The kind of a [`Light`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum LightKind {
            $(
                #[doc = concat!("[`Light::", stringify!($kind), "`].")]
                $kind,
            )+
        }

        impl LightKind {
            /// All kinds.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$kind),+];

            /// The properties of the kind.
            pub(crate) const fn rules(self) -> &'static LightRules {
                match self {
                    $(Self::$kind => &LightRules { name: $name, volume: $volume, maps: $maps },)+
                }
            }
        }

        impl Light {
            /// The kind of light.
            pub fn kind(&self) -> LightKind {
                match self {
                    $(Self::$kind { .. } => LightKind::$kind,)+
                }
            }

            /// Whether objects cast shadows in this light.
            pub fn casts_shadow(&self) -> bool {
                let ($(Self::$kind { casts_shadow, .. })|+) = self;
                *casts_shadow
            }

            /// Whether objects cast shadows in this light, to change that whatever its kind.
            pub fn casts_shadow_mut(&mut self) -> &mut bool {
                let ($(Self::$kind { casts_shadow, .. })|+) = self;
                casts_shadow
            }
        }
    };
}

light_kinds! {
    Directional: LightVolume::Screen, ShadowProjection::Cascades, "directional";
    Point: LightVolume::Sphere, ShadowProjection::Cube, "point";
    Spot: LightVolume::Cone, ShadowProjection::Perspective, "spot";
    Hemispherical: LightVolume::Cone, ShadowProjection::Paraboloid, "hemispherical";
}

impl LightKind {
    /// The lower-case name in reports.
    pub fn name(self) -> &'static str {
        self.rules().name
    }

    /// The shadow maps that lights of the kind have.
    pub fn shadow_projection(self) -> ShadowProjection {
        self.rules().maps
    }
}

/// The properties of a kind of light.
#[derive(Debug)]
pub(crate) struct LightRules {
    /// The lower-case name in reports. Shaders have a constant of that name, in upper case.
    pub(crate) name: &'static str,
    /// What is drawn to light the pixels that it reaches.
    pub(crate) volume: LightVolume,
    /// What shadow maps it has.
    pub(crate) maps: ShadowProjection,
}

impl LightRules {
    /// Whether it has a range. Otherwise it reaches everything, and each main camera has shadow maps of it.
    pub(crate) fn is_bounded(&self) -> bool {
        self.maps != ShadowProjection::Cascades
    }
}

/// The shadow maps that a light has: how many, and how they project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShadowProjection {
    /// Orthographic ones around what a main camera sees, one behind the other.
    Cascades,
    /// The six faces of a cube, in perspective.
    Cube,
    /// One in perspective, around the axis.
    Perspective,
    /// One paraboloid, around the axis.
    Paraboloid,
}

/// Geometry that contains all that a light can reach, so that only those pixels are lit: a sphere for a point light, a
/// cone for a spot light, and the screen for a light that reaches everywhere (L 4.2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum LightVolume {
    /// A polyhedron that contains the unit sphere, to be scaled by the light's range.
    Sphere,
    /// A cone of sixteen sides with a cylinder at its wide end, whose corners `cone_corner` positions. At 90° it is a
    /// cylinder with the range as its radius and height, which contains what a hemispherical light reaches too.
    Cone,
    /// One triangle that covers clip space.
    Screen,
}

fn direction_problem(direction: Vec3) -> Option<&'static str> {
    (!is_unit(direction.length_squared())).then_some("its direction is not of unit length")
}

fn color_problem(color: Vec3) -> Option<&'static str> {
    (!color.is_finite() || color.min_element() < 0.0)
        .then_some("its intensity or illuminance is negative or not finite")
}

fn position_problem(position: DVec3, range: f32) -> Option<&'static str> {
    if !position.is_finite() {
        Some("its position is not finite")
    } else if !(range > 0.0 && range.is_finite()) {
        Some("its range is not a positive distance")
    } else {
        None
    }
}

fn cone_problem([inner, outer]: [f32; 2]) -> Option<&'static str> {
    let ordered = inner >= 0.0 && inner < outer && outer <= FRAC_PI_2;
    // Shaders fade between the cosines, so these must differ.
    let distinct = inner.cos() > outer.cos();
    (!ordered || !distinct)
        .then_some("its cone's angles are not 0 <= inner < outer <= 90 degrees, or too close to fade")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The illuminance of a surface that faces the light on its axis: `illuminance_from` in `illumination.wgsl`, in
    /// f64.
    fn illuminance(intensity: f64, range: f64, distance: f64) -> f64 {
        if distance >= range {
            return 0.0;
        }
        let share = distance * distance / (range * range);
        intensity * (1.0 - share * share).powi(2) / (distance * distance)
    }

    fn lights(intensity: Vec3, range: f32) -> [Light; 3] {
        let (position, direction, casts_shadow) = (DVec3::ZERO, Vec3::X, false);
        let (inner_angle, outer_angle) = (0.2, 0.4);
        [
            Light::Point { position, intensity, range, casts_shadow },
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow },
            Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        /// Compares with the original light and with one without a range.
        #[test]
        fn the_error_of_a_cut_off_is_within_the_bound_of_quality(
            exponents in prop::array::uniform3(-6.0..6.0_f32),
            range in -3.0..6.0_f32,
            cut_off in -8.0..3.0_f32,
            share in prop_oneof![1e-3..2.0_f64, Just((2.0 / 3.0_f64).powf(0.25)), 0.99..1.01_f64],
        ) {
            let intensity = Vec3::from_array(exponents.map(|exponent| 10_f32.powf(exponent)));
            let (range, cut_off) = (10_f32.powf(range), 10_f32.powf(cut_off));
            let bound = 1.089 * f64::from(cut_off);
            for light in lights(intensity, range) {
                let (_, end) = light.cut_off_at(cut_off).bounding_sphere().unwrap();
                prop_assert!(end <= range);
                let distance = share * f64::from(end);
                for channel in intensity.to_array().map(f64::from) {
                    let cut = illuminance(channel, f64::from(end), distance);
                    let original = illuminance(channel, f64::from(range), distance);
                    prop_assert!(cut <= original * (1.0 + 1e-12) && original - cut <= bound, "{original} {cut}");
                    if end < range {
                        let untruncated = channel / (distance * distance);
                        prop_assert!(untruncated - cut <= bound, "{untruncated} {cut}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_light_ends_where_its_illuminance_has_fallen_to_the_cut_off() {
        for light in lights(Vec3::new(1.0, 9.0, 4.0), 100.0) {
            let reach = |cut_off| light.cut_off_at(cut_off).bounding_sphere().map(|(_, range)| range);
            assert_eq!(light.cut_off_at(0.0), light);
            assert_eq!([reach(1.0), reach(0.01), reach(1e-9)], [Some(3.0), Some(30.0), Some(100.0)]);
        }
        let sun = Light::Directional { direction: Vec3::X, illuminance: Vec3::ONE, casts_shadow: true };
        assert_eq!(sun.cut_off_at(0.5), sun);
    }

    #[test]
    fn a_light_stays_valid_after_any_cut_off() {
        let smallest = f32::from_bits(1);
        for intensity in [0.0, smallest, f32::MIN_POSITIVE, 1.0, f32::MAX] {
            for cut_off in [smallest, 1.0, f32::MAX] {
                for light in lights(Vec3::splat(intensity), 5.0) {
                    assert_eq!(light.cut_off_at(cut_off).check(0), Ok(()), "{intensity} {cut_off}");
                }
            }
        }
    }
}
