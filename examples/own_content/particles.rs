//! Particles that live on the device: a compute shader moves them and lists those that are alive, and an indirect draw
//! has as many instances as there are in the list.

use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::command::Cull;
use drawloom::process::{
    ComputeDispatch, Declare, DrawCount, Draws, InjectionPoint, ProceduralDraws, RenderProcess, StorageBuffer,
    Workgroups, targets,
};
use drawloom::scene::Blend;

/// How many particles there can be.
const COUNT: u32 = 1 << 14;

/// How many particles a workgroup moves: the number in `particles_move.wgsl`.
const WORKGROUP: u32 = 64;

/// Position in the world, in metres, and age in seconds; velocity, and the age at which it dies.
const PARTICLES: StorageBuffer<[[f32; 4]; 2]> = StorageBuffer::new("particles", COUNT);
/// The indices of those that are alive.
const ALIVE: StorageBuffer<u32> = StorageBuffer::new("particles alive", COUNT);
/// Of the indirect draw.
const ARGUMENTS: StorageBuffer<[u32; 4]> = StorageBuffer::new("particle arguments", 1);

/// Empties the list.
pub struct Begin;

impl RenderProcess for Begin {
    fn name(&self) -> &str {
        "begin particles"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(ARGUMENTS);
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("particles_begin.wgsl");
        Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() })
    }
}

/// Moves the particles by a frame, and lets as many begin as have died.
#[derive(Default)]
pub struct Move {
    frame: AtomicU32,
}

impl RenderProcess for Move {
    fn name(&self) -> &str {
        "move particles"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(PARTICLES);
        declare.changes_buffer(ALIVE);
        declare.changes_buffer(ARGUMENTS);
        declare.after(Begin.name());
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        let frame = self.frame.fetch_add(1, Ordering::Relaxed);
        Draws::Compute(ComputeDispatch {
            shader: include_str!("particles_move.wgsl"),
            workgroups: Workgroups::Count([COUNT / WORKGROUP, 1, 1]),
            parameters: bytemuck::bytes_of(&[frame, 0, 0, 0]).to_vec().into(),
            ..ComputeDispatch::default()
        })
    }
}

/// Draws a glowing square for each particle that is alive, where no object is nearer.
pub struct Draw;

impl RenderProcess for Draw {
    fn name(&self) -> &str {
        "draw particles"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.reads_buffer(PARTICLES);
        declare.reads_buffer(ALIVE);
        declare.reads_arguments(ARGUMENTS);
        declare.tests_depth(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Procedural(ProceduralDraws {
            shader: include_str!("particles_draw.wgsl"),
            count: DrawCount::Indirect(ARGUMENTS.at(0)),
            cull: Cull::Nothing,
            blend: Blend::Additive,
            ..ProceduralDraws::default()
        })
    }
}
