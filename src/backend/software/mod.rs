//! The software backend: it draws on the CPU what the other backends draw on a device.
//!
//! It executes the same commands with each process's [`CpuShader`](crate::process::CpuShader) in place of its WGSL. In
//! f32 it runs on all workers of a scheduler, so that a machine without a graphics adapter has a picture too; in f64 it
//! runs on one thread, as the reference that the other backends are compared with.
//!
//! Recording a pass only copies its list of draws. All drawing happens when a frame is submitted, pass after pass:
//! triangles are set up in chunks of a fixed size and binned into tiles of the picture, and each tile is drawn by one
//! job, with its triangles in the order of the commands. Chunks and tiles depend on the frame alone, so neither the
//! number of workers nor how the work is distributed changes a byte.

mod attachments;
mod backend;
mod commands;
mod draw_context;
mod executor;
mod frame;
mod generated_meshes;
mod frame_recording;
mod light_bounds;
mod materials;
mod meshes;
mod mip_chain;
mod object_pass;
mod pass_context;
mod pixel_formats;
mod precision;
mod rasterizer;
mod read_back;
mod screen_pass;
mod shader_inputs;
mod software_pass;
mod submission;
mod target_mip_levels;
mod targets;
mod tiles;
mod triangle_setup;
mod view_state;

pub use backend::SoftwareBackend;
pub use submission::SoftwareSubmission;
