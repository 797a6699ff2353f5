//! How the hand-written techniques divide their work among threads.

use std::iter;
use std::sync::Arc;

use drawloom_benches::spinning::SpinningTeam;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::technique::Failure;

/// Threads of a technique; clones are the same threads.
#[derive(Clone)]
pub enum Threads {
    /// The calling thread alone.
    One,
    /// A pool of rayon's, whose threads sleep between frames.
    Rayon(Arc<ThreadPool>),
    /// Threads that spin between frames. A thread claims one item after the other.
    Spinning(Arc<SpinningTeam>),
    /// Threads that spin between frames. A thread has its own cameras, and its own share of the objects.
    CameraEach(Arc<SpinningTeam>),
}

impl Threads {
    /// One thread, and all ways to divide work among each of these numbers of threads.
    ///
    /// # Errors
    /// Returns an error if a thread cannot be started.
    pub fn all(counts: &[usize]) -> Result<Vec<Self>, Failure> {
        let mut all = vec![Self::One];
        for &count in counts.iter().filter(|&&count| count > 1) {
            let team = Arc::new(SpinningTeam::new(count)?);
            all.push(Self::Rayon(Arc::new(ThreadPoolBuilder::new().num_threads(count).build()?)));
            all.extend([Self::Spinning(Arc::clone(&team)), Self::CameraEach(team)]);
        }
        Ok(all)
    }

    pub fn count(&self) -> usize {
        match self {
            Self::One => 1,
            Self::Rayon(pool) => pool.current_num_threads(),
            Self::Spinning(team) | Self::CameraEach(team) => team.thread_count(),
        }
    }

    /// Empty for one thread.
    pub fn name(&self) -> &'static str {
        match self {
            Self::One => "",
            Self::Rayon(_) => "rayon",
            Self::Spinning(_) => "spinning",
            Self::CameraEach(_) => "camera a thread",
        }
    }

    /// Into how many parts a camera's objects are divided, so that each thread has one.
    pub fn parts(&self, cameras: usize) -> usize {
        match self {
            Self::One | Self::CameraEach(_) => 1,
            Self::Rayon(_) | Self::Spinning(_) => self.count().div_ceil(cameras.max(1)),
        }
    }

    /// Runs `frames` on one of the threads, so that the caller need not be woken at the end of each frame.
    pub fn run<R: Send>(&self, frames: impl FnOnce() -> R + Send) -> R {
        match self {
            Self::One => frames(),
            Self::Rayon(pool) => pool.install(frames),
            Self::Spinning(team) | Self::CameraEach(team) => team.run(frames),
        }
    }

    /// Calls `job` for each item. Called within [`run`](Self::run).
    pub fn for_each<T: Send>(&self, items: &mut [T], job: impl Fn(&mut T) + Sync + Send) {
        match self {
            Self::One => items.iter_mut().for_each(job),
            Self::Rayon(_) => items.par_iter_mut().with_max_len(1).for_each(job),
            Self::Spinning(team) => team.claim_each(items, job),
            Self::CameraEach(team) => team.own_each(items, job),
        }
    }

    /// The same, with a result of each item.
    pub fn map<T: Send, R: Send>(&self, items: &mut [T], job: impl Fn(&mut T) -> R + Sync + Send) -> Vec<R> {
        let mut results: Vec<_> = iter::repeat_with(|| None).take(items.len()).collect();
        let mut pairs: Vec<_> = items.iter_mut().zip(&mut results).collect();
        self.for_each(&mut pairs, |(item, result)| **result = Some(job(item)));
        results.into_iter().flatten().collect()
    }
}
