//! What a frame would take on any number of workers: its recorded runs, replayed by a discrete-event simulation of the
//! scheduler.

mod measured_run;
mod replay;
mod run;
mod scheduler_costs;
mod workers;

#[cfg(all(test, not(drawloom_model_check)))]
mod test_run;

pub use replay::{Replay, ReplayedFrame};
pub use scheduler_costs::SchedulerCosts;
