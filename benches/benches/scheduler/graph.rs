//! Rows `graph_1k`, `graph_4k` and `graph_10k`: a graph of many empty nodes.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crossbeam_utils::CachePadded;
use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::work::{Record, Work};
use drawloom_testing::random::Random;

use crate::row::{Contender, Order, Row};
use crate::thread_team::ThreadTeam;
use crate::{Extent, Failure, pools};

const LAYER: usize = 64;

/// All contenders run the same graph: layers of [`LAYER`] nodes. Each node depends on 1 to 4 nodes of the layer before.
///
/// chili and std's threads have no dependencies between jobs. They run layer by layer, and the plain loop runs node by
/// node: none of these has to find out which node is ready.
pub fn row(name: &'static str, nodes: usize, extent: &Extent, workers: &[usize]) -> Row {
    let graph = Arc::new(Graph::new(nodes));
    let mut contenders = vec![Contender::plain_loop(nodes)];
    if !workers.contains(&1) {
        contenders.push(drawloom("drawloom", 1, &graph));
    }
    for &workers in workers {
        contenders.extend([
            Contender::ideal(nodes, workers),
            drawloom("drawloom", workers, &graph),
            drawloom(ALWAYS_PARALLEL, workers, &graph),
            rayon_inline(&graph, workers),
            rayon(&graph, workers),
            bevy_tasks(&graph, workers),
            chili(&graph, workers),
            std_threads(&graph, workers),
            spinning_threads(&graph, workers),
        ]);
    }
    Row {
        name,
        unit: "ns per node",
        scale: 1e9 / nodes as f64,
        pace: extent.back_to_back(),
        work: Work::empty(),
        jobs: nodes,
        order: order(&graph),
        contenders,
    }
}

/// The dependencies, in flat arrays.
struct Graph {
    /// Each on a cache line of its own, as different threads decrement the counters of neighbours.
    nodes: Vec<CachePadded<GraphNode>>,
    /// The successors of all nodes.
    successors: Vec<u32>,
}

struct GraphNode {
    /// The number of dependencies that have not run yet. The thread that runs the node resets it for the next frame.
    pending: AtomicU32,
    dependencies: u32,
    /// Its successors' range in [`Graph::successors`].
    successors: Range<u32>,
}

impl Graph {
    fn new(count: usize) -> Self {
        let mut random = Random::new();
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut dependencies = vec![0; count];
        for (node, dependencies) in dependencies.iter_mut().enumerate().skip(LAYER) {
            let above = (node / LAYER - 1) * LAYER;
            let wanted = 1 + random.below(4) as u32;
            while *dependencies < wanted {
                let list = &mut lists[above + random.below(LAYER)];
                if list.last() != Some(&(node as u32)) {
                    list.push(node as u32);
                    *dependencies += 1;
                }
            }
        }
        let mut successors = Vec::new();
        let new_node = |(list, dependencies): (Vec<u32>, u32)| {
            let begin = successors.len() as u32;
            successors.extend(list);
            let successors = begin..successors.len() as u32;
            CachePadded::new(GraphNode { pending: AtomicU32::new(dependencies), dependencies, successors })
        };
        let nodes = lists.into_iter().zip(dependencies).map(new_node).collect();
        Self { nodes, successors }
    }

    /// The nodes without dependencies.
    fn roots(&self) -> Range<u32> {
        0..LAYER.min(self.nodes.len()) as u32
    }

    fn successors(&self, node: u32) -> &[u32] {
        let Range { start, end } = self.nodes[node as usize].successors;
        &self.successors[start as usize..end as usize]
    }

    /// Runs a node, and returns the successors that become ready.
    #[inline]
    fn run(&self, node: u32, work: &Work) -> impl Iterator<Item = u32> {
        work.job(node as usize);
        let GraphNode { pending, dependencies, .. } = &*self.nodes[node as usize];
        // No thread decrements it before the next frame.
        pending.store(*dependencies, Ordering::Relaxed);
        let is_ready = |next: &u32| self.nodes[*next as usize].pending.fetch_sub(1, Ordering::AcqRel) == 1;
        self.successors(node).iter().copied().filter(is_ready)
    }

