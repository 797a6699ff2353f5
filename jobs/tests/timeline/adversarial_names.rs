//! Names with special characters of HTML, JSON and Unicode, which break writers that do not escape, and a log of them.

use std::sync::Arc;
use std::time::Duration;

use drawloom_jobs::timeline::{
    Chunk, DeviceLog, DevicePass, Frame, Graph, Labels, Log, NodeInfo, Run, Span, WorkerLog,
};

/// Names that break writers that do not escape.
pub fn adversarial_names() -> Vec<String> {
    let plain =
        ["", "</script>", "</SCRIPT >", "<!--<script>", "]]>", "\"", "\\", "\\\"", "'", "&lt;&amp;", "{data}{script}"];
    let mut names: Vec<String> = plain.map(str::to_owned).into();
    names.push((0..=0x9f_u8).map(char::from).collect());
    names.push("\u{2028}\u{2029}\u{feff}\u{202e}\u{1f9f5}".to_owned());
    names.push("<\"\\".repeat(3_334));
    names
}

/// A log in which all names are from this list.
pub fn log_of(names: &[String]) -> Log {
    let labels = |name: &String| {
        let name = Some(Arc::from(name.as_str()));
        Labels { process: name.clone(), stage: name.clone(), view: name }
    };
    let node = |name: &String| NodeInfo { name: name.clone(), labels: labels(name), ..NodeInfo::default() };
    let graph = Arc::new(Graph { nodes: names.iter().map(node).collect() });
    let chunk = |node| Chunk { node, items: 0..1, ended: Duration::from_micros(9), ..Chunk::default() };
    let chunks = (0..names.len()).map(chunk).collect();
    let end = Duration::from_micros(10);
    let spans = names.iter().map(|name| Span { name: name.clone(), ended: end, ..Span::default() });
    let pass =
        |name: &String| DevicePass { process: name.clone(), view: name.clone(), ended: end, ..DevicePass::default() };
    Log {
        workers: names.iter().map(|name| WorkerLog { name: name.clone(), ..WorkerLog::default() }).collect(),
        threads: names.to_vec(),
        frames: vec![Frame { number: 0, began: Duration::ZERO, ended: end }],
        runs: vec![Run { graph, workers: 1, ended: end, complete: true, chunks, ..Run::default() }],
        spans: spans.collect(),
        device: Some(DeviceLog { name: names.concat(), error: end, passes: names.iter().map(pass).collect() }),
        ..Log::default()
    }
}
