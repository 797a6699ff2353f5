//! Asynchronous post-processing (S 9.7, figure 9.6): idle workers of the CPU compute a step of post-processing from a
//! frame that the device has drawn, while the device draws the next one. The frame rate stays, and what the step adds
//! to the picture is late by a frame or more.
//!
//! ```text
//!  device    │ scene 1   │ scene 2 │ late picture 1 │ scene 3 ...
//!            └─pixels─┐            ▲
//!  workers            │ step of 1 ─┘          a frame takes a result when it begins to be recorded: with frames
//!                                           in flight, scene 3 is the first that can show a layer of scene 1
//! ```
//!
//! | type | what it is |
//! | --- | --- |
//! | [`AsyncPost`] | the handle: its processes for the renderer, and two calls a frame |
//! | [`AsyncStep`], [`StepFrame`], [`StepSource`] | what an engine computes, from which pixels |
//! | [`LayerSettings`], [`LayerBlend`], [`LayerReprojection`] | how a result is composited over the current picture |
//! | [`Bloom`] | a shipped step, on workers or on the device |
//! | [`AsyncPostStatistics`] | how old the results are that a frame shows, and how long they took |
//! | [`AsyncPostError`], [`AsyncPostErrorReason`] | why there is no result |
//! | [`UploadPicture`] | what it asks of a backend, to implement for an engine's own |
//!
//! Data flows one way, and each piece has one owner. The frame owns the target that is read back; the device's copy of
//! it goes to the [`AsyncPost`], which hands it to its [`AsyncStep`] on a worker; what the step returns is a texture of
//! the `AsyncPost`, and stays as it is until the last frame that samples it is drawn. Nothing waits: a frame takes the
//! newest result that is there, and [`AsyncPost::statistics`] says how old that is.
//!
//! There are two ways to use a result:
//!
//! - [`AsyncPost::late_picture`]: the result is the whole picture. It is exact, and that of an earlier frame.
//!   [`AsyncPost::late_picture_alone`] draws it in a frame of its own, which stands before the next scene in the
//!   device's queue: with [`Buffering::SameFrame`](drawloom::Buffering::SameFrame) that is one frame more of latency,
//!   as in the figure. With more frames in flight it stands behind those that were submitted before.
//! - [`AsyncPost::layer`]: the step computes a layer, such as a glow or ambient occlusion, which is composited over the
//!   current picture. Only the layer is late. [Reprojection](LayerSettings::reprojection) looks it up where the surface
//!   of each pixel was in the frame that the layer is of, by the cameras of both and the current depth.
//!
//! # When it pays
//!
//! Where the device is what limits the frame rate, and workers are idle. The step costs a read-back, an upload, and a
//! worker for as long as it takes; a worker in the middle of it takes no part in recording. On a device that is not
//! busy the same step as a process is faster, and not late: `cargo bench -p drawloom-benches --bench async_post`
//! compares them.
//!
//! # Features
//!
//! - `wgpu` (default): results are textures of `drawloom::backend::WgpuBackend`.
//! - `software`: CPU shaders of the processes, for `drawloom::backend::SoftwareBackend`.
//!
//! # Spans
//!
//! Each first of several [errors](AsyncPost::take_errors) in a row goes through `tracing`, as an event of the target
//! `drawloom` and the level `warn`.

#![forbid(unsafe_code)]

// Each module uses only modules above it; `tests/architecture` of the workspace fails otherwise.
mod unwind;
mod upload_picture;
mod source;
mod step;
mod error;
mod statistics;
mod layer_settings;
mod layer_view;
mod view_work;
mod selection;
#[cfg(feature = "software")]
mod cpu_shader;
mod downsample;
mod late_picture;
mod layer;
mod shared;
mod bloom;
mod async_post;

pub use async_post::AsyncPost;
pub use bloom::Bloom;
pub use error::{AsyncPostError, AsyncPostErrorReason};
pub use layer_settings::{LayerBlend, LayerReprojection, LayerSettings};
pub use source::StepSource;
pub use statistics::AsyncPostStatistics;
pub use step::{AsyncStep, StepFrame};
pub use upload_picture::UploadPicture;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(all(doctest, feature = "wgpu"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
