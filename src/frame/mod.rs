//! The façade: a scene goes in, recorded queues come out, and the device thread submits them.

mod builder;
mod cost_model;
mod error;
mod granularity;
mod jobs;
mod kept_maps;
mod occlusion;
mod phase;
mod plans;
mod recorded;
mod renderer;
mod statistics;
mod triangles;
mod views;

pub use builder::RendererBuilder;
pub use error::{BuildError, FrameError, SubmitError};
pub use granularity::Granularity;
pub use recorded::{Recorded, Submitted, Submitter, ViewQueue};
pub use renderer::Renderer;
pub use statistics::{FrameStatistics, StageTimes, ViewStatistics};
