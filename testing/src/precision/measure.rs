//! The errors of many vertices.

use std::error::Error;

use drawloom::view::RenderView;

use super::cases::{GpuObjects, Kind, log_between, vertex_of};
use super::vertex::{ShaderInput, VertexShader, gpu_view_of, is_visible, pixels_per_radian};
use crate::random::Random;

/// A distance from the world's origin, in metres.
#[derive(Clone, Copy, Debug)]
pub enum Origin {
    /// Exactly this distance.
    At(f64),
    /// Zero in one case of ten, and otherwise log-uniform up to 10⁹ m.
    Anywhere,
}

/// The measured errors.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    pub cases: usize,
    /// The greatest error of the shaders' computation, in pixels.
    pub greatest: f64,
    pub mean: f64,
    /// The greatest error as an angle, in units of 2⁻²⁴ radians: see [`pixels_per_radian`]. Meaningless for
    /// orthographic views.
    pub greatest_angle: f64,
    /// The greatest error of absolute f32 positions, in pixels. A lost vertex counts as the picture's diagonal.
    pub absolute_greatest: f64,
    pub absolute_mean: f64,
}

/// Measures the visible ones of `cases` vertices in views of one kind, as `shader` computes them.
///
/// # Errors
/// Returns an error if the scene rejects an object, or the shader's device fails.
pub fn measure(
    kind: Kind,
    origin: Origin,
    cases: usize,
    random: &mut Random,
    shader: &mut dyn VertexShader,
) -> Result<Errors, Box<dyn Error>> {
    let mut gpu_objects = GpuObjects::new()?;
    let mut errors = Errors::default();
    let (mut sum, mut absolute_sum) = (0.0, 0.0);
    for start in (0..cases).step_by(BATCH) {
        let mut draw = || {
            let distance = match origin {
                Origin::At(distance) => distance,
                Origin::Anywhere if random.below(10) == 0 => 0.0,
                Origin::Anywhere => log_between(random, 1.0, 1e9),
            };
            let position = random.direction() * distance;
            vertex_of(kind.camera(position, random), random)
        };
        let some: Vec<_> = (start..cases.min(start + BATCH)).map(|_| draw()).collect();
        let mut inputs = Vec::new();
        gpu_objects.visit(&some, |case, &object| {
            if is_visible(case) {
                inputs.push(ShaderInput { case, object, view: gpu_view_of(&RenderView::new(&case.camera)) });
            }
        })?;
        let clip_positions = shader.clip_positions(&inputs)?;
        for (ShaderInput { case, .. }, clip) in inputs.iter().zip(clip_positions) {
            let truth = case.truth();
            // NaN exceeds the diagonal.
            let diagonal = f64::from(case.camera.size[0]).hypot(f64::from(case.camera.size[1]));
            let bounded = |error: f64| if error <= diagonal { error } else { diagonal };
            let absolute = bounded(case.absolute(&RenderView::new(&case.camera)).distance(truth));
            let error = bounded(case.drawn_at(clip).distance(truth));
            errors.cases += 1;
            errors.greatest = errors.greatest.max(error);
            errors.absolute_greatest = errors.absolute_greatest.max(absolute);
            let angle = error / pixels_per_radian(&case.camera, case.eccentricity());
            errors.greatest_angle = errors.greatest_angle.max(angle / UNIT_ROUNDOFF);
            sum += error;
            absolute_sum += absolute;
        }
    }
    errors.mean = sum / errors.cases.max(1) as f64;
    errors.absolute_mean = absolute_sum / errors.cases.max(1) as f64;
    Ok(errors)
}

/// 2⁻²⁴.
pub const UNIT_ROUNDOFF: f64 = 1.0 / (1_u32 << 24) as f64;

/// The bound of a vertex's error in a [`BOUNDED`] view, in pixels.
pub const BOUND: f64 = 1e-3;

/// The angle of some thirty roundings in the worst case, all of one sign, in units of 2⁻²⁴ radians. See
/// [`GpuView`](drawloom::view::GpuView).
pub const WORST_ANGLE: f64 = 30.0;

/// The views with errors of at most [`BOUND`].
pub const BOUNDED: [Kind; 11] = [
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

/// Views that magnify angles too much for [`BOUND`]: their bound is [`WORST_ANGLE`].
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

const BATCH: usize = 1000;
