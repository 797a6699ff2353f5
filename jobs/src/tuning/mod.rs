//! What measurements decide, and by which rules.
//!
//! An *estimate* is the running average of a measured cost. A *controller* chooses by estimates, and hysteresis keeps
//! it from changing its choice for little. These are the controllers:
//!
//! | controller | chooses | sample | time constant | changes its choice if |
//! | --- | --- | --- | --- | --- |
//! | `CostModel` (`drawloom`'s `frame/stages/granularity.rs`) | the items of a stage's jobs | each frame: thread time an item | 6 frames | the size is wrong by 1.6; from one job to several above 19 µs of work, and back below 12 |
//! | `TicketSize` (`task/tickets.rs`) | the chunks that a worker claims at once | every 8 chunks, at most once a ticket: time of a chunk | none: the latest sample | it is wrong at all |
//! | `NodeCosts` (`graph/costs.rs`) | which ready node runs first | each measured run: time from a node's start to its end | 4 measured runs | the order of the costs changes |
//! | `ExecutionPolicy` (`graph/execution_policy.rs`) | a serial or a parallel run | each serial run and each measured parallel one: its time | 8 serial or 4/3 measured parallel runs | the other mode is faster by 1.25; a parallel run counts as at least one wake-up |
//! | `FrameGaps` (`task/frame_gaps.rs`) | whether workers look for jobs between frames | each frame: the time since the one before, at most twice the longest search | 8 frames | searching costs more, or less, than a wake-up |
//! | [`Tuner`] of recording (`drawloom`'s `backend/wgpu/strategy`) | how a pass is recorded and encoded | each frame: thread time a batch, and the time that other workers wait for it | 8 frames | another way is cheaper by 1.11 |
//! | [`Tuner`] of occlusion tests (`drawloom`'s `frame/stages/culling.rs`) | whether a view tests for occlusion | each frame: thread time an object | 8 frames | the other way is cheaper by 1.11 |
//! | `ViewBudget` (`drawloom`'s `frame/views/view_budget.rs`) | the forms in which views are drawn | each frame: thread or device time of a drawn camera, and of the rest | 8 frames | 4 frames in a row are predicted to exceed the budget, or one quality level more is predicted to fit by 1.15 |
//!
//! Three of them divide work, each at another scale, and none can replace another. `CostModel` decides how many items
//! one call of a stage gets: items of a chunk share what the call sets up. `TicketSize` decides how many such calls a
//! worker claims at once: it is all there is for engines' own loops and nodes, and 1 where chunks are as long as the
//! cost model makes them. `ExecutionPolicy` decides whether other workers are woken at all.
//!
//! # Rules
//!
//! 1. **Costs are per unit of work**, so they do not change with its amount. Only the costs of whole nodes and runs are
//!    totals.
//! 2. **The first samples are trusted least**, because they fill caches and make buffers. An estimate is the smaller of
//!    its first two samples, then the median of its first three, and only from then on an average. Until a controller
//!    has an estimate, it makes a choice that is wrong by little: jobs of 512 items, a serial run with a limit.
//! 3. **Outliers count as [`Estimate::OUTLIER_LIMIT`] times the average.** The operating system preempts workers, which
//!    makes a sample long and never short, so only long samples are limited.
//! 4. **[`Estimate::STEP_SAMPLES`] outliers in a row are a step**: the work has changed. The estimate starts over.
//! 5. **Where samples are rare, rules 2 to 4 do not hold** ([`Filter::unlimited`]): of parallel runs one in 31 is
//!    measured, and the next sample is too far off to tell an outlier from a change.
//! 6. **Hysteresis is a factor** ([`Hysteresis`]), the constant `HYSTERESIS` of the controllers that have it. It is
//!    large where a wrong choice costs little, as that of a job size, and small where it costs in proportion.
//! 7. **An alternative that loses a trial is tried again later each time**, up to a longest pause, so that trials cost
//!    next to nothing and alternatives of equal cost stop replacing each other. A step in the cost makes the tuner try
//!    all of them again, and so does twice or half the work, and more than 64 units more or less, for
//!    [`Estimate::STEP_SAMPLES`] frames. The pause before the tuner may do so once more is 256 frames, and doubles each
//!    time, up to 8192. The longest pause follows from what a trial costs: see [`Tuner::new`].
//!
//! `TicketSize` follows none of the rules 2 to 4: it works within one loop, whose chunks may differ much, and a ticket
//! that is too large holds up all workers, so the latest chunks count alone. The mode of a run has no pauses either: of
//! a serial schedule with more work than a wake-up, one run in 128 is parallel.
//!
//! `FrameGaps` does not follow rules 2 to 4 either: gaps differ because engines do different things between frames, and
//! each counts as its cost, which is limited. It has no hysteresis, because a choice that changes costs nothing by
//! itself.
//!
//! `ViewBudget` is the engine's own, which gives it the views and the frames' statistics. It predicts sums of costs, so
//! a wrong restoration shows only in the next frames: views pause as rule 7 says.
//!
//! What a frame's cost model, tuners, execution policy and view budget chose, and by which costs, is in
//! [`FrameTuning`](crate::timeline::FrameTuning). Of any schedule, [`run_mode`](crate::graph::Schedule::run_mode),
//! [`cost`](crate::graph::Schedule::cost) and [`is_critical`](crate::graph::Schedule::is_critical) tell the same.

mod estimate;
mod hysteresis;
mod job_size;
mod tuner;

pub use estimate::{Estimate, Filter};
pub use hysteresis::Hysteresis;
pub use job_size::{MAX_JOB, MIN_JOB, PARALLEL_THRESHOLD, job_size};
pub use tuner::{CostSample, Tuner};
