//! Where the nodes of a run have their slices: when each could have been opened, when it was, and which dependencies
//! lead to it and from it.

use std::{iter, time::Duration};

use crate::timeline::{Chunk, Run};

/// What a node did in a run.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    pub(super) opened: Duration,
    /// When the last of what it waits for ended, or else the run began. `None` if something that it waits for has no slices.
    pub(super) ready: Option<Duration>,
    /// The slice that begins first, by its place among the run's.
    pub(super) first: Edge,
    /// The slice that ends last.
    pub(super) last: Edge,
    /// The dependencies that lead to it, and from it, by numbers.
    pub(super) arrows_in: Vec<u64>,
    pub(super) arrows_out: Vec<u64>,
}

/// The first or the last slice of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) place: usize,
    started: Duration,
    ended: Duration,
}

/// The nodes of a run.
#[derive(Debug, Default)]
pub(super) struct Passages {
    /// By node; `None` for one without slices.
    pub(super) nodes: Vec<Option<Passage>>,
    /// How many dependencies have slices at both ends.
    pub(super) arrows: u64,
    /// How many have not.
    pub(super) left_out: u64,
}

/// A run's chunks, and its [empty](Run::empty) ones, with whether they are: by node, so that each comes after all it
/// waits for.
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

impl Passages {
    /// Those of a run, whose dependencies are numbered from there on.
    pub(super) fn new(run: &Run, first_arrow: u64) -> Self {
        let mut passages = Self { nodes: vec![None; run.graph.nodes.len()], ..Self::default() };
        for (place, (_, chunk)) in slices(run).enumerate() {
            let edge = Edge { place, started: chunk.started, ended: chunk.ended };
            passages.nodes[chunk.node]
                .get_or_insert_with(|| Passage::new(chunk.opened, edge))
                .take_in(chunk.opened, edge);
        }
        for (index, node) in run.graph.nodes.iter().enumerate() {
            let mut ready = Some(run.began);
            for &dependency in &node.dependencies {
                let ended = passages.nodes[dependency].as_ref().map(|passage| passage.last.ended);
                ready = ready.zip(ended).map(|(ready, ended)| ready.max(ended));
                passages.connect(dependency, index, first_arrow);
            }
            if let Some(passage) = &mut passages.nodes[index] {
                passage.ready = ready;
            }
        }
        passages
    }

    fn connect(&mut self, dependency: usize, node: usize, first_arrow: u64) {
        let arrow = first_arrow + self.arrows;
        if self.nodes[dependency].is_none() || self.nodes[node].is_none() {
            self.left_out += 1;
            return;
        }
        self.arrows += 1;
        self.nodes[dependency].iter_mut().for_each(|passage| passage.arrows_out.push(arrow));
        self.nodes[node].iter_mut().for_each(|passage| passage.arrows_in.push(arrow));
    }

    /// When nodes could have been opened and were not yet: the moments at which their number changes, and by how much.
    pub(super) fn waits(&self) -> impl Iterator<Item = (Duration, i64)> {
        let waits = self.nodes.iter().flatten().filter_map(|passage| Some((passage.ready?, passage.opened)));
        waits.flat_map(|(ready, opened)| [(ready, 1), (opened.max(ready), -1)])
    }
}

impl Passage {
    fn new(opened: Duration, edge: Edge) -> Self {
        Self { opened, ready: None, first: edge, last: edge, arrows_in: Vec::new(), arrows_out: Vec::new() }
    }

    fn take_in(&mut self, opened: Duration, edge: Edge) {
        self.opened = self.opened.min(opened);
        // Of those at one moment the longer one, which has an inside.
        if (edge.started, self.first.ended) < (self.first.started, edge.ended) {
            self.first = edge;
        }
        if (edge.ended, self.last.started) > (self.last.ended, edge.started) {
            self.last = edge;
        }
    }
}
