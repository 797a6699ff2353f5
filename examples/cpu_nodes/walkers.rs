//! A crowd that walks over the land: a node moves it before the frame reads where its objects are.

use std::ops::Range;

use drawloom::glam::{DVec3, Quat};
use drawloom::graph::NodeError;
use drawloom::scene::NodeColumn;
use drawloom::task::Worker;
use drawloom::{CpuNode, FrameData, NodeAccesses, NodeContext};

use crate::ground;
use crate::random::random;

/// How many there are.
pub const COUNT: usize = 1_500;

/// Moves the objects from `first` on.
pub struct Walkers<'a> {
    pub positions: &'a NodeColumn<'a, DVec3>,
    pub orientations: &'a NodeColumn<'a, Quat>,
    /// The index of the first walker among the objects.
    pub first: usize,
    pub seconds: f32,
}

/// Where a walker is and how it is turned, by its number.
pub fn walker(number: usize, seconds: f32) -> (DVec3, Quat) {
    let ring = 10.0 + 28.0 * random(number as u32, 1).sqrt();
    let speed = 1.2 / ring * if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let angle = random(number as u32, 2) * std::f32::consts::TAU + seconds * speed;
    let [x, z] = [angle.cos() * ring, angle.sin() * ring];
    let step = (seconds * 7.0 + number as f32).sin();
    let position = DVec3::new(x.into(), (ground::height(x, z) + 0.45 + 0.08 * step.abs()).into(), z.into());
    let heading = Quat::from_rotation_y(-angle - std::f32::consts::FRAC_PI_2);
    (position, heading * Quat::from_rotation_z(0.15 * step))
}

impl CpuNode for Walkers<'_> {
    fn name(&self) -> &str {
        "walkers"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.writes(FrameData::Transforms);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.positions.chunk_count()
    }

    fn run(&self, _: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            let (mut positions, mut orientations) = (self.positions.write(chunk)?, self.orientations.write(chunk)?);
            let objects = positions.objects().zip(&mut *orientations);
            for ((object, position), orientation) in objects.filter(|((object, _), _)| *object >= self.first) {
                (*position, *orientation) = walker(object - self.first, self.seconds);
            }
        }
        Ok(())
    }
}
