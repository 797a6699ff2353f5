//! The times of the frames, as a table and as JSON.

use std::error::Error;
use std::fmt::{self, Display, Formatter};
use std::time::Duration;

use drawloom::FrameStatistics;
use drawloom_output::OutputFile;
use serde::Serialize;

use crate::arguments::{Arguments, BackendName, StrategyName};
use crate::content::Content;

/// The report on all frames.
#[derive(Serialize)]
pub struct Report {
    adapter: String,
    backend: &'static str,
    workers: usize,
    granularity: String,
    /// The recording strategy; `None` if it is tuned.
    record: Option<&'static str>,
    objects: usize,
    content: Content,
    frames: usize,
    views: Vec<View>,
    stages_ms: Stages,
    cpu_ms: Cpu,
    /// What was left out or drawn differently, of the median frame.
    scene_issues: Vec<SceneIssues>,
    /// Why the preferred backend did not draw the frames. It is printed, but not in the file.
    #[serde(skip)]
    reason: Option<String>,
}

/// Scene issues of one kind.
#[derive(Serialize)]
struct SceneIssues {
    kind: &'static str,
    count: usize,
    /// The number of the first object, light or material that was rejected.
    first: usize,
}

#[derive(Serialize)]
struct View {
    name: String,
    kind: &'static str,
    visible: usize,
    lights: usize,
    commands: usize,
    batches: usize,
    bundles: usize,
    /// Triangles that were tested.
    triangles: usize,
    /// Triangles that were culled.
    culled_triangles: usize,
}

/// Thread time, summed over workers, of the median frame.
#[derive(Serialize)]
struct Stages {
    visibility: f64,
    fill: f64,
    sort: f64,
    instance: f64,
    record: f64,
    submit: f64,
}

/// Wall time from the hand-over of the scene to the return of submit.
#[derive(Serialize)]
struct Cpu {
    median: f64,
    p95: f64,
}

impl Report {
    /// Creates the report from the measurements of each frame. There must be at least one frame.
    pub fn new(
        adapter: String,
        backend: BackendName,
        arguments: &Arguments,
        workers: usize,
        measured: &[(Duration, FrameStatistics)],
    ) -> Self {
        let mut by_time: Vec<_> = measured.iter().collect();
        by_time.sort_by_key(|(cpu, _)| *cpu);
        let at_share = |share: f64| by_time[((by_time.len() - 1) as f64 * share).round() as usize];
        let (median, frame) = at_share(0.5);
        let view = |view: &drawloom::ViewStatistics| View {
            name: view.name.clone(),
            kind: view.kind.name(),
            visible: view.visible,
            lights: view.lights,
            commands: view.commands,
            batches: view.batches,
            bundles: view.bundles,
            triangles: view.culled_triangles.triangles,
            culled_triangles: view.culled_triangles.culled(),
        };
        let scene_issues = frame.scene_issues.iter().map(|issue| SceneIssues {
            kind: issue.reason.name(),
            count: issue.count,
            first: issue.first,
        });
        Self {
            adapter,
            backend: backend.name(),
            workers,
            granularity: arguments.granularity.name(),
            record: arguments.record.map(StrategyName::name),
            objects: frame.objects,
            content: Content::default(),
            frames: measured.len(),
            views: frame.views.iter().map(view).collect(),
            stages_ms: Stages {
                visibility: milliseconds(frame.stages.visibility),
                fill: milliseconds(frame.stages.fill),
                sort: milliseconds(frame.stages.sort),
                instance: milliseconds(frame.stages.instance),
                record: milliseconds(frame.stages.record),
                submit: milliseconds(frame.stages.submit),
            },
            cpu_ms: Cpu { median: milliseconds(*median), p95: milliseconds(at_share(0.95).0) },
            scene_issues: scene_issues.collect(),
            reason: None,
        }
    }

    /// Adds why the preferred backend did not draw the frames.
    pub fn because(self, reason: Option<String>) -> Self {
        Self { reason, ..self }
    }

    /// Adds what the scene consists of.
    pub fn with_content(self, content: Content) -> Self {
        Self { content, ..self }
    }

    /// As JSON.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, file: &OutputFile) -> Result<(), Box<dyn Error>> {
        Ok(file.write_all(serde_json::to_string_pretty(self)? + "\n")?)
    }
}

/// As a table, without the end of the last line.
impl Display for Report {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let Self { adapter, backend, workers, granularity, objects, frames, .. } = self;
        let reason = self.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
        writeln!(formatter, "drawn by {adapter}{reason}")?;
        let record = self.record.map_or(String::new(), |record| format!(", {record}"));
        writeln!(formatter, "frames   {frames} on {backend}, {workers} workers, {granularity}{record}")?;
        let Content { triangles, vertices, .. } = self.content;
        writeln!(formatter, "objects  {objects} of {triangles} triangles and {vertices} vertices")?;
        for SceneIssues { kind, count, first } in &self.scene_issues {
            writeln!(formatter, "rejected: {count} × {kind}, the first is number {first}")?;
        }
        writeln!(formatter)?;
        writeln!(
            formatter,
            "{:<18} {:<8} {:>8} {:>7} {:>9} {:>8} {:>8}",
            "view", "kind", "visible", "lights", "commands", "batches", "bundles"
        )?;
        for view in &self.views {
            let View { name, kind, visible, lights, commands, batches, bundles, .. } = view;
            write!(formatter, "{name:<18} {kind:<8} {visible:>8} {lights:>7} {commands:>9} {batches:>8} {bundles:>8}")?;
            match view.triangles {
                0 => writeln!(formatter)?,
                tested => writeln!(formatter, "   {} of {tested} triangles left out", view.culled_triangles)?,
            }
        }
        writeln!(formatter)?;
        let stages = &self.stages_ms;
        for (stage, time) in [
            ("visibility", stages.visibility),
            ("fill", stages.fill),
            ("sort", stages.sort),
            ("instance", stages.instance),
            ("record", stages.record),
            ("submit", stages.submit),
        ] {
            writeln!(formatter, "{stage:<10} {time:>9.3} ms thread time")?;
        }
        write!(formatter, "{:<10} {:>9.3} ms, 95% within {:.3} ms", "cpu", self.cpu_ms.median, self.cpu_ms.p95)
    }
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
