//! Where to look from.

use std::f32::consts::TAU;

use glam::Vec3;

use super::surfaces::{Hit, Surfaces};

/// A view, in the unit of [`Surfaces`].
pub(super) struct View {
    pub eye: Vec3,
    pub target: Vec3,
    /// In radians.
    pub field_of_view: f32,
}

/// The share of rays that must meet surfaces facing them, from some point inside, in a room.
const ROOM: f32 = 0.6;

/// The share of rays from outside that must meet surfaces facing them on an object, be it hollow.
const OBJECT: f32 = 0.5;

/// Rays that look around a point.
const RAYS: usize = 256;

/// From outside. Inside, where walls are near, it is wider.
const NARROW: f32 = 45.0;
const WIDE: f32 = 65.0;

/// Width ÷ height that a view is made to fit.
const ASPECT: f32 = 16.0 / 9.0;

pub(super) fn best(surfaces: &Surfaces) -> View {
    if faced_from_outside(surfaces) >= OBJECT {
        return object(surfaces);
    }
    let points = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y];
    let around = points.map(|side| Surroundings::at(surfaces, side * surfaces.half_size * 0.3));
    // A point within something, or outside, knows nothing of the room.
    let around: Vec<_> = around.into_iter().filter(|around| around.faced >= ROOM).collect();
    match open_side(&around) {
        _ if around.is_empty() => object(surfaces),
        Some(side) => looking_in(surfaces, side),
        None => inside(surfaces).unwrap_or_else(|| object(surfaces)),
    }
}

/// The share of rays from all around that meet surfaces facing them, of those that meet any.
fn faced_from_outside(surfaces: &Surfaces) -> f32 {
    let targets = || (0..8).map(|target| evenly_around(target, 8) * surfaces.half_size * 0.7);
    let eyes = (0..RAYS).map(|eye| evenly_around(eye, RAYS) * 2.0);
    let rays = eyes.flat_map(|eye| targets().map(move |target| (eye, (target - eye).normalize())));
    let hits: Vec<_> = rays.filter_map(|(eye, direction)| surfaces.cast(eye, direction)).collect();
    hits.iter().filter(|hit| hit.faces).count() as f32 / hits.len().max(1) as f32
}

/// What is around a point.
struct Surroundings {
    /// The share of rays that meet surfaces facing the point.
    faced: f32,
    /// The share that meets nothing, times their mean direction.
    open: Vec3,
    /// The share that meets nothing.
    missing: f32,
}

impl Surroundings {
    fn at(surfaces: &Surfaces, point: Vec3) -> Self {
        const SHARE: f32 = 1.0 / RAYS as f32;
        let mut around = Self { faced: 0.0, open: Vec3::ZERO, missing: 0.0 };
        for direction in (0..RAYS).map(|ray| evenly_around(ray, RAYS)) {
            match surfaces.cast(point, direction) {
                Some(hit) if hit.faces => around.faced += SHARE,
                Some(_) => {}
                None => {
                    around.missing += SHARE;
                    around.open += direction * SHARE;
                }
            }
        }
        around
    }
}

/// The side without a wall, if there is one: rays that meet nothing go one way, and not up, where a court is open too. A
/// slightly slanted side is an axis.
fn open_side(around: &[Surroundings]) -> Option<Vec3> {
    let missing: f32 = around.iter().map(|around| around.missing).sum();
    let open: Vec3 = around.iter().map(|around| around.open).sum();
    let side = open.try_normalize()?;
    if missing < 0.05 * around.len() as f32 || open.length() < 0.7 * missing || side.y.abs() > 0.5 {
        return None;
    }
    let axes = Vec3::AXES.map(|axis| axis * side.dot(axis).signum());
    Some(axes.into_iter().find(|axis| side.dot(*axis) > 0.9).unwrap_or(side))
}

/// From outside through the open side, the box filling the picture.
fn looking_in(surfaces: &Surfaces, side: Vec3) -> View {
    View { eye: side * fitting_distance(surfaces, side), target: Vec3::ZERO, field_of_view: NARROW.to_radians() }
}

/// From outside, a little above and to one side: the side from which most of what is seen faces the camera.
fn object(surfaces: &Surfaces) -> View {
    let eyes = [[0.55, 0.4, 1.0], [-0.55, 0.4, 1.0], [0.55, 0.4, -1.0], [-0.55, 0.4, -1.0]].map(|side| {
        let side = Vec3::from(side).normalize();
        side * fitting_distance(surfaces, side)
    });
    let shown = |eye: Vec3| {
        let targets = (0..64).map(|ray| evenly_around(ray, 64) * surfaces.half_size * 0.7);
        targets.filter(|&target| surfaces.cast(eye, (target - eye).normalize()).is_some_and(|hit| hit.faces)).count()
    };
    // The first one stays unless another shows clearly more.
    let eye = eyes[1..].iter().fold(eyes[0], |best, &eye| if shown(eye) > shown(best) * 5 / 4 { eye } else { best });
    View { eye, target: Vec3::ZERO, field_of_view: NARROW.to_radians() }
}

