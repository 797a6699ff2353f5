//! The CPU nodes that an engine lends for a frame, and the order between them and the stages.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use crate::frame::nodes::NodeAccess;
use crate::frame::{CpuNode, FrameData, FrameError, NodeAccesses, NodeResource};
use crate::graph::{FrameGraph, GraphProblem, NodeId};
use crate::scene::{GeneratedContents, GeneratedLayout};
use crate::task::{JobPanic, catch};

/// What decides about the graph of a frame with CPU nodes: the declaration of each.
#[derive(Debug, Default)]
pub(in crate::frame) struct NodeKeys {
    keys: Vec<NodeKey>,
}

#[derive(Clone, Debug)]
struct NodeKey {
    name: Arc<str>,
    accesses: Vec<NodeAccess>,
}

/// The declarations of the nodes of a frame. They keep their memory from frame to frame.
#[derive(Debug, Default)]
pub(in crate::frame) struct NodeDeclarations {
    accesses: NodeAccesses,
    /// The part of the accesses of each node.
    ranges: Vec<Range<usize>>,
    /// What the nodes fill in this frame.
    pub(in crate::frame) generated: Vec<Arc<GeneratedContents>>,
}

/// The nodes that an engine lends for a frame.
#[derive(Clone, Copy)]
pub(in crate::frame) struct BorrowedNodes<'a> {
    pub(in crate::frame) nodes: &'a [&'a dyn CpuNode],
    pub(in crate::frame) declarations: &'a NodeDeclarations,
}

impl NodeDeclarations {
    /// The nodes of a frame, which are asked what they read and write.
    ///
    /// # Errors
    /// If one of them panics, or there is not enough memory for what they fill.
    pub(in crate::frame) fn lend<'a>(
        &'a mut self,
        nodes: &'a [&'a dyn CpuNode],
    ) -> Result<BorrowedNodes<'a>, FrameError> {
        self.accesses.accesses.clear();
        self.accesses.filled.clear();
        self.ranges.clear();
        self.generated.clear();
        for node in nodes {
            let first = self.accesses.accesses.len();
            catch(|| node.declare(&mut self.accesses)).map_err(|JobPanic { message, .. }| {
                let name = catch(|| node.name().to_owned()).unwrap_or_default();
                FrameError::Panicked { stage: name, message }
            })?;
            self.ranges.push(first..self.accesses.accesses.len());
        }
        for source in &self.accesses.filled {
            let GeneratedLayout { name, capacity, stride, .. } = source.layout;
            let without_memory = || FrameError::GeneratedMemory { buffer: name.to_owned(), capacity, stride };
            self.generated.push(source.begin_frame().ok_or_else(without_memory)?);
        }
        Ok(BorrowedNodes { nodes, declarations: self })
    }

    /// # Errors
    /// If nodes have not filled all elements of their buffers.
    pub(in crate::frame) fn check_filled(&self) -> Result<(), FrameError> {
        let unfilled = |contents: &Arc<GeneratedContents>| {
            let chunk = contents.unfilled_chunk()?;
            Some(FrameError::UnfilledBuffer { buffer: contents.layout().name.to_owned(), chunk })
        };
        self.generated.iter().find_map(unfilled).map_or(Ok(()), Err)
    }

    /// What a node declares, by its index.
    pub(in crate::frame) fn of_node(&self, node: usize) -> &[NodeAccess] {
        &self.accesses.accesses[self.ranges[node].clone()]
    }
}

impl BorrowedNodes<'_> {
    /// # Errors
    /// If a node panics when it is asked for its name.
    pub(in crate::frame) fn keys(self) -> Result<NodeKeys, FrameError> {
        let key = |(index, node): (usize, &&dyn CpuNode)| {
            let name = catch(|| Arc::from(node.name())).map_err(|JobPanic { message, .. }| FrameError::Panicked {
                stage: format!("the name of node {index}"),
                message,
            })?;
            Ok(NodeKey { name, accesses: self.declarations.of_node(index).to_vec() })
        };
        Ok(NodeKeys { keys: self.nodes.iter().enumerate().map(key).collect::<Result<_, FrameError>>()? })
    }
}

impl NodeKeys {
    /// What is wrong with a graph of stages and these nodes. The stages alone make one.
    pub(in crate::frame) fn error_of(&self, problem: GraphProblem) -> FrameError {
        match problem {
            problem if self.keys.is_empty() => FrameError::StageGraph(problem),
            GraphProblem::DuplicateNode { name } if self.names().filter(|known| ***known == name).count() == 1 => {
                named_like_a_stage(&name)
            }
            problem => FrameError::Nodes(problem),
        }
    }

