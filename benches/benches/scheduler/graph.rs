//! Rows `graph_1k`, `graph_4k` and `graph_10k`: many empty nodes, each of which waits for others.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crossbeam_utils::CachePadded;
use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::work::{Record, Work};
use drawloom_testing::random::Random;

use crate::crew::Crew;
use crate::turns::{Contender, Order, Row};
use crate::{Extent, Failure, WORKERS, pools};

const LAYER: usize = 64;

/// All of these must be of the same graph: layers of [`LAYER`] nodes, of which each waits for 1 to 4 of the layer before.
///
/// chili has no way to wait for anything but a half, and std's threads would need what this bench is about, so these two go
/// layer by layer, as the loop goes node by node: they need not find out which node is ready.
pub fn row(name: &'static str, nodes: usize, extent: &Extent) -> Row {
    let graph = Arc::new(Graph::new(nodes));
    Row {
        name,
        unit: "ns a node",
        scale: 1e9 / nodes as f64,
        pace: extent.hot(),
        work: Work::empty(),
        jobs: nodes,
        order: order(&graph),
        contenders: vec![
            Contender::plain_loop(nodes),
            Contender::ideal(nodes),
            drawloom("drawloom", WORKERS, &graph),
            drawloom("drawloom", 1, &graph),
            drawloom(ALWAYS_SHARED, WORKERS, &graph),
            rayon_inline(&graph),
            rayon(&graph),
            bevy_tasks(&graph),
            chili(&graph),
            std_threads(&graph),
        ],
    }
}

/// Who waits for whom, in flat arrays.
struct Graph {
    /// Each on a cache line of its own, with all that its run reads: neighbours are counted down by different threads.
    nodes: Vec<CachePadded<GraphNode>>,
    waiting: Vec<u32>,
}

struct GraphNode {
    /// For how many others it still waits. Whoever runs it makes that ready for the next frame.
    counter: AtomicU32,
    waits_for: u32,
    /// Those that wait for it are there in `waiting`.
    waiting: Range<u32>,
}

impl Graph {
    fn new(count: usize) -> Self {
        let mut random = Random::new();
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut waits_for = vec![0; count];
        for (node, waits_for) in waits_for.iter_mut().enumerate().skip(LAYER) {
            let above = (node / LAYER - 1) * LAYER;
            let dependencies = 1 + random.below(4) as u32;
            while *waits_for < dependencies {
                let list = &mut lists[above + random.below(LAYER)];
                if list.last() != Some(&(node as u32)) {
                    list.push(node as u32);
                    *waits_for += 1;
                }
            }
        }
        let mut waiting = Vec::new();
        let new_node = |(list, waits_for): (Vec<u32>, u32)| {
            let begin = waiting.len() as u32;
            waiting.extend(list);
            let waiting = begin..waiting.len() as u32;
            CachePadded::new(GraphNode { counter: AtomicU32::new(waits_for), waits_for, waiting })
        };
        let nodes = lists.into_iter().zip(waits_for).map(new_node).collect();
        Self { nodes, waiting }
    }

    /// The nodes that wait for nothing.
    fn roots(&self) -> Range<u32> {
        0..LAYER.min(self.nodes.len()) as u32
    }

    fn waiting_for(&self, node: u32) -> &[u32] {
        let Range { start, end } = self.nodes[node as usize].waiting;
        &self.waiting[start as usize..end as usize]
    }

    /// Runs a node, and returns those that are ready then.
    #[inline]
    fn run(&self, node: u32, work: &Work) -> impl Iterator<Item = u32> {
        work.job(node as usize);
        let GraphNode { counter, waits_for, .. } = &*self.nodes[node as usize];
        // Nobody counts it down before the next frame.
        counter.store(*waits_for, Ordering::Relaxed);
        let is_ready = |next: &u32| self.nodes[*next as usize].counter.fetch_sub(1, Ordering::AcqRel) == 1;
        self.waiting_for(node).iter().copied().filter(is_ready)
    }

    /// Where each layer ends.
    fn ends(&self) -> impl Iterator<Item = usize> {
        (1..=self.nodes.len().div_ceil(LAYER)).map(|layer| self.nodes.len().min(layer * LAYER))
    }
}

fn order(graph: &Arc<Graph>) -> Order {
    let graph = Arc::clone(graph);
    Box::new(move |record: &Record| {
        for before in 0..graph.nodes.len() {
            let waiting = graph.waiting_for(before as u32).iter().map(|&after| after as usize);
            for after in waiting {
                if !record.in_order(before, after) {
                    return Err(format!("node {after} began before node {before} had ended"));
                }
            }
        }
        Ok(())
    })
}

struct Empty {
    index: usize,
}

impl Node<Work> for Empty {
    fn width(&self, _work: &Work) -> usize {
        1
    }

