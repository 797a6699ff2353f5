//! The greatest possible speed-up.

/// Amdahl's law with a wake-up cost. A frame of `frame` seconds on one thread has a serial part of `serial` seconds:
/// `record` before and after its jobs, and `submit`. The other workers sleep, and begin `wake` seconds after the jobs
/// begin. All then share the rest:
///
/// ```text
/// ceiling = frame / (serial + (frame − serial + (workers − 1) × wake) / workers)
/// ```
///
/// It is 1 if the jobs end before the other workers begin. `frame` and `serial` are measured in the scenario *single*,
/// `wake` by the scheduler of *multi*. A measured ratio may exceed the ceiling where *multi* records more cheaply, as
/// with instancing.
pub fn ceiling(frame: f64, serial: f64, wake: f64, workers: usize) -> f64 {
    let (shared, workers) = (frame - serial, workers as f64);
    if shared <= wake { 1.0 } else { frame / (serial + (shared + (workers - 1.0) * wake) / workers) }
}
