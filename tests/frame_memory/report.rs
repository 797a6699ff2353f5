//! What was counted, by stage and by place.

use std::collections::BTreeMap;

use crate::requests::Request;
use crate::stack::{self, Owner, Place, Stage};

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

    /// How many requests are of this owner, at this stage, over all frames.
    pub fn requests_of(&self, owner: Owner, stage: Stage) -> usize {
        self.sum(|place| (place.owner, place.stage) == (owner, stage))
    }

    /// Prints requests a frame by stage; and every place, if it is to `show` them.
    pub fn print(&self, case: &str, show: bool) {
        println!("\n{case}: requests a frame, of {} frames", self.frames);
        println!("| {:<7} | {:>8} | {:>8} | {:>8} |", "stage", "drawloom", "wgpu", "others");
        println!("| ------- | -------: | -------: | -------: |");
        for stage in [Stage::Jobs, Stage::Around, Stage::Submit, Stage::Unknown] {
            let [ours, wgpu, others] =
                [Owner::Drawloom, Owner::Wgpu, Owner::Nobody].map(|owner| self.a_frame(self.requests_of(owner, stage)));
            let name = format!("{stage:?}").to_lowercase();
            println!("| {name:<7} | {ours:>8.2} | {wgpu:>8.2} | {others:>8.2} |");
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
            println!("{:>9.2} {owner:?}, {stage:?}: {}", self.a_frame(count), lines.join(" < "));
        }
    }

    fn sum(&self, is_wanted: impl Fn(&Place) -> bool) -> usize {
        self.places.iter().filter(|(place, _)| is_wanted(place)).map(|(_, count)| count).sum()
    }

    fn a_frame(&self, count: usize) -> f64 {
        count as f64 / self.frames as f64
    }
}
