//! The greatest possible speed-up.

/// Amdahl's law with a wake-up cost. A frame of `frame` seconds on one thread has a serial part of `serial` seconds: `record` before
/// and after its jobs, and `submit`. The second worker sleeps, and begins `wake` seconds after the jobs begin. The two then share
/// the rest:
///
/// ```text
/// ceiling = frame / (serial + (frame − serial + wake) / 2)
/// ```
///
/// It is 1 if the jobs end before the second worker begins. `frame` and `serial` are measured in the scenario *single*, `wake` by
/// the scheduler of *multi*. A measured ratio may exceed the ceiling where *multi* records more cheaply, as with instancing.
pub fn ceiling(frame: f64, serial: f64, wake: f64) -> f64 {
    let shared = frame - serial;
    if shared <= wake { 1.0 } else { frame / (serial + (shared + wake) / 2.0) }
}
