//! The graph of a frame's stages.

use std::collections::HashMap;
use std::mem;
use std::time::Duration;

use drawloom::timeline::{Chunk, Graph, NodeInfo, Run};
use egui::{Align2, FontId, Painter, Pos2, Rect, ScrollArea, Sense, Stroke, Ui, pos2, vec2};

use crate::colors::{ACCENT, ON_GROUP, group_color};
use crate::frame_history::FrameRecord;

/// Shows the stage graph of a frame: a column for each step, in which nodes do not depend on each other.
#[derive(Debug)]
pub struct GraphView {
    hides_empty: bool,
}

const NODE: [f32; 2] = [150.0, 34.0];
const SPACE: [f32; 2] = [46.0, 10.0];

impl Default for GraphView {
    fn default() -> Self {
        Self { hides_empty: true }
    }
}

impl GraphView {
    /// Shows the graph of a frame.
    pub fn show(&mut self, ui: &mut Ui, record: Option<&FrameRecord>) {
        let Some(run) = record.and_then(FrameRecord::stage_run) else {
            ui.weak("No frame yet.");
            return;
        };
        ui.horizontal(|ui| {
            ui.label(format!("{} nodes", run.graph.nodes.len()));
            ui.checkbox(&mut self.hides_empty, "hide nodes without items");
            ui.weak("Point at a node for what it depends on.");
        });
        let cells = layout(&run.graph, |node| !self.hides_empty || run.width(node) > 0);
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            let extent = |axis: usize| cells.values().map(|cell| cell[axis] + 1).max().unwrap_or(1) as f32;
            let size = vec2(extent(0) * (NODE[0] + SPACE[0]), extent(1) * (NODE[1] + SPACE[1]));
            let (response, painter) = ui.allocate_painter(size, Sense::hover());
            let rect = |node: usize| {
                let [column, row] = cells[&node];
                let corner = vec2(column as f32 * (NODE[0] + SPACE[0]), row as f32 * (NODE[1] + SPACE[1]));
                Rect::from_min_size(response.rect.min + corner, NODE.into())
            };
            let pointer = response.hover_pos();
            let pointed =
                cells.keys().copied().find(|&node| pointer.is_some_and(|pointer| rect(node).contains(pointer)));
            let weak = Stroke::new(1.0, ui.visuals().weak_text_color());
            for &node in cells.keys() {
                for dependency in shown_dependencies(&run.graph, &cells, node) {
                    let is_pointed = pointed == Some(node) || pointed == Some(dependency);
                    let stroke = if is_pointed { Stroke::new(2.0, ACCENT) } else { weak };
                    draw_edge(&painter, rect(dependency).right_center(), rect(node).left_center(), stroke);
                }
            }
            for &node in cells.keys() {
                draw_node(&painter, run, node, rect(node));
            }
            if let Some(node) = pointed {
                response.on_hover_text_at_pointer(explanation(run, node));
            }
        });
    }
}

/// The column and the row of each shown node. A node's column is behind those of all that it depends on; in a column,
/// nodes stand in the order of the rows of their dependencies, so that few edges cross.
fn layout(graph: &Graph, is_shown: impl Fn(usize) -> bool) -> HashMap<usize, [usize; 2]> {
    let mut columns: Vec<Vec<usize>> = Vec::new();
    let mut column_of = vec![0; graph.nodes.len()];
    for (node, info) in graph.nodes.iter().enumerate() {
        let behind = |&dependency: &usize| column_of[dependency] + usize::from(is_shown(dependency));
        column_of[node] = info.dependencies.iter().map(behind).max().unwrap_or(0);
        if is_shown(node) {
            columns.resize_with(columns.len().max(column_of[node] + 1), Vec::new);
            columns[column_of[node]].push(node);
        }
    }
    let mut cells: HashMap<usize, [usize; 2]> = HashMap::new();
    for (column, nodes) in columns.iter_mut().enumerate() {
        let mean_row = |node: usize| {
            let rows = graph.nodes[node].dependencies.iter().filter_map(|dependency| cells.get(dependency));
            let (sum, count) = rows.fold((0, 0), |(sum, count), [_, row]| (sum + row, count + 1));
            if count == 0 { f64::INFINITY } else { sum as f64 / f64::from(count) }
        };
        nodes.sort_by(|&first, &second| mean_row(first).total_cmp(&mean_row(second)));
        cells.extend(nodes.iter().enumerate().map(|(row, &node)| (node, [column, row])));
    }
    cells
}

