//! What was counted, by stage and by place.

use std::collections::BTreeMap;

use crate::requests::Request;
use crate::stack::{self, AFTER, BEFORE, GRAPH, Owner, Place, SUBMIT, UNKNOWN};

/// The stages that are printed, in the order of a frame. A phase is called by its name in `src/frame/phase.rs`.
const STAGES: [&str; 15] = [
    BEFORE,
    "job Objects",
    "job Upload",
    "job Visibility",
    "job Compact",
    "job Fill",
    "job Sort",
    "job Instance",
    "job Prepare",
    "job Record",
    "job Finish",
    GRAPH,
    AFTER,
    SUBMIT,
    UNKNOWN,
];

/// The requests of some frames.
pub struct Report {
    frames: usize,
    places: BTreeMap<Place, usize>,
}

impl Report {
    pub fn new(requests: Vec<Request>, frames: usize) -> Self {
        let mut places = BTreeMap::new();
        for request in requests {
            *places.entry(stack::read(&request.stack)).or_default() += request.count;
        }
        Self { frames, places }
    }

    /// How many requests are of this owner, over all frames.
    pub fn requests_of(&self, owner: Owner) -> usize {
        self.sum(|place| place.owner == owner)
    }

    /// How many requests are of these stages, over all frames.
    pub fn requests_in(&self, stages: &[&str]) -> usize {
        self.sum(|place| stages.contains(&place.stage.as_str()))
    }

    /// Prints requests a frame by stage; and every place, if it is to `show` them.
    pub fn print(&self, case: &str, show: bool) {
        println!("\n{case}: requests a frame, of {} frames", self.frames);
        println!("| {:<16} | {:>9} | {:>9} | {:>9} |", "stage", "drawloom", "wgpu", "others");
        println!("| ---------------- | --------: | --------: | --------: |");
        let others = self.places.keys().map(|place| place.stage.as_str()).filter(|stage| !STAGES.contains(stage));
        for stage in STAGES.into_iter().chain(others) {
            let [ours, wgpu, others] = [Owner::Drawloom, Owner::Wgpu, Owner::Nobody]
                .map(|owner| self.a_frame(self.sum(|place| place.stage == stage && place.owner == owner)));
            if ours + wgpu + others > 0.0 {
                println!("| {stage:<16} | {ours:>9.2} | {wgpu:>9.2} | {others:>9.2} |");
            }
        }
        if show {
            self.print_places();
        }
    }

    fn print_places(&self) {
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_by_key(|&(place, &count)| (place.owner, std::cmp::Reverse(count)));
        for (place, &count) in places {
            let Place { stage, owner, lines } = place;
            println!("{:>9.2} {owner:?}, {stage}: {}", self.a_frame(count), lines.join(" < "));
        }
    }

    fn sum(&self, is_wanted: impl Fn(&Place) -> bool) -> usize {
        self.places.iter().filter(|(place, _)| is_wanted(place)).map(|(_, count)| count).sum()
    }

    fn a_frame(&self, count: usize) -> f64 {
        count as f64 / self.frames as f64
    }
}