    fn run(&self, work: &Work, _range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        work.job(self.index);
        Ok(())
    }
}

/// A schedule of so little work is run by one thread, unless it is told otherwise.
const ALWAYS_SHARED: &str = "drawloom always shared";

/// The schedule knows nothing at the start of a turn, as what it has learnt is of that turn's pool.
fn drawloom(name: &'static str, workers: usize, graph: &Arc<Graph>) -> Contender {
    let graph = Arc::clone(graph);
    let contender = Contender::new(name, move |work, watch| {
        let mut schedule = schedule(&graph)?;
        schedule.always_parallel(name == ALWAYS_SHARED);
        let scheduler = Scheduler::new(workers)?;
        watch.frames(|| Ok(schedule.run(&scheduler, work)?))
    });
    contender.with_workers(workers)
}

fn schedule(graph: &Graph) -> Result<Schedule<Empty>, Failure> {
    let mut frame_graph = FrameGraph::new();
    let nodes: Vec<_> =
        (0..graph.nodes.len()).map(|index| frame_graph.add(index.to_string(), Empty { index })).collect();
    for (before, &node) in nodes.iter().enumerate() {
        frame_graph.keep(node);
        for &after in graph.waiting_for(before as u32) {
            frame_graph.order(node, nodes[after as usize]);
        }
    }
    Ok(frame_graph.compile()?)
}

/// The first node that is ready is run in place, all others are spawned: as fast as it gets by hand.
fn rayon_inline(graph: &Arc<Graph>) -> Contender {
    fn run_on<'scope>(graph: &'scope Graph, mut node: u32, work: &'scope Work, scope: &rayon::Scope<'scope>) {
        loop {
            let mut ready = graph.run(node, work);
            let Some(next) = ready.next() else { return };
            for other in ready {
                scope.spawn(move |scope| run_on(graph, other, work, scope));
            }
            node = next;
        }
    }
    let graph = Arc::clone(graph);
    Contender::new("rayon inline", move |work, watch| {
        let graph = &*graph;
        pools::rayon()?.install(|| {
            watch.frames(|| {
                rayon::scope(|scope| {
                    for root in graph.roots() {
                        scope.spawn(move |scope| run_on(graph, root, work, scope));
                    }
                });
                Ok(())
            })
        })
    })
}

/// All nodes that are ready are spawned.
fn rayon(graph: &Arc<Graph>) -> Contender {
    fn run<'scope>(graph: &'scope Graph, node: u32, work: &'scope Work, scope: &rayon::Scope<'scope>) {
        for ready in graph.run(node, work) {
            scope.spawn(move |scope| run(graph, ready, work, scope));
        }
    }
    let graph = Arc::clone(graph);
    Contender::new("rayon", move |work, watch| {
        let graph = &*graph;
        pools::rayon()?.install(|| {
            watch.frames(|| {
                rayon::scope(|scope| {
                    for root in graph.roots() {
                        scope.spawn(move |scope| run(graph, root, work, scope));
                    }
                });
                Ok(())
            })
        })
    })
}

/// The first node that is ready is run in place, all others are spawned.
fn bevy_tasks(graph: &Arc<Graph>) -> Contender {
    fn spawn<'scope, 'env>(
        graph: &'env Graph,
        mut node: u32,
        work: &'env Work,
        scope: &'scope bevy_tasks::Scope<'scope, 'env, ()>,
    ) {
        scope.spawn(async move {
            loop {
                let mut ready = graph.run(node, work);
                let Some(next) = ready.next() else { return };
                for other in ready {
                    spawn(graph, other, work, scope);
                }
                node = next;
            }
        });
    }
    let graph = Arc::clone(graph);
    Contender::new("bevy_tasks", move |work, watch| {
        let graph = &*graph;
        let pool = pools::bevy_tasks();
        watch.frames(|| {
            pool.scope(|scope| {
                for root in graph.roots() {
                    spawn(graph, root, work, scope);
                }
            });
            Ok(())
        })
    })
}

fn chili(graph: &Arc<Graph>) -> Contender {
    let ends: Vec<_> = graph.ends().collect();
    Contender::new("chili by layers", move |work, watch| {
        let pool = pools::chili();
        let mut scope = pool.scope();
        watch.frames(|| {
            let mut begin = 0;
            for &end in &ends {
                pools::halve::<64>(&mut scope, begin..end, work);
                begin = end;
            }
            Ok(())
        })
    })
    .with_easier_task()
}

/// A ticket is good for 8 nodes, as taking one costs far more than a node.
fn std_threads(graph: &Arc<Graph>) -> Contender {
    let crew = Crew::new(graph.ends().collect(), 8);
    Contender::new("std threads by layers", move |work, watch| crew.frames(work, watch)).with_easier_task()
}
