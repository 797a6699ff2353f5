//! Drawloom's frames, live, in an engine's own egui: where the time of a frame went, what was chosen by measurement and
//! why, what each setting of [`Quality`](drawloom::quality::Quality) costs in this scene, what each view draws, and
//! what was left out.
//!
//! An engine that has egui adds three lines:
//!
//! ```
//! # use drawloom::backend::NullBackend;
//! # use drawloom::scene::{Camera, Scene};
//! # use drawloom::glam::DVec3;
//! # use drawloom::process::Deferred;
//! # use drawloom::{Renderer, task::Scheduler};
//! use drawloom_egui::Inspector;
//!
//! # let scheduler = std::sync::Arc::new(Scheduler::new(1)?);
//! # let mut scene = Scene::new();
//! # scene.cameras.push(Camera::looking_at("main", DVec3::Z, DVec3::ZERO));
//! # let (mut renderer, submitter) = Renderer::builder(NullBackend).pipeline(Deferred::new()).build(scheduler)?;
//! # let context = egui::Context::default();
//! let mut inspector = Inspector::default();
//! # for _ in 0..3 {
//! let recorded = renderer.record(scene.as_scene_ref())?;
//! inspector.add_frame(&renderer, &recorded);
//! # submitter.submit(recorded)?;
//! # let mut output = context.run_ui(egui::RawInput::default(), |ui| {
//! inspector.show(ui.ctx(), &mut renderer);
//! # });
//! # output.textures_delta.clear();
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! An engine without egui gets it over the pictures of its windows from [`Overlay`] (feature `overlay`, on by default).

mod choices;
mod colors;
mod frame_history;
mod graph;
mod inspector;
#[cfg(feature = "overlay")]
mod overlay;
mod quality;
mod timeline;
mod views;
mod warnings;

pub use inspector::Inspector;
#[cfg(feature = "overlay")]
pub use overlay::Overlay;
