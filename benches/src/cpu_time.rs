//! How much of the cores this process uses.

use std::time::{Duration, Instant};

use crate::arguments::cores;

/// CPU time of all threads of this process; `None` where the platform does not tell.
#[cfg(target_os = "linux")]
pub fn cpu_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(Duration::new(time.tv_sec as u64, time.tv_nsec as u32))
}

/// CPU time of all threads of this process; `None` where the platform does not tell.
#[cfg(not(target_os = "linux"))]
pub fn cpu_time() -> Option<Duration> {
    None
}

/// The use of the cores since some time.
pub struct CpuUse {
    begun: Instant,
    before: Option<Duration>,
}

impl CpuUse {
    pub fn begin() -> Self {
        Self { begun: Instant::now(), before: cpu_time() }
    }

    /// The share of all cores' time that this process has used since the beginning; NaN where the platform does not
    /// tell.
    pub fn share(&self) -> f64 {
        let available = self.begun.elapsed().as_secs_f64() * cores() as f64;
        match (self.before, cpu_time()) {
            (Some(before), Some(now)) => (now - before).as_secs_f64() / available,
            _ => f64::NAN,
        }
    }
}
