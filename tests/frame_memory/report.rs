//! Allocations by phase and by call site.

use std::collections::BTreeMap;

use crate::counting_allocator::AllocationSite;
use crate::stack::{self, CallSite, Owner, Phase};

/// The allocations of a number of frames.
pub struct Report {
    frames: usize,
    call_sites: BTreeMap<CallSite, usize>,
}

impl Report {
    pub fn new(sites: Vec<AllocationSite>, frames: usize) -> Self {
        let mut call_sites = BTreeMap::new();
        for site in sites {
            *call_sites.entry(stack::read(&site.backtrace)).or_default() += site.count;
        }
        Self { frames, call_sites }
    }

    /// The number of this owner's allocations at this phase, over all frames.
    pub fn allocations_of(&self, owner: Owner, phase: Phase) -> usize {
        self.sum(|site| (site.owner, site.phase) == (owner, phase))
    }

    /// Prints the allocations per frame by phase, and all call sites if `show` is set.
    pub fn print(&self, case: &str, show: bool) {
        println!("\n{case}: allocations per frame, mean of {} frames", self.frames);
        println!("| {:<7} | {:>8} | {:>8} | {:>8} |", "phase", "drawloom", "wgpu", "others");
        println!("| ------- | -------: | -------: | -------: |");
        for phase in [Phase::Jobs, Phase::Around, Phase::Submit, Phase::Unknown] {
            let [drawloom, wgpu, others] = [Owner::Drawloom, Owner::Wgpu, Owner::Other]
                .map(|owner| self.per_frame(self.allocations_of(owner, phase)));
            let name = format!("{phase:?}").to_lowercase();
            println!("| {name:<7} | {drawloom:>8.2} | {wgpu:>8.2} | {others:>8.2} |");
        }
        if show {
            self.print_call_sites();
        }
    }

    fn print_call_sites(&self) {
        let mut call_sites: Vec<_> = self.call_sites.iter().collect();
        call_sites.sort_by_key(|&(site, &count)| (site.owner, std::cmp::Reverse(count)));
        for (site, &count) in call_sites {
            let CallSite { phase, owner, lines } = site;
            println!("{:>9.2} {owner:?}, {phase:?}: {}", self.per_frame(count), lines.join(" < "));
        }
    }

    fn sum(&self, is_counted: impl Fn(&CallSite) -> bool) -> usize {
        self.call_sites.iter().filter(|(site, _)| is_counted(site)).map(|(_, count)| count).sum()
    }

    fn per_frame(&self, count: usize) -> f64 {
        count as f64 / self.frames as f64
    }
}
