//! On which processors a thread may run.

use std::io;

/// A set of logical processors, by the numbers that the system gives them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AffinityMask {
    processors: Vec<usize>,
}

impl AffinityMask {
    /// These processors. Those that the machine has not, or the process may not use, are left out; one has to remain.
    pub fn new(processors: impl IntoIterator<Item = usize>) -> Self {
        let mut processors: Vec<usize> = processors.into_iter().collect();
        processors.sort_unstable();
        processors.dedup();
        Self { processors }
    }

    /// The processors, ascending.
    pub fn processors(&self) -> &[usize] {
        &self.processors
    }

    /// Has the calling thread run on these processors only.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    pub(super) fn apply(&self) -> io::Result<()> {
        use rustix::thread::{CpuSet, sched_setaffinity};

        let mut set = CpuSet::new();
        self.processors
            .iter()
            .filter(|&&processor| processor < CpuSet::MAX_CPU)
            .for_each(|&processor| set.set(processor));
        Ok(sched_setaffinity(None, &set)?)
    }

    /// Has the calling thread run on these processors only.
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    pub(super) fn apply(&self) -> io::Result<()> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "threads cannot be kept to processors on this system"))
    }
}
