//! A fountain of particles, which jobs move: the frame draws as many as the node says.

use std::ops::Range;

use drawloom::command::Cull;
use drawloom::glam::Vec3;
use drawloom::graph::NodeError;
use drawloom::process::{
    Declare, DrawCount, Draws, InjectionPoint, ProceduralDraws, RenderProcess, StorageBuffer, targets,
};
use drawloom::scene::{Blend, GeneratedBuffer};
use drawloom::task::Worker;
use drawloom::{CpuNode, NodeAccesses, NodeContext};

use crate::ground;
use crate::random::random;

/// How many there can be.
const COUNT: u32 = 40_000;

/// How many begin in a second.
const RATE: f32 = 16_000.0;

/// How long one lives, in seconds.
const LIFE: f32 = 2.5;

/// Where they begin: x and z.
const SOURCE: [f32; 2] = [4.5, 6.0];

/// Position in the world, in metres, and how much of its life is left, from 0 to 1.
const SPARKS: StorageBuffer<[f32; 4]> = StorageBuffer::new("sparks", COUNT).filled_by_nodes();
/// Of the indirect draw.
const ARGUMENTS: StorageBuffer<[u32; 4]> = StorageBuffer::new("arguments of sparks", 1).filled_by_nodes();

/// Moves the particles.
pub struct Sparks {
    sparks: GeneratedBuffer<[f32; 4]>,
    arguments: GeneratedBuffer<[u32; 4]>,
    seconds: f32,
}

impl Sparks {
    pub fn new() -> Self {
        Self { sparks: SPARKS.generated(), arguments: ARGUMENTS.generated(), seconds: 0.0 }
    }

    pub fn set_time(&mut self, seconds: f32) {
        self.seconds = seconds;
    }

    /// How many are alive.
    pub fn count(&self) -> usize {
        ((self.seconds.min(LIFE) * RATE) as usize).min(COUNT as usize)
    }
}

/// A particle by its number: where it is, and how much of its life is left.
fn spark(number: usize, seconds: f32) -> [f32; 4] {
    // Its number is a place in the stream of those that begin, and comes again when it is dead.
    let birth = number as f32 / RATE;
    let lives = ((seconds - birth) / LIFE).floor().max(0.0);
    let age = seconds - birth - lives * LIFE;
    let random = |salt: u32| random(number as u32, lives as u32 * 4 + salt);
    let (angle, spread) = (random(1) * std::f32::consts::TAU, 1.8 * random(2));
    let up = 5.5 + (4.0 - spread) * random(3);
    let velocity = Vec3::new(angle.cos() * spread, up, angle.sin() * spread);
    let start = Vec3::new(SOURCE[0], ground::height(SOURCE[0], SOURCE[1]), SOURCE[1]);
    let mut position = start + velocity * age + Vec3::NEG_Y * (4.9 * age * age);
    // They bounce off the land, and lose height.
    let floor = ground::height(position.x, position.z);
    if position.y < floor {
        position.y = floor + (floor - position.y).min(3.0) * 0.25 * (age * 9.0).sin().abs();
    }
    [position.x, position.y, position.z, 1.0 - age / LIFE]
}

impl CpuNode for Sparks {
    fn name(&self) -> &str {
        "sparks"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(&self.sparks).fills(&self.arguments);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.sparks.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            if chunk == 0 {
                frame.set_count(&self.sparks, self.count())?;
                frame.fill(&self.arguments, 0)?[0] = [6, self.count() as u32, 0, 0];
            }
            for (number, made) in self.sparks.chunk_range(chunk).zip(&mut *frame.fill(&self.sparks, chunk)?) {
                *made = spark(number, self.seconds);
            }
        }
        Ok(())
    }
}

/// Draws a glowing square for each particle, where no object is nearer.
pub struct DrawSparks;

impl RenderProcess for DrawSparks {
    fn name(&self) -> &str {
        "draw sparks"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.after("draw mirror");
        declare.reads_buffer(SPARKS);
        declare.reads_arguments(ARGUMENTS);
        declare.tests_depth(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Procedural(ProceduralDraws {
            shader: include_str!("sparks.wgsl"),
            count: DrawCount::Indirect(ARGUMENTS.at(0)),
            cull: Cull::Nothing,
            blend: Blend::Additive,
            ..ProceduralDraws::default()
        })
    }
}