/// The distance in direction `side` at which the whole box is in the picture.
fn fitting_distance(surfaces: &Surfaces, side: Vec3) -> f32 {
    let slope = (NARROW.to_radians() / 2.0).tan();
    let right = Vec3::Y.cross(side).try_normalize().unwrap_or(Vec3::X);
    let up = side.cross(right);
    let corners = (0..8).map(|corner| {
        let sign = |bit: u32| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
        Vec3::new(sign(0), sign(1), sign(2)) * surfaces.half_size
    });
    let distance = |corner: Vec3| {
        let (across, upward) = (corner.dot(right).abs() / ASPECT, corner.dot(up).abs());
        corner.dot(side) + across.max(upward) / slope
    };
    corners.map(distance).fold(0.0, f32::max) * 1.03
}

/// From eye height, along the longest free line of sight. None if no point is free.
fn inside(surfaces: &Surfaces) -> Option<View> {
    const STEPS: i32 = 4;
    const DIRECTIONS: usize = 24;
    let mut best: Option<(f32, View)> = None;
    for x in -STEPS..=STEPS {
        for z in -STEPS..=STEPS {
            // From a quarter of the height, so that it is the ground floor that is found.
            let share = Vec3::new(x as f32, -0.5 * (STEPS as f32 + 0.5), z as f32) / (STEPS as f32 + 0.5);
            let Some(eye) = standing_at(surfaces, share * surfaces.half_size) else {
                continue;
            };
            for turn in 0..DIRECTIONS {
                let forward = Vec3::from(around(turn as f32 / DIRECTIONS as f32));
                let (score, free) = line_of_sight(surfaces, eye, forward);
                if best.as_ref().is_none_or(|&(highest, _)| score > highest) {
                    let view = View { eye, target: eye + forward * free, field_of_view: WIDE.to_radians() };
                    best = Some((score, view));
                }
            }
        }
    }
    best.map(|(_, view)| view)
}

/// Eye height above the floor under a point, if the point is not within something.
fn standing_at(surfaces: &Surfaces, point: Vec3) -> Option<Vec3> {
    let reach = |direction, otherwise| match surfaces.cast(point, direction) {
        Some(Hit { faces: false, .. }) => None,
        Some(hit) => Some(hit.distance),
        None => Some(otherwise),
    };
    let below = reach(Vec3::NEG_Y, surfaces.half_size.y + point.y)?;
    let above = reach(Vec3::Y, surfaces.half_size.y - point.y)?;
    let eye = point + Vec3::Y * (0.22 * (below + above) - below);
    // Room to stand: nothing close by.
    let clearance = 0.04;
    let is_clear = (0..8).all(|turn| {
        let direction = Vec3::from(around(turn as f32 / 8.0));
        surfaces.cast(eye, direction).is_none_or(|hit| hit.faces && hit.distance > clearance)
    });
    is_clear.then_some(eye)
}

/// How good a view is, and how far it goes: the mean length of rays all over the picture. One that leaves the scene shows
/// nothing, and one that meets the back of something had better not be there.
fn line_of_sight(surfaces: &Surfaces, eye: Vec3, forward: Vec3) -> (f32, f32) {
    let right = forward.cross(Vec3::Y);
    let mut sum = 0.0;
    for across in [-0.7, -0.35, -0.12, 0.0, 0.12, 0.35, 0.7] {
        for upward in [-0.3, 0.0, 0.3] {
            let direction = (forward + right * across + Vec3::Y * upward).normalize();
            sum += match surfaces.cast(eye, direction) {
                Some(hit) if hit.faces => hit.distance,
                _ => 0.1,
            };
        }
    }
    let free = surfaces.cast(eye, forward).map_or(1.0, |hit| hit.distance);
    (sum / 21.0, free)
}

/// A direction in the horizontal plane; `share` of a turn.
fn around(share: f32) -> [f32; 3] {
    let (sine, cosine) = (share * TAU).sin_cos();
    [sine, 0.0, cosine]
}

/// One of `count` directions that cover the sphere evenly: a spiral from pole to pole, a golden angle a step.
fn evenly_around(number: usize, count: usize) -> Vec3 {
    let height = 1.0 - 2.0 * (number as f32 + 0.5) / count as f32;
    let (sine, cosine) = (number as f32 * TAU * 0.618_034).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    Vec3::new(radius * cosine, height, radius * sine)
}
