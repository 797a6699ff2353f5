//! The spans of a run's nodes: when each could have been opened, when it was, and which dependency arrows begin and end
//! at it.

use std::iter;
use std::time::Duration;

use crate::timeline::{Chunk, Run};

/// A node in a run, from its first slice to its last.
#[derive(Clone, Debug)]
pub(super) struct NodeSpan {
    pub(super) opened: Duration,
    /// When the last of its dependencies ended, or the run began. `None` if one of its dependencies has no slices.
    pub(super) ready: Option<Duration>,
    /// The slice that begins first.
    pub(super) first: EdgeSlice,
    /// The slice that ends last.
    pub(super) last: EdgeSlice,
    /// The numbers of the arrows that end and begin at it.
    pub(super) arrows_in: Vec<u64>,
    pub(super) arrows_out: Vec<u64>,
}

/// The first or the last slice of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeSlice {
    /// Its index among the run's [slices].
    pub(super) index: usize,
    started: Duration,
    ended: Duration,
}

/// The spans of all nodes of a run.
#[derive(Debug, Default)]
pub(super) struct NodeSpans {
    /// By node. `None` for a node without slices.
    pub(super) nodes: Vec<Option<NodeSpan>>,
    /// How many dependencies have an arrow, because there are slices at both ends.
    pub(super) arrows: u64,
    /// How many dependencies have none.
    pub(super) left_out: u64,
}

/// The chunks of a run and its [empty](Run::empty) ones, each with whether it is empty. In topological order: they
/// ascend by node.
pub(super) fn slices(run: &Run) -> impl Iterator<Item = (bool, &Chunk)> {
    let (mut chunks, mut empty) = (run.chunks.iter().peekable(), run.empty.iter().peekable());
    iter::from_fn(move || {
        let is_empty = match (chunks.peek(), empty.peek()) {
            (Some(chunk), Some(empty)) => empty.node < chunk.node,
            (chunk, _) => chunk.is_none(),
        };
        let next = if is_empty { empty.next() } else { chunks.next() };
        next.map(|chunk| (is_empty, chunk))
    })
}

impl NodeSpans {
    /// The spans of a run. Its arrows are numbered from `first_arrow` on.
    pub(super) fn new(run: &Run, first_arrow: u64) -> Self {
        let mut spans = Self { nodes: vec![None; run.graph.nodes.len()], ..Self::default() };
        for (index, (_, chunk)) in slices(run).enumerate() {
            let slice = EdgeSlice { index, started: chunk.started, ended: chunk.ended };
            spans.nodes[chunk.node]
                .get_or_insert_with(|| NodeSpan::new(chunk.opened, slice))
                .extend(chunk.opened, slice);
        }
        for (index, node) in run.graph.nodes.iter().enumerate() {
            let mut ready = Some(run.began);
            for &dependency in &node.dependencies {
                let ended = spans.nodes[dependency].as_ref().map(|span| span.last.ended);
                ready = ready.zip(ended).map(|(ready, ended)| ready.max(ended));
                spans.connect(dependency, index, first_arrow);
            }
            if let Some(span) = &mut spans.nodes[index] {
                span.ready = ready;
            }
        }
        spans
    }

    fn connect(&mut self, dependency: usize, node: usize, first_arrow: u64) {
        let arrow = first_arrow + self.arrows;
        if self.nodes[dependency].is_none() || self.nodes[node].is_none() {
            self.left_out += 1;
            return;
        }
        self.arrows += 1;
        self.nodes[dependency].iter_mut().for_each(|span| span.arrows_out.push(arrow));
        self.nodes[node].iter_mut().for_each(|span| span.arrows_in.push(arrow));
    }

    /// How the number of nodes that are ready but not opened changes: when, and by how much.
    pub(super) fn ready_changes(&self) -> impl Iterator<Item = (Duration, i64)> {
        let waits = self.nodes.iter().flatten().filter_map(|span| Some((span.ready?, span.opened)));
        waits.flat_map(|(ready, opened)| [(ready, 1), (opened.max(ready), -1)])
    }
}

impl NodeSpan {
    fn new(opened: Duration, slice: EdgeSlice) -> Self {
        Self { opened, ready: None, first: slice, last: slice, arrows_in: Vec::new(), arrows_out: Vec::new() }
    }

    fn extend(&mut self, opened: Duration, slice: EdgeSlice) {
        self.opened = self.opened.min(opened);
        // Of slices that begin or end at once the longer one, because arrows end and begin inside of slices.
        if (slice.started, self.first.ended) < (self.first.started, slice.ended) {
            self.first = slice;
        }
        if (slice.ended, self.last.started) > (self.last.ended, slice.started) {
            self.last = slice;
        }
    }
}
