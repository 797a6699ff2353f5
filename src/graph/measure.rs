//! What a run was: which chunk of which process ran where, and when.
//!
//! Every worker writes down the chunks that it runs, in a list of its own, behind a lock that nobody else wants meanwhile. The
//! lists are kept from run to run. When the run has ended they are put together.

use std::{ops::Range, time::Duration};

use crossbeam_utils::CachePadded;

use crate::sync::{Instant, Mutex};

/// What a run was: every chunk of every process. Made by [`Schedule::run_measured`](super::Schedule::run_measured).
#[derive(Clone, Debug, PartialEq)]
pub struct RunMeasure {
    pub(crate) workers: usize,
    pub(crate) took: Duration,
    pub(crate) shared_from: Option<Duration>,
    pub(crate) always_shares: bool,
    pub(crate) processes: Vec<ProcessMeasure>,
    pub(crate) chunks: Vec<ChunkMeasure>,
}

/// A process in a run that was measured.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ProcessMeasure {
    /// Its name.
    pub name: String,
    /// The indices of what it waits for, ascending, and all less than its own.
    pub dependencies: Vec<usize>,
    /// Whether it had to run on the calling thread.
    pub pinned: bool,
    /// How many items it had.
    pub width: usize,
    /// How many items its first chunk had: all but the last have as many. 0 where there were no items.
    pub chunk: usize,
}

/// A chunk in a run that was measured. Times are since the run began.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChunkMeasure {
    /// The index of its process.
    pub process: usize,
    /// Its items.
    pub items: Range<usize>,
    /// The worker that ran it.
    pub worker: usize,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
}

impl RunMeasure {
    /// How many workers the scheduler had.
    pub fn workers(&self) -> usize {
        self.workers
    }

    /// How long the run took.
    pub fn took(&self) -> Duration {
        self.took
    }

    /// From when on other workers could take part, since the run began: what began earlier was run by the calling thread
    /// alone. `None` if all of it was.
    pub fn shared_from(&self) -> Option<Duration> {
        self.shared_from
    }

    /// The processes, in the order of the schedule.
    pub fn processes(&self) -> &[ProcessMeasure] {
        &self.processes
    }

    /// All chunks, by their process' index, and those of one process by their items.
    pub fn chunks(&self) -> &[ChunkMeasure] {
        &self.chunks
    }

    /// The chunks of the process of that index; none if there is no such process.
    pub fn chunks_of(&self, process: usize) -> &[ChunkMeasure] {
        let start = self.chunks.partition_point(|chunk| chunk.process < process);
        let rest = &self.chunks[start..];
        &rest[..rest.partition_point(|chunk| chunk.process == process)]
    }

    /// All workers' time in chunks, together.
    pub fn work(&self) -> Duration {
        self.chunks.iter().map(ChunkMeasure::took).sum()
    }

    /// Sets the widths and chunk sizes by the chunks, all of which are there.
    pub(crate) fn with_chunks(mut self, mut chunks: Vec<ChunkMeasure>) -> Self {
        chunks.sort_unstable_by_key(|chunk| (chunk.process, chunk.items.start));
        for chunk in &chunks {
            let process = &mut self.processes[chunk.process];
            process.width += chunk.items.len();
            process.chunk = process.chunk.max(chunk.items.len());
        }
        Self { chunks, ..self }
    }
}

impl ChunkMeasure {
    /// How long it took.
    pub fn took(&self) -> Duration {
        self.ended.saturating_sub(self.began)
    }
}

/// What the workers have written down in the current run.
#[derive(Default)]
pub(super) struct Notes {
    lists: Vec<CachePadded<Mutex<Vec<ChunkMeasure>>>>,
}

impl Notes {
    /// An empty list for each worker.
    pub(super) fn start(&mut self, workers: usize) {
        if self.lists.len() < workers {
            self.lists.resize_with(workers, || CachePadded::new(Mutex::new(Vec::new())));
        }
        self.lists.iter().for_each(|list| list.lock().clear());
    }

    pub(super) fn add(&self, chunk: ChunkMeasure) {
        self.lists[chunk.worker].lock().push(chunk);
    }

    /// All that was written down.
    pub(super) fn take(&self) -> Vec<ChunkMeasure> {
        let mut chunks = Vec::with_capacity(self.lists.iter().map(|list| list.lock().len()).sum());
        self.lists.iter().for_each(|list| chunks.append(&mut list.lock()));
        chunks
    }
}

/// Where a run that is measured writes down what it does.
#[derive(Clone, Copy)]
pub(super) struct Notebook<'run> {
    pub(super) notes: &'run Notes,
    pub(super) start: Instant,
}

impl Notebook<'_> {
    /// Runs a chunk, and writes it down.
    pub(super) fn write_down<R>(
        self,
        process: u32,
        items: Range<usize>,
        worker: usize,
        run: impl FnOnce(Range<usize>) -> R,
    ) -> R {
        let began = Instant::now();
        let result = run(items.clone());
        let ended = Instant::now();
        let [began, ended] = [began, ended].map(|moment| moment.duration_since(self.start));
        self.notes.add(ChunkMeasure { process: process as usize, items, worker, began, ended });
        result
    }
}