    /// The end of each layer.
    fn ends(&self) -> impl Iterator<Item = usize> {
        (1..=self.nodes.len().div_ceil(LAYER)).map(|layer| self.nodes.len().min(layer * LAYER))
    }
}

fn order(graph: &Arc<Graph>) -> Order {
    let graph = Arc::clone(graph);
    Box::new(move |record: &Record| {
        for before in 0..graph.nodes.len() {
            let successors = graph.successors(before as u32).iter().map(|&after| after as usize);
            for after in successors {
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

/// By default one thread runs a schedule of so little work.
const ALWAYS_PARALLEL: &str = "drawloom always parallel";

/// The schedule is compiled for each sample, so that it has no measurements of an earlier pool.
fn drawloom(name: &'static str, workers: usize, graph: &Arc<Graph>) -> Contender {
    let graph = Arc::clone(graph);
    Contender::new(name, workers, move |work, timer| {
        let mut schedule = schedule(&graph)?;
        schedule.always_parallel(name == ALWAYS_PARALLEL);
        let scheduler = Scheduler::new(workers)?;
        timer.frames(|| Ok(schedule.run(&scheduler, work)?))
    })
}

fn schedule(graph: &Graph) -> Result<Schedule<Empty>, Failure> {
    let mut frame_graph = FrameGraph::new();
    let nodes: Vec<_> =
        (0..graph.nodes.len()).map(|index| frame_graph.add(index.to_string(), Empty { index })).collect();
    for (before, &node) in nodes.iter().enumerate() {
        frame_graph.keep(node);
        for &after in graph.successors(before as u32) {
            frame_graph.order(node, nodes[after as usize]);
        }
    }
    Ok(frame_graph.compile()?)
}

/// Runs the first node that becomes ready in place and spawns the others. This is the fastest hand-written scheme.
fn rayon_inline(graph: &Arc<Graph>, workers: usize) -> Contender {
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
    Contender::new("rayon inline", workers, move |work, timer| {
        let graph = &*graph;
        pools::rayon(workers)?.install(|| {
            timer.frames(|| {
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

/// Spawns all nodes that become ready.
fn rayon(graph: &Arc<Graph>, workers: usize) -> Contender {
    fn run<'scope>(graph: &'scope Graph, node: u32, work: &'scope Work, scope: &rayon::Scope<'scope>) {
        for ready in graph.run(node, work) {
            scope.spawn(move |scope| run(graph, ready, work, scope));
        }
    }
    let graph = Arc::clone(graph);
    Contender::new("rayon", workers, move |work, timer| {
        let graph = &*graph;
        pools::rayon(workers)?.install(|| {
            timer.frames(|| {
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

/// Runs the first node that becomes ready in place and spawns the others.
fn bevy_tasks(graph: &Arc<Graph>, workers: usize) -> Contender {
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
    Contender::new("bevy_tasks", workers, move |work, timer| {
        let graph = &*graph;
        let pool = pools::bevy_tasks(workers);
        timer.frames(|| {
            pool.scope(|scope| {
                for root in graph.roots() {
                    spawn(graph, root, work, scope);
                }
            });
            Ok(())
        })
    })
}

fn chili(graph: &Arc<Graph>, workers: usize) -> Contender {
    let ends: Vec<_> = graph.ends().collect();
    Contender::new("chili by layers", workers, move |work, timer| {
        let pool = pools::chili(workers);
        let mut scope = pool.scope();
        timer.frames(|| {
            let mut begin = 0;
            for &end in &ends {
                pools::join_halves::<64>(&mut scope, begin..end, work);
                begin = end;
            }
            Ok(())
        })
    })
    .with_easier_task()
}

/// A ticket costs far more than a node.
const NODES_PER_TICKET: usize = 8;

fn std_threads(graph: &Arc<Graph>, workers: usize) -> Contender {
    let team = ThreadTeam::sleeping(workers, graph.ends().collect(), NODES_PER_TICKET);
    Contender::new("std threads by layers", workers, move |work, timer| team.frames(work, timer)).with_easier_task()
}

fn spinning_threads(graph: &Arc<Graph>, workers: usize) -> Contender {
    let team = ThreadTeam::spinning(workers, graph.ends().collect(), NODES_PER_TICKET);
    Contender::new("spinning threads by layers", workers, move |work, timer| team.frames(work, timer))
        .with_easier_task()
}
