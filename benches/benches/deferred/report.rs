//! The results, as tables and as JSON.

use std::io;
use std::time::Duration;

use drawloom_benches::results;
use drawloom_output::print_line;
use serde::Serialize;

use crate::{Extent, lights, pre_pass, shadows, volumes};

/// The results.
#[derive(Serialize)]
pub struct Report {
    extent: &'static str,
    /// On `noop` and on the adapter.
    rounds: [usize; 2],
    picture: [u32; 2],
    boxes: usize,
    adapter: Option<String>,
    pub lights: Vec<lights::Row>,
    pub volumes: Vec<volumes::Row>,
    pub shadows: Vec<shadows::Row>,
    pub depth_pre_pass: Vec<pre_pass::Row>,
}

impl Report {
    pub fn new(extent: &Extent, adapter: Option<String>) -> Self {
        Self {
            extent: extent.name,
            rounds: extent.rounds,
            picture: extent.picture,
            boxes: extent.boxes,
            adapter,
            lights: Vec::new(),
            volumes: Vec::new(),
            shadows: Vec::new(),
            depth_pre_pass: Vec::new(),
        }
    }

    pub fn print(&self) {
        let Self { extent, rounds: [noop, adapter_rounds], picture: [width, height], boxes, adapter, .. } = self;
        print_line!(
            "{extent} run: medians of {noop} frames on noop and {adapter_rounds} on the adapter, {width} × {height} pixels"
        );
        print_line!("{boxes} boxes in the field{}", if *extent == "full" { "" } else { " (meaningless figures)" });
        print_line!("adapter: {}", adapter.as_deref().unwrap_or("none"));
        print_line!(
            "CPU ms: from the scene's hand-over to the return of submit; device ms: from the call of submit until drawn\n"
        );
        lights::print(&self.lights);
        volumes::print(&self.volumes);
        shadows::print(&self.shadows);
        pre_pass::print(&self.depth_pre_pass);
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("deferred.json", self)
    }
}

pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