    /// Whether these are the keys of the nodes of a frame. Allocates nothing.
    pub(in crate::frame) fn fit(&self, lent: BorrowedNodes<'_>) -> bool {
        let fits = |(index, (key, node)): (usize, (&NodeKey, &&dyn CpuNode))| {
            key.accesses == lent.declarations.of_node(index) && catch(|| node.name() == &*key.name) == Ok(true)
        };
        self.keys.len() == lent.nodes.len() && self.keys.iter().zip(lent.nodes).enumerate().all(fits)
    }

    /// The names of the nodes.
    pub(in crate::frame) fn names(&self) -> impl Iterator<Item = &Arc<str>> {
        self.keys.iter().map(|key| &key.name)
    }

    /// Adds what orders the nodes to a graph that has all stages. `ids` are those of the nodes, and `stages` the nodes
    /// of each stage.
    ///
    /// # Errors
    /// If a node has the name of a stage, declares to write what only stages write, or comes after a node that is not
    /// there.
    pub(in crate::frame) fn order<P>(
        &self,
        graph: &mut FrameGraph<P>,
        ids: &[NodeId],
        stages: &HashMap<&'static str, Vec<NodeId>>,
    ) -> Result<(), FrameError> {
        let find = |wanted: &str| self.keys.iter().position(|key| &*key.name == wanted);
        // Names of views' stages contain the view, so the graph would not find these.
        if let Some(key) = self.keys.iter().find(|key| stages.contains_key(&*key.name)) {
            return Err(named_like_a_stage(&key.name));
        }
        let nodes_of = |stage: &str| stages.get(stage).into_iter().flatten().copied();
        for (key, &id) in self.keys.iter().zip(ids) {
            let refused = |problem: String| FrameError::InvalidNode { node: key.name.to_string(), problem };
            for &access in &key.accesses {
                let (resource, [reads, writes]) = match access {
                    NodeAccess::Reads(resource) => (resource, [true, false]),
                    NodeAccess::Writes(resource) => (resource, [false, true]),
                    NodeAccess::Modifies(resource) => (resource, [true, true]),
                    NodeAccess::After(before) => {
                        let Some(before) = find(before) else {
                            return Err(refused(format!("runs after {before:?}, which is no node of the frame")));
                        };
                        graph.order(ids[before], id);
                        continue;
                    }
                };
                let (before, after) = stages_around(resource);
                if writes && !before.is_empty() {
                    return Err(refused(format!("writes {resource:?}, which only stages write")));
                }
                before.iter().flat_map(|stage| nodes_of(stage)).for_each(|stage| graph.order(stage, id));
                if writes {
                    // Not as readers: those that come before a writer see what was there before, and a stage must not.
                    after.iter().flat_map(|stage| nodes_of(stage)).for_each(|stage| graph.order(id, stage));
                }
                if !before.is_empty() {
                    continue;
                }
                let id_of_resource = graph.resource(resource_name(resource));
                if matches!(resource, NodeResource::Frame(_)) {
                    graph.import(id_of_resource);
                }
                if reads {
                    graph.read(id, id_of_resource);
                }
                if writes {
                    graph.write(id, id_of_resource);
                }
            }
        }
        Ok(())
    }
}

fn named_like_a_stage(node: &str) -> FrameError {
    FrameError::InvalidNode { node: node.to_owned(), problem: String::from("has the name of a stage of the frame") }
}

/// The stages that write a resource, and those that read it.
fn stages_around(resource: NodeResource) -> (&'static [&'static str], &'static [&'static str]) {
    match resource {
        NodeResource::Frame(FrameData::Transforms) => (&[], &["objects"]),
        NodeResource::Frame(FrameData::VisibleObjects) => (&["compact"], &[]),
        NodeResource::Frame(FrameData::DrawLists) => (&["join", "cull list"], &[]),
        NodeResource::Frame(FrameData::PassInputs) => (&[], &["prepare", "record", "finish"]),
        NodeResource::Frame(FrameData::RecordedPasses) => (&["finish"], &[]),
        NodeResource::Own(_) | NodeResource::Buffer { .. } => (&[], &[]),
    }
}

/// What a resource is called in a graph and its errors.
fn resource_name(resource: NodeResource) -> String {
    match resource {
        NodeResource::Frame(data) => format!("FrameData::{data:?}"),
        NodeResource::Own(name) => name.to_owned(),
        NodeResource::Buffer { name, identity } => format!("{name} (buffer {identity})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_graph_is_said_of_its_stages_or_of_its_nodes() {
        let error_of = |names: &[&str]| {
            let keys = names.iter().map(|name| NodeKey { name: Arc::from(*name), accesses: Vec::new() }).collect();
            NodeKeys { keys }.error_of(GraphProblem::DuplicateNode { name: "one".to_owned() })
        };
        assert!(matches!(error_of(&[]), FrameError::StageGraph(_)));
        assert!(matches!(error_of(&["one", "other"]), FrameError::InvalidNode { .. }), "a stage has the name");
        assert!(matches!(error_of(&["one", "one"]), FrameError::Nodes(_)));
    }
}
