//! The processors that a thread may run on.

use std::io;

/// A set of logical processors, by the numbers that the system gives them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AffinityMask {
    processors: Vec<usize>,
}

impl AffinityMask {
    /// A set of these processors. The system ignores processors that do not exist or that the process may not use, but
    /// at least one must remain.
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

    /// Restricts the calling thread to these processors.
    ///
    /// # Errors
    /// Returns the system's error, or what is missing.
    #[cfg(all(feature = "affinity", any(target_os = "linux", target_os = "android")))]
    pub(super) fn apply(&self) -> io::Result<()> {
        use rustix::thread::{CpuSet, sched_setaffinity};

        let mut set = CpuSet::new();
        self.processors
            .iter()
            .filter(|&&processor| processor < CpuSet::MAX_CPU)
            .for_each(|&processor| set.set(processor));
        Ok(sched_setaffinity(None, &set)?)
    }

    /// Restricts the calling thread to these processors.
    ///
    /// # Errors
    /// Returns the system's error, or what is missing.
    #[cfg(not(all(feature = "affinity", any(target_os = "linux", target_os = "android"))))]
    pub(super) fn apply(&self) -> io::Result<()> {
        let missing = if cfg!(feature = "affinity") {
            "thread affinity is not supported on this system"
        } else {
            "thread affinity needs the feature `affinity`"
        };
        Err(io::Error::new(io::ErrorKind::Unsupported, missing))
    }
}
