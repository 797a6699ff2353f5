//! How much there is to be gained at most.

/// By Amdahl's law, with what it costs to have company at all. A frame of `frame` seconds on one thread has a part of
/// `serial` seconds that no second worker can take: what `record` does before and after its jobs, and `submit`. The other
/// worker has slept, and begins `wake` seconds after the jobs do, so that the two share what is left when it comes:
///
/// ```text
/// ceiling = frame / (serial + (frame − serial + wake) / 2)
/// ```
///
/// Where the jobs are over before anybody could come it is 1. `frame` and `serial` are measured in the scenario *single*,
/// `wake` by the scheduler of *multi*. Multi may do the same by a cheaper way, of which this knows nothing; so with instancing it
/// may well be passed.
pub fn ceiling(frame: f64, serial: f64, wake: f64) -> f64 {
    let shared = frame - serial;
    if shared <= wake { 1.0 } else { frame / (serial + (shared + wake) / 2.0) }
}
