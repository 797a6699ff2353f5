//! What the process has.

use std::alloc::System;
use std::time::Duration;
use std::{fs, thread};

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// What the process has.
#[derive(Clone, Copy, Debug)]
pub struct Resources {
    /// Those that are allocated, not those that the allocator keeps.
    pub bytes: usize,
    /// 0 where the OS has no list of them.
    pub threads: usize,
    /// 0 where the OS has no list of them.
    pub files: usize,
}

impl Resources {
    pub fn count() -> Self {
        let stats = ALLOCATOR.stats();
        let entries = |path| fs::read_dir(path).map_or(0, Iterator::count);
        Self {
            bytes: stats.bytes_allocated - stats.bytes_deallocated,
            threads: entries("/proc/self/task"),
            files: entries("/proc/self/fd"),
        }
    }

    /// Counts until there is this number of threads, but not more than a thousand times. The OS goes on listing a
    /// thread for a while after it was joined.
    pub fn count_with_threads(threads: usize) -> Self {
        let mut now = Self::count();
        for _ in 0..1_000 {
            if now.threads == threads {
                break;
            }
            thread::sleep(Duration::from_millis(1));
            now = Self::count();
        }
        now
    }
}