/// What a node depends on, through nodes that are not shown too.
fn shown_dependencies(graph: &Graph, cells: &HashMap<usize, [usize; 2]>, node: usize) -> Vec<usize> {
    let (mut found, mut is_seen) = (Vec::new(), vec![false; graph.nodes.len()]);
    let mut open = graph.nodes[node].dependencies.clone();
    while let Some(dependency) = open.pop() {
        if mem::replace(&mut is_seen[dependency], true) {
            continue;
        }
        if cells.contains_key(&dependency) {
            found.push(dependency);
        } else {
            open.extend(&graph.nodes[dependency].dependencies);
        }
    }
    found
}

fn draw_edge(painter: &Painter, from: Pos2, to: Pos2, stroke: Stroke) {
    let bend = pos2(to.x - SPACE[0] / 2.0, from.y);
    let corner = pos2(to.x - SPACE[0] / 2.0, to.y);
    painter.line_segment([from, bend], stroke);
    painter.line_segment([bend, corner], stroke);
    painter.line_segment([corner, to], stroke);
}

fn draw_node(painter: &Painter, run: &Run, node: usize, rect: Rect) {
    let info = &run.graph.nodes[node];
    let color = group_color(info.group());
    painter.rect_filled(rect, 3.0, if run.width(node) > 0 { color } else { color.gamma_multiply(0.4) });
    let clipped = painter.with_clip_rect(rect.shrink(3.0).intersect(painter.clip_rect()));
    let (first, second) = lines(info);
    let corner = rect.left_top() + vec2(5.0, 3.0);
    clipped.text(corner, Align2::LEFT_TOP, first, FontId::proportional(12.0), ON_GROUP);
    let second = format!("{second}{:.0} µs", time(run, node));
    clipped.text(corner + vec2(0.0, 15.0), Align2::LEFT_TOP, second, FontId::proportional(10.0), ON_GROUP);
}

/// What stands in a node: the stage, and what it is for.
fn lines(info: &NodeInfo) -> (&str, String) {
    let stage = info.labels.stage.as_deref().unwrap_or(&info.name);
    let owners = [info.labels.process.as_deref(), info.labels.view.as_deref()];
    (stage, owners.into_iter().flatten().map(|owner| format!("{owner}, ")).collect())
}

fn explanation(run: &Run, node: usize) -> String {
    let info = &run.graph.nodes[node];
    let dependencies: Vec<_> =
        info.dependencies.iter().map(|&dependency| format!("\n  {}", run.graph.nodes[dependency].name)).collect();
    let chunks = run.chunks_of(node).len();
    let place = if info.pinned { ", on the calling thread" } else { "" };
    format!(
        "{}\n{} items in {chunks} chunks, {:.1} µs of thread time{place}\ndepends on{}",
        info.name,
        run.width(node),
        time(run, node),
        if dependencies.is_empty() { " nothing".into() } else { dependencies.concat() },
    )
}

/// The thread time of a node, in µs.
fn time(run: &Run, node: usize) -> f64 {
    run.chunks_of(node).iter().map(Chunk::duration).sum::<Duration>().as_secs_f64() * 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(dependencies: &[&[usize]]) -> Graph {
        let node = |dependencies: &&[usize]| NodeInfo { dependencies: dependencies.to_vec(), ..NodeInfo::default() };
        Graph { nodes: dependencies.iter().map(node).collect() }
    }

    #[test]
    fn nodes_stand_behind_what_they_depend_on() {
        let graph = graph(&[&[], &[], &[0, 1], &[2], &[1]]);
        let cells = layout(&graph, |_| true);
        assert_eq!([0, 1, 2, 3, 4].map(|node| cells[&node][0]), [0, 0, 1, 2, 1]);
        assert_ne!(cells[&2][1], cells[&4][1]);
    }

    #[test]
    fn a_node_that_is_hidden_takes_no_column_and_leaves_its_edges() {
        let graph = graph(&[&[], &[0], &[1], &[1]]);
        let cells = layout(&graph, |node| node != 1);
        assert_eq!(cells.get(&1), None);
        assert_eq!([0, 2, 3].map(|node| cells[&node]), [[0, 0], [1, 0], [1, 1]]);
        assert_eq!(shown_dependencies(&graph, &cells, 2), [0]);
    }

    #[test]
    fn nodes_stand_in_the_order_of_what_they_depend_on() {
        let cells = layout(&graph(&[&[], &[], &[1], &[0]]), |_| true);
        assert_eq!((cells[&3], cells[&2]), ([1, 0], [1, 1]));
    }
}
