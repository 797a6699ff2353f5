//! Chooses where a camera stands and where it looks.

use std::f32::consts::TAU;

use drawloom::glam::{Quat, Vec3};

use super::bvh::{Bvh, Hit};

/// A viewpoint, in the normalised coordinates of [`Bvh`].
pub(super) struct Viewpoint {
    pub eye: Vec3,
    pub target: Vec3,
    /// In radians.
    pub field_of_view: f32,
}

/// A scene may be an interior if from some point inside the bounds at least this share of rays in all directions hits
/// front faces.
const INTERIOR_SHARE: f32 = 0.6;

/// A scene is an object, even a hollow one, if of the rays from outside inwards that hit anything at least this share
/// hits front faces.
const OBJECT_SHARE: f32 = 0.5;

/// The number of rays from a point.
const RAYS: usize = 256;

/// The field of view outside, in degrees.
const OUTSIDE_FIELD_OF_VIEW: f32 = 45.0;
/// The field of view inside, where walls are near, in degrees.
const INSIDE_FIELD_OF_VIEW: f32 = 65.0;

/// The aspect ratio (width ÷ height) that a view from outside fits.
const ASPECT: f32 = 16.0 / 9.0;

pub(super) fn choose(bvh: &Bvh) -> Viewpoint {
    if front_share_from_outside(bvh) >= OBJECT_SHARE {
        return object(bvh);
    }
    let points = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y];
    let around = points.map(|side| RayProbe::cast(bvh, side * bvh.half_size * 0.3));
    // A point within an object, or outside, says nothing about the interior.
    let around: Vec<_> = around.into_iter().filter(|around| around.front_share >= INTERIOR_SHARE).collect();
    match open_side(&around) {
        _ if around.is_empty() => object(bvh),
        Some(side) => looking_in(bvh, side),
        None => inside(bvh).unwrap_or_else(|| object(bvh)),
    }
}

/// The share of front faces among all hits of rays from outside.
fn front_share_from_outside(bvh: &Bvh) -> f32 {
    let targets = || (0..8).map(|target| fibonacci_sphere(target, 8) * bvh.half_size * 0.7);
    let eyes = (0..RAYS).map(|eye| fibonacci_sphere(eye, RAYS) * 2.0);
    let rays = eyes.flat_map(|eye| targets().map(move |target| (eye, (target - eye).normalize())));
    let hits: Vec<_> = rays.filter_map(|(eye, direction)| bvh.cast(eye, direction)).collect();
    hits.iter().filter(|hit| hit.front_facing).count() as f32 / hits.len().max(1) as f32
}

/// The result of casting rays from a point in all directions.
struct RayProbe {
    /// The share of rays that hit front faces.
    front_share: f32,
    /// The sum of the directions of rays that hit nothing, divided by the number of all rays.
    open: Vec3,
    /// The share of rays that hit nothing.
    miss_share: f32,
}

impl RayProbe {
    fn cast(bvh: &Bvh, point: Vec3) -> Self {
        const SHARE: f32 = 1.0 / RAYS as f32;
        let mut around = Self { front_share: 0.0, open: Vec3::ZERO, miss_share: 0.0 };
        for direction in (0..RAYS).map(|ray| fibonacci_sphere(ray, RAYS)) {
            match bvh.cast(point, direction) {
                Some(hit) if hit.front_facing => around.front_share += SHARE,
                Some(_) => {}
                None => {
                    around.miss_share += SHARE;
                    around.open += direction * SHARE;
                }
            }
        }
        around
    }
}

/// The direction of a missing wall, if there is one: the rays that hit nothing point the same way, but not up, since a
/// courtyard is open there. A direction close to an axis becomes the axis.
fn open_side(probes: &[RayProbe]) -> Option<Vec3> {
    let miss_share: f32 = probes.iter().map(|probe| probe.miss_share).sum();
    let open: Vec3 = probes.iter().map(|probe| probe.open).sum();
    let side = open.try_normalize()?;
    if miss_share < 0.05 * probes.len() as f32 || open.length() < 0.7 * miss_share || side.y.abs() > 0.5 {
        return None;
    }
    let axes = Vec3::AXES.map(|axis| axis * side.dot(axis).signum());
    Some(axes.into_iter().find(|axis| side.dot(*axis) > 0.9).unwrap_or(side))
}

/// From outside through the open side, with the bounding box filling the picture.
fn looking_in(bvh: &Bvh, side: Vec3) -> Viewpoint {
    Viewpoint {
        eye: side * fitting_distance(bvh, side),
        target: Vec3::ZERO,
        field_of_view: OUTSIDE_FIELD_OF_VIEW.to_radians(),
    }
}

/// Another side than the usual one is chosen only if it shows this many times as much.
const CLEARLY_MORE: f32 = 1.15;

/// From outside and above, from the side that shows most.
fn object(bvh: &Bvh) -> Viewpoint {
    let points = bvh.surface_points(256);
    let seen_from = |side: Vec3| {
        let eye = side * fitting_distance(bvh, side);
        (eye, seen_share(bvh, eye, &points))
    };
    // All around, from as high as usual and from higher.
    let usual = Vec3::new(0.55, 0.4, 1.0).normalize();
    let mirrored = |side: Vec3| [side, Vec3::new(-side.x, side.y, side.z)];
    let sides = [usual, Vec3::new(0.55, 0.8, 1.0).normalize()].into_iter().flat_map(mirrored);
    let turned = |side: Vec3| (0..8).map(move |turn| Quat::from_rotation_y(turn as f32 / 8.0 * TAU) * side);
    let (usual, share) = seen_from(usual);
    let best = sides.flat_map(turned).map(seen_from).fold((usual, CLEARLY_MORE * share), |best, eye| {
        // Of sides that differ by rounding alone the first is taken.
        if eye.1 > 1.01 * best.1 { eye } else { best }
    });
    Viewpoint { eye: best.0, target: Vec3::ZERO, field_of_view: OUTSIDE_FIELD_OF_VIEW.to_radians() }
}

