//! How far off vertices are, over many of them.

use drawloom::scene::SceneError;
use drawloom::view::RenderView;

use super::cases::{Kind, Records, log_between, vertex_of};
use super::vertex::{is_seen, pixels_per_radian, record_of};
use crate::random::Random;

/// A distance from the world's origin, in metres.
#[derive(Clone, Copy, Debug)]
pub enum Origin {
    /// Just that.
    At(f64),
    /// The origin itself in one case of ten, and otherwise up to 10⁹ m, each power of ten as likely.
    Anywhere,
}

/// What was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    pub cases: usize,
    /// Pixels, of what shaders do.
    pub greatest: f64,
    pub mean: f64,
    /// The greatest error as an angle, in units of 2⁻²⁴ radians: see [`pixels_per_radian`]. Means nothing along parallel rays.
    pub greatest_angle: f64,
    /// Pixels, of absolute f32. What is lost altogether counts as the picture's diagonal.
    pub absolute_greatest: f64,
    pub absolute_mean: f64,
}

/// Tries so many vertices in views of a kind, and counts those that are seen.
///
/// # Errors
/// If an object cannot be.
pub fn measure(kind: Kind, origin: Origin, cases: usize, random: &mut Random) -> Result<Found, SceneError> {
    let mut records = Records::new()?;
    let mut found = Found::default();
    let (mut sum, mut absolute_sum) = (0.0, 0.0);
    for start in (0..cases).step_by(AT_ONCE) {
        let mut draw = || {
            let distance = match origin {
                Origin::At(distance) => distance,
                Origin::Anywhere if random.below(10) == 0 => 0.0,
                Origin::Anywhere => log_between(random, 1.0, 1e9),
            };
            let place = random.direction() * distance;
            vertex_of(kind.camera(place, random), random)
        };
        let some: Vec<_> = (start..cases.min(start + AT_ONCE)).map(|_| draw()).collect();
        records.visit(&some, |case, object| {
            if !is_seen(case) {
                return;
            }
            let view = RenderView::new(&case.camera);
            let truth = case.truth();
            let error = case.shaded(object, &record_of(&view)).distance(truth);
            // Not a number is more than any.
            let diagonal = f64::from(case.camera.size[0]).hypot(f64::from(case.camera.size[1]));
            let bounded = |error: f64| if error <= diagonal { error } else { diagonal };
            let (error, absolute) = (bounded(error), bounded(case.absolute(&view).distance(truth)));
            found.cases += 1;
            found.greatest = found.greatest.max(error);
            found.absolute_greatest = found.absolute_greatest.max(absolute);
            let angle = error / pixels_per_radian(&case.camera, case.eccentricity());
            found.greatest_angle = found.greatest_angle.max(angle / UNIT_ROUNDOFF);
            sum += error;
            absolute_sum += absolute;
        })?;
    }
    found.mean = sum / found.cases.max(1) as f64;
    found.absolute_mean = absolute_sum / found.cases.max(1) as f64;
    Ok(found)
}

/// 2⁻²⁴.
pub const UNIT_ROUNDOFF: f64 = 1.0 / (1_u32 << 24) as f64;

/// In pixels: what no vertex in a [`HELD`] view may be off by more than.
pub const BOUND: f64 = 1e-3;

/// The most that some thirty roundings, each at its worst and all of one sign, are as an angle: in units of 2⁻²⁴ radians. See
/// [`GpuView`](drawloom::view::GpuView).
pub const WORST_ANGLE: f64 = 30.0;

/// The views that keep within [`BOUND`].
pub const HELD: [Kind; 11] = [
    Kind::Perspective { degrees: 27.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 45.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 60.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 90.0, size: Kind::FULL_HD },
    Kind::Orthographic { heights: 2.5 },
    Kind::Spot { degrees: 12.0 },
    Kind::Spot { degrees: 45.0 },
    Kind::Spot { degrees: 68.0 },
    Kind::Directional { reach: 60.0 },
    Kind::Directional { reach: 1e6 },
    Kind::Hemispherical,
];

/// Views that magnify an angle too much for that: there the angle is held to [`WORST_ANGLE`].
pub const MAGNIFYING: [Kind; 10] = [
    Kind::Perspective { degrees: 0.1, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 1.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 10.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 120.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 150.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 179.0, size: Kind::FULL_HD },
    Kind::Perspective { degrees: 60.0, size: [16_384, 164] },
    Kind::Perspective { degrees: 60.0, size: [108, 10_800] },
    Kind::Spot { degrees: 2.0 },
    Kind::Spot { degrees: 85.0 },
];

const AT_ONCE: usize = 1000;
