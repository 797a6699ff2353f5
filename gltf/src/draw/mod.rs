//! Draws worlds with wgpu: metallic-roughness surfaces with textures, lit by all lights with their shadows, skins and
//! morph targets.
//!
//! [`open_device`] opens a device that has what this takes. [`add_world`] gives a renderer the processes of a world,
//! around a [`Deferred`](drawloom::process::Deferred) pipeline with any steps of post-processing that the engine likes.
//!
//! ```
//! use std::sync::Arc;
//!
//! use drawloom::backend::{Picture, WgpuBackend};
//! use drawloom::process::{Deferred, Fxaa, ToneMapping, targets};
//! use drawloom::task::Scheduler;
//! use drawloom::{Renderer, wgpu};
//! use drawloom_gltf::{World, draw};
//!
//! fn picture(
//!     (device, queue): (wgpu::Device, wgpu::Queue),
//!     scheduler: Arc<Scheduler>,
//!     world: &World,
//! ) -> Result<Picture, Box<dyn std::error::Error>> {
//!     let deferred = Deferred::new()
//!         .shadow_maps(Some(draw::shadow_maps(world)))
//!         .post(ToneMapping::new(1.0))
//!         .post(Fxaa::default());
//!     let builder = Renderer::builder(WgpuBackend::new(device, queue)?);
//!     let builder = draw::add_world(builder, deferred, world);
//!     let (mut renderer, submitter) = builder.build(scheduler)?;
//!     let recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
//!     Ok(submitter.submit(recorded)?.submission.read(0, targets::PICTURE)?)
//! }
//! ```

mod deformation;
mod device;
mod error;
mod processes;
mod surfaces;

pub use device::open_device;
pub use error::DrawError;
pub use processes::{add_world, shadow_maps};