/// The share of points on the surface, with their normals, that are seen from their front. What is seen at more than
/// 60° from its normal counts less.
fn seen_share(bvh: &Bvh, eye: Vec3, points: &[(Vec3, Vec3)]) -> f32 {
    let seen = points.iter().map(|&(point, normal)| {
        let (direction, distance) = (point - eye).normalize_and_length();
        let facing = (-2.0 * direction.dot(normal.normalize_or_zero())).clamp(0.0, 1.0);
        let is_seen = facing > 0.0 && bvh.cast(eye, direction).is_none_or(|hit| hit.distance > distance * 0.999);
        if is_seen { facing } else { 0.0 }
    });
    seen.sum::<f32>() / points.len().max(1) as f32
}

/// The distance in direction `side` at which the whole bounding box is in the picture.
fn fitting_distance(bvh: &Bvh, side: Vec3) -> f32 {
    let slope = (OUTSIDE_FIELD_OF_VIEW.to_radians() / 2.0).tan();
    let right = Vec3::Y.cross(side).try_normalize().unwrap_or(Vec3::X);
    let up = side.cross(right);
    let corners = (0..8).map(|corner| {
        let sign = |bit: u32| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
        Vec3::new(sign(0), sign(1), sign(2)) * bvh.half_size
    });
    let distance = |corner: Vec3| {
        let (across, upward) = (corner.dot(right).abs() / ASPECT, corner.dot(up).abs());
        corner.dot(side) + across.max(upward) / slope
    };
    corners.map(distance).fold(0.0, f32::max) * 1.03
}

/// From eye height, along the longest free line of sight. `None` if no point is free.
fn inside(bvh: &Bvh) -> Option<Viewpoint> {
    const STEPS: i32 = 4;
    const DIRECTIONS: usize = 24;
    let mut best: Option<(f32, Viewpoint)> = None;
    for x in -STEPS..=STEPS {
        for z in -STEPS..=STEPS {
            // From a quarter of the height, to find the ground floor.
            let share = Vec3::new(x as f32, -0.5 * (STEPS as f32 + 0.5), z as f32) / (STEPS as f32 + 0.5);
            let Some(eye) = eye_above_floor(bvh, share * bvh.half_size) else {
                continue;
            };
            for turn in 0..DIRECTIONS {
                let forward = Vec3::from(horizontal(turn as f32 / DIRECTIONS as f32));
                let (score, free) = line_of_sight(bvh, eye, forward);
                if best.as_ref().is_none_or(|&(highest, _)| score > highest) {
                    let view = Viewpoint {
                        eye,
                        target: eye + forward * free,
                        field_of_view: INSIDE_FIELD_OF_VIEW.to_radians(),
                    };
                    best = Some((score, view));
                }
            }
        }
    }
    best.map(|(_, view)| view)
}

/// The point at eye height above the floor under `point`, if it is not within an object.
fn eye_above_floor(bvh: &Bvh, point: Vec3) -> Option<Vec3> {
    let reach = |direction, otherwise| match bvh.cast(point, direction) {
        Some(Hit { front_facing: false, .. }) => None,
        Some(hit) => Some(hit.distance),
        None => Some(otherwise),
    };
    let below = reach(Vec3::NEG_Y, bvh.half_size.y + point.y)?;
    let above = reach(Vec3::Y, bvh.half_size.y - point.y)?;
    let eye = point + Vec3::Y * (0.22 * (below + above) - below);
    // Nothing is close by.
    let clearance = 0.04;
    let is_clear = (0..8).all(|turn| {
        let direction = Vec3::from(horizontal(turn as f32 / 8.0));
        bvh.cast(eye, direction).is_none_or(|hit| hit.front_facing && hit.distance > clearance)
    });
    is_clear.then_some(eye)
}

/// The score of a view and its free distance. The score is the mean length of rays all over the picture; rays that
/// leave the scene or hit back faces count as short.
fn line_of_sight(bvh: &Bvh, eye: Vec3, forward: Vec3) -> (f32, f32) {
    let right = forward.cross(Vec3::Y);
    let mut sum = 0.0;
    for across in [-0.7, -0.35, -0.12, 0.0, 0.12, 0.35, 0.7] {
        for upward in [-0.3, 0.0, 0.3] {
            let direction = (forward + right * across + Vec3::Y * upward).normalize();
            sum += match bvh.cast(eye, direction) {
                Some(hit) if hit.front_facing => hit.distance,
                _ => 0.1,
            };
        }
    }
    let free = bvh.cast(eye, forward).map_or(1.0, |hit| hit.distance);
    (sum / 21.0, free)
}

/// A direction in the horizontal plane, at `share` of a full turn.
fn horizontal(share: f32) -> [f32; 3] {
    let (sine, cosine) = (share * TAU).sin_cos();
    [sine, 0.0, cosine]
}

/// Direction `number` of `count` that cover the sphere evenly: a spiral from pole to pole in steps of the golden angle.
fn fibonacci_sphere(number: usize, count: usize) -> Vec3 {
    let height = 1.0 - 2.0 * (number as f32 + 0.5) / count as f32;
    let (sine, cosine) = (number as f32 * TAU * 0.618_034).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    Vec3::new(radius * cosine, height, radius * sine)
}
