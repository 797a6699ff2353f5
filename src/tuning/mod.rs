//! What measurements decide, and by which rules.
//!
//! An *estimate* is the running average of a measured cost. A *controller* chooses by estimates, and hysteresis keeps it from
//! changing its choice for little. These are the controllers:
//!
//! | controller | chooses | sample | time constant | changes its choice if |
//! | --- | --- | --- | --- | --- |
//! | `CostModel` (`frame/cost_model.rs`) | the items of a stage's jobs | each frame: ns an item | 6 frames | the size is wrong by 1.6 |
//! | `TicketSize` (`task/tickets.rs`) | the chunks that a worker claims at once | every 8 chunks: ns a chunk | 1 sample | always: a size needs no hysteresis where a change costs nothing |
//! | `NodeCosts` (`graph/costs.rs`) | which ready node runs first | each measured run: ns a node | 4 runs | always: an order costs nothing to change |
//! | `ExecutionPolicy` (`graph/execution_policy.rs`) | a serial or a parallel run | each run: ns a run | 8 serial runs, or 4/3 measured parallel ones | the other mode is faster by 1.25 |
//! | [`Tuner`] of recording strategies (`backend/wgpu/strategy`) | how a pass is recorded and encoded | each frame: ns a batch | 8 frames | another strategy is cheaper by 1.15 |
//! | [`Tuner`] of occlusion tests (`frame/occlusion_control.rs`) | whether a view tests for occlusion | each frame: ns an object | 8 frames | the other way is cheaper by 1.15 |
//!
//! Three of them divide work, each at another scale, and none can replace another. `CostModel` decides how many items one
//! call of a stage gets: items of a chunk share what the call sets up. `TicketSize` decides how many such calls a worker
//! claims at once: it is all there is for engines' own loops and nodes, and 1 where chunks are as long as the cost model
//! makes them. `ExecutionPolicy` decides whether other workers are woken at all.
//!
//! # Rules
//!
//! 1. **A cost is measured where it arises, and divided by what was done**: time of workers an item, not time of frames.
//! 2. **The first samples are not trusted.** They fill caches and make buffers. An estimate is the smaller of its first two
//!    samples, then the median of its first three, and only from then on an average.
//! 3. **Outliers count as [`Estimate::OUTLIER_LIMIT`] times the average.** The operating system preempts workers, which makes a
//!    sample long and never short, so only long samples are limited.
//! 4. **[`Estimate::STEP_SAMPLES`] outliers in a row are a step**: the work has changed. The estimate starts over.
//! 5. **A sample that is rare counts in full** ([`Filter::rare`]): the next one is too far off to wait for it.
//! 6. **Hysteresis is a factor, in one place for each controller** ([`Hysteresis`]): larger where a change costs more than a
//!    wrong choice.
//! 7. **An alternative that loses a trial is tried again later each time**, up to a longest pause, so that trials cost next to
//!    nothing and alternatives of equal cost stop replacing each other. A step in the cost or a change in the amount of work
//!    tries all of them again.
//!
//! `Renderer::record` puts what was chosen, and by which costs, into [`FrameTuning`](crate::timeline::FrameTuning).

mod estimate;
mod hysteresis;
#[cfg(all(test, not(drawloom_loom)))]
pub(crate) mod signal;
mod tuner;

pub(crate) use estimate::{Estimate, Filter};
pub(crate) use hysteresis::Hysteresis;
pub(crate) use tuner::{CostSample, Tuner};
