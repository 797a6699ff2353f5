//! Spheres that all but touch what a camera sees, and others anywhere.

use std::ops::Range;

use drawloom::view::{BoundingSphere, BoundingSpheres, Frustum};

use super::cameras::{any_camera, magnitude};
use super::naive::Naive;
use super::oracle::{Oracle, Verdict};
use super::tally::Tallies;
use crate::random::Random;

/// What was counted of this crate's test, and of the naive one where there is one for the camera.
#[derive(Clone, Copy, Debug, Default)]
pub struct SphereTallies {
    pub ours: Tallies,
    pub naive: Tallies,
}

impl SphereTallies {
    pub fn add(&mut self, other: &Self) {
        self.ours.add(&other.ours);
        self.naive.add(&other.naive);
    }
}

/// Tries one camera with [`BoundingSpheres::COUNT`] spheres for each number of `batches`.
pub fn try_batches(batches: Range<usize>) -> SphereTallies {
    let mut tallies = SphereTallies::default();
    let mut spheres = BoundingSpheres::default();
    for batch in batches {
        let mut random = Random::stream(batch as u64);
        let camera = any_camera(&mut random);
        let (oracle, frustum, naive) = (Oracle::new(&camera), Frustum::new(&camera), Naive::new(&camera));
        let mut cases = [(false, Verdict::Touching); BoundingSpheres::COUNT];
        for (entry, case) in cases.iter_mut().enumerate() {
            let is_tangent = entry % 4 != 0;
            let bounds = if is_tangent { tangent(&oracle, &mut random) } else { anywhere(&oracle, &mut random) };
            let radius = f64::from(bounds.radius);
            *case = (is_tangent, oracle.judge(oracle.relative(bounds.center), [radius; 6], radius));
            spheres.set(entry, bounds);
        }
        for first in (0..BoundingSpheres::COUNT).step_by(Frustum::WORD) {
            let seen = frustum.intersects_spheres(&spheres, first);
            for (place, &(is_tangent, verdict)) in cases[first..][..Frustum::WORD].iter().enumerate() {
                tallies.ours.of(is_tangent).count(verdict, seen >> place & 1 == 1);
            }
        }
        if let Some(naive) = naive {
            for (entry, &(is_tangent, verdict)) in cases.iter().enumerate() {
                let BoundingSphere { center, radius } = spheres.get(entry);
                tallies.naive.of(is_tangent).count(verdict, naive.sees_in_world(center, radius));
            }
        }
    }
    tallies
}

/// One that touches a plane, two at an edge or three at a corner, to within four steps of its radius or of its distance.
fn tangent(oracle: &Oracle, random: &mut Random) -> BoundingSphere {
    let radius = if random.below(16) == 0 { 0.0 } else { magnitude(random, -6.0, 7.0) };
    let place = oracle.touching(any_planes(random), [radius; 6], any_along(random), any_aside(random));
    let center = oracle.world(place);
    let depth = |center| oracle.depths(oracle.relative(center)).into_iter().fold(f64::INFINITY, f64::min);
    let steps = random.below(9) as i32 - 4;
    if random.below(2) == 0 {
        // Where another plane is farther inside than wanted, it is that one which the sphere touches.
        let mut radius = (-depth(center)).max(0.0) as f32;
        for _ in 0..steps.abs() {
            radius = if steps < 0 { radius.next_down().max(0.0) } else { radius.next_up() };
        }
        return BoundingSphere { center, radius };
    }
    let radius = (-depth(center)).max(0.0) as f32;
    let center = oracle.world(place * (1.0 + f64::from(steps) * f64::from(f32::EPSILON)));
    BoundingSphere { center, radius }
}

/// Up to 10,000 km away, and from a millionth of a metre to as large.
fn anywhere(oracle: &Oracle, random: &mut Random) -> BoundingSphere {
    let center = oracle.world(random.direction() * magnitude(random, -3.0, 7.0));
    BoundingSphere { center, radius: magnitude(random, -6.0, 7.0) as f32 }
}

/// One, two or three planes, no two of them opposite.
pub fn any_planes(random: &mut Random) -> [bool; 6] {
    loop {
        let mut asked = [false; 6];
        for pair in asked.as_chunks_mut::<2>().0 {
            match random.below(5) {
                0 | 1 => pair[0] = true,
                2 | 3 => pair[1] = true,
                _ => (),
            }
        }
        // The near and the far plane leave little to choose of the rest.
        if random.below(3) != 0 {
            asked[4..].fill(false);
        }
        if asked.contains(&true) {
            return asked;
        }
    }
}

/// How far along, in metres: up to a million kilometres, and sometimes behind.
pub fn any_along(random: &mut Random) -> f64 {
    let along = magnitude(random, -5.0, 9.0);
    if random.below(6) == 0 { -along } else { along }
}

/// How far aside, in shares of the picture.
pub fn any_aside(random: &mut Random) -> [f64; 2] {
    [(); 2].map(|()| random.between(-1.0, 1.0))
}
