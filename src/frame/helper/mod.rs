//! Post-processing on a helper (S 9.7, figure 9.6): idle workers of the CPU compute a step of post-processing from a frame that the device
//! has drawn, while the device draws the next one. The frame rate stays, and what the step adds to the picture is late by a frame or more.
//!
//! ```text
//!  device    │ scene 1   │ scene 2 │ late picture 1 │ scene 3 ...
//!            └─pixels─┐            ▲
//!  helper             │ step of 1 ─┘          a frame takes a result when it begins to be recorded: with frames
//!                                           in flight, scene 3 is the first that can show a layer of scene 1
//! ```
//!
//! Data flows one way, and each piece has one owner. The frame owns the target that is read back; the device's copy of it goes to the
//! [`PostHelper`], which hands it to its [`HelperStep`] on a worker; what the step returns is a texture of the helper's, and stays as it is
//! until the last frame that samples it is drawn. Nothing waits: a frame takes the newest result that is there, and says in its
//! [statistics](crate::FrameStatistics::helpers) how old that is.
//!
//! There are two ways to use a result:
//!
//! - [`PostHelper::late_picture`]: the whole picture comes from the helper. It is exact, and that of an earlier frame.
//!   [`PostHelper::late_picture_alone`] draws it in a frame of its own, which stands before the next scene in the device's queue: with
//!   [`Buffering::SameFrame`](crate::Buffering::SameFrame) that is one frame more of latency, as in the figure. With more frames in flight it stands
//!   behind those that were submitted before.
//! - [`PostHelper::layer`]: the step computes a layer, such as a glow or ambient occlusion, which is composited over the current picture.
//!   Only the layer is late. [Reprojection](HelperLayer::reprojection) looks it up where the surface of each pixel was in the frame that the
//!   layer is of, by the cameras of both and the current depth.
//!
//! # When it pays
//!
//! Where the device is what limits the frame rate, and workers are idle. The step costs a read-back, an upload, and a worker for as long as it
//! takes; a worker in the middle of it takes no part in recording. On a device that is not busy the same step as a process is faster, and not
//! late: `cargo bench -p drawloom-benches --bench helper_post` compares them.

mod bloom;
#[cfg(feature = "software")]
mod cpu_shader;
mod error;
mod layer;
mod layer_settings;
mod layer_view;
mod late_picture;
mod post_helper;
mod selection;
mod shared;
mod downsample;
mod source;
mod statistics;
mod step;
mod view_work;

pub use bloom::Bloom;
pub use error::{HelperError, HelperErrorReason};
pub use layer_settings::{HelperBlend, HelperLayer, HelperReprojection};
pub use post_helper::PostHelper;
pub use source::HelperSource;
pub use statistics::HelperStatistics;
pub use step::{HelperFrame, HelperStep};
