//! Spheres that almost touch a frustum, and spheres anywhere.

use std::array;
use std::ops::Range;

use drawloom::view::BoundingSphere;
use drawloom::view::internal::{BoundingSpheres, Frustum, VisibleSet};

use super::cameras::{any_camera, magnitude};
use super::lanes::SphereArrays;
use super::naive::Naive;
use super::oracle::{Classification, Oracle};
use super::tally::Tallies;
use crate::random::Random;

/// The tallies of this crate's test, and of the naive one for cameras that it supports: one by one, and many at a time.
#[derive(Clone, Copy, Debug, Default)]
pub struct SphereTallies {
    pub drawloom: Tallies,
    pub naive: Tallies,
    pub lanes: Tallies,
}

impl SphereTallies {
    pub fn add(&mut self, other: &Self) {
        self.drawloom.add(&other.drawloom);
        self.naive.add(&other.naive);
        self.lanes.add(&other.lanes);
    }
}

/// Tests [`BoundingSpheres::COUNT`] spheres with one camera for each batch.
pub fn try_batches(batches: Range<usize>) -> SphereTallies {
    let mut tallies = SphereTallies::default();
    let mut spheres = BoundingSpheres::default();
    for batch in batches {
        let mut random = Random::stream(batch as u64);
        let camera = any_camera(&mut random);
        let (oracle, frustum, naive) = (Oracle::new(&camera), Frustum::new(&camera), Naive::new(&camera));
        let mut cases = [(false, Classification::Touching); BoundingSpheres::COUNT];
        for (entry, case) in cases.iter_mut().enumerate() {
            let is_tangent = entry % 4 != 0;
            let bounds = if is_tangent { tangent(&oracle, &mut random) } else { anywhere(&oracle, &mut random) };
            let radius = f64::from(bounds.radius);
            *case = (is_tangent, oracle.classify(oracle.relative(bounds.center), [radius; 6], radius));
            spheres.set(entry, bounds);
        }
        for first in (0..BoundingSpheres::COUNT).step_by(VisibleSet::OBJECTS_PER_WORD) {
            let visible = frustum.intersects_spheres(&spheres, first);
            for (bit, &(is_tangent, classification)) in
                cases[first..][..VisibleSet::OBJECTS_PER_WORD].iter().enumerate()
            {
                tallies.drawloom.of(is_tangent).count(classification, visible >> bit & 1 == 1);
            }
        }
        if let Some(naive) = naive {
            let in_world: [_; BoundingSpheres::COUNT] = array::from_fn(|entry| {
                let BoundingSphere { center, radius } = spheres.get(entry);
                (center.as_vec3(), radius)
            });
            let mut words = [0; BoundingSpheres::COUNT / VisibleSet::OBJECTS_PER_WORD];
            SphereArrays::new(&in_world).visible(&naive, &mut words, f32::mul_add);
            for (entry, (&(is_tangent, classification), (center, radius))) in cases.iter().zip(in_world).enumerate() {
                tallies.naive.of(is_tangent).count(classification, naive.sees(center, radius));
                let is_visible =
                    words[entry / VisibleSet::OBJECTS_PER_WORD] >> (entry % VisibleSet::OBJECTS_PER_WORD) & 1 == 1;
                tallies.lanes.of(is_tangent).count(classification, is_visible);
            }
        }
    }
    tallies
}

/// A sphere that touches a plane, an edge or a corner, to within four f32 steps of its radius or its distance.
fn tangent(oracle: &Oracle, random: &mut Random) -> BoundingSphere {
    let radius = if random.below(16) == 0 { 0.0 } else { magnitude(random, -6.0, 7.0) };
    let touching = oracle.touching(any_planes(random), [radius; 6], any_along(random), any_aside(random));
    let center = oracle.world(touching);
    let depth = |center| oracle.depths(oracle.relative(center)).into_iter().fold(f64::INFINITY, f64::min);
    let steps = random.below(9) as i32 - 4;
    if random.below(2) == 0 {
        // The sphere may touch another plane that is nearer.
        let mut radius = (-depth(center)).max(0.0) as f32;
        for _ in 0..steps.abs() {
            radius = if steps < 0 { radius.next_down().max(0.0) } else { radius.next_up() };
        }
        return BoundingSphere { center, radius };
    }
    let radius = (-depth(center)).max(0.0) as f32;
    let center = oracle.world(touching * (1.0 + f64::from(steps) * f64::from(f32::EPSILON)));
    BoundingSphere { center, radius }
}

/// A sphere up to 10,000 km away, with a radius from a micrometre to 10,000 km.
fn anywhere(oracle: &Oracle, random: &mut Random) -> BoundingSphere {
    let center = oracle.world(random.direction() * magnitude(random, -3.0, 7.0));
    BoundingSphere { center, radius: magnitude(random, -6.0, 7.0) as f32 }
}

/// Selects one, two or three planes, no two of them opposite.
pub fn any_planes(random: &mut Random) -> [bool; 6] {
    loop {
        let mut selected = [false; 6];
        for pair in selected.as_chunks_mut::<2>().0 {
            match random.below(5) {
                0 | 1 => pair[0] = true,
                2 | 3 => pair[1] = true,
                _ => (),
            }
        }
        // The near and the far plane constrain the rest too much.
        if random.below(3) != 0 {
            selected[4..].fill(false);
        }
        if selected.contains(&true) {
            return selected;
        }
    }
}

/// A distance along the axis in metres: up to a million kilometres, and sometimes behind the camera.
pub fn any_along(random: &mut Random) -> f64 {
    let along = magnitude(random, -5.0, 9.0);
    if random.below(6) == 0 { -along } else { along }
}

/// A position across the axis, as shares of the picture.
pub fn any_aside(random: &mut Random) -> [f64; 2] {
    [(); 2].map(|()| random.between(-1.0, 1.0))
}
