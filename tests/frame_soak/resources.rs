//! What the process has.

use std::alloc::System;
use std::fs;

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
}
