//! After which passes of a frame mip levels are generated.

use std::collections::BTreeMap;

use crate::process::{Access, FramePlan, Pass, SampledViews};
use crate::view::RenderView;

/// After which passes of a frame the mip levels of which targets are generated.
///
/// That is after the last pass that writes a view's target before a pass samples it, or before the frame ends. So at
/// the end of a frame all levels match level 0: histories are copies of them, and a view whose picture is cached needs
/// none.
#[derive(Debug, Default)]
pub(crate) struct MipSchedule {
    /// By the index of the pass, the indices of views and of the plan's targets.
    after: BTreeMap<usize, Vec<(usize, usize)>>,
}

impl MipSchedule {
    /// The schedule of a frame. Allocates nothing if no target has mip levels.
    pub(crate) fn new(
        plan: &FramePlan,
        views: &[RenderView],
        (passes, sampled_views): (&[Pass], &SampledViews),
    ) -> Self {
        let mut schedule = Self::default();
        if !plan.targets().iter().any(|planned| planned.mipmapped) {
            return schedule;
        }
        // The targets whose levels are out of date, each with the last pass that wrote it.
        let mut outdated: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (index, pass) in passes.iter().enumerate() {
            let accesses = &plan.processes()[pass.process_index].targets.accesses;
            let mipmapped = |view: usize, target: usize| {
                let planned = &plan.targets()[target];
                (planned.mipmapped && planned.views == views[view].kind()).then_some((view, target))
            };
            for &(target, access) in accesses {
                let sampled = match access {
                    Access::Sample | Access::Read | Access::Change => &[Some(pass.view_index)],
                    Access::SampleView(_, sampled) => sampled_views.find(*pass, sampled),
                    _ => &[],
                };
                for target in sampled.iter().flatten().filter_map(|view| mipmapped(*view, target)) {
                    if let Some(writer) = outdated.remove(&target) {
                        schedule.after.entry(writer).or_default().push(target);
                    }
                }
            }
            let written = accesses.iter().filter(|(_, access)| access.writes());
            let written = written.filter_map(|(target, _)| mipmapped(pass.view_index, *target));
            outdated.extend(written.map(|target| (target, index)));
        }
        for (target, writer) in outdated {
            schedule.after.entry(writer).or_default().push(target);
        }
        schedule
    }

    /// The targets whose levels are generated after a pass, by its index in the frame: the indices of their views, and
    /// those of the plan's targets.
    pub(crate) fn after(&self, pass: usize) -> &[(usize, usize)] {
        self.after.get(&pass).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::sync::Arc;

    use fastrand::Rng;
    use glam::DVec3;

    use super::*;
    use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, PlannedTarget, RenderProcess};
    use crate::scene::{Camera, ViewKind};

    /// A process that creates a target with mip levels, and draws over and samples others at random.
    struct RandomProcess {
        name: String,
        creates: String,
        is_mipmapped: bool,
        draws_over: Vec<String>,
        samples: Vec<String>,
        samples_mirror: Vec<String>,
        after: Option<String>,
    }

    impl RenderProcess for RandomProcess {
        fn name(&self) -> &str {
            &self.name
        }

        fn declare(&self, declare: &mut Declare) {
            declare.also_views(ViewKind::Reflection);
            declare.clears_color(&self.creates, Format::Rgba8Unorm, ClearColor::Background);
            if self.is_mipmapped {
                declare.mipmapped(&self.creates);
            }
            self.draws_over.iter().for_each(|target| declare.draws_over(target));
            self.samples.iter().for_each(|target| declare.samples(target));
            for target in &self.samples_mirror {
                declare.samples_view(ViewKind::Reflection, "mirror", target);
            }
            self.after.iter().for_each(|after| declare.after(after));
            declare.keep();
        }

        fn draws(&self) -> Draws<'_> {
            Draws::FullScreen(FullScreen::default())
        }
    }

    fn random_processes(random: &mut Rng) -> Vec<Arc<dyn RenderProcess>> {
        let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
        for index in 0..random.usize(1..8) {
            let mut process = RandomProcess {
                name: format!("process {index}"),
                creates: format!("target {index}"),
                is_mipmapped: random.usize(0..4) > 0,
                draws_over: Vec::new(),
                samples: Vec::new(),
                samples_mirror: Vec::new(),
                after: index.checked_sub(1).map(|before| format!("process {before}")),
            };
            for target in (0..index).map(|known| format!("target {known}")) {
                match random.usize(0..4) {
                    0 => process.draws_over.push(target),
                    1 => process.samples.push(target),
                    2 => process.samples_mirror.push(target),
                    _ => {}
                }
            }
            processes.push(Arc::new(process));
        }
        processes
    }

    #[test]
    fn what_is_sampled_has_levels_that_are_up_to_date() {
        let (mut frames, mut generations, mut repeated) = (0, 0, 0);
        for seed in 0..500 {
            let mut random = Rng::with_seed(seed);
            let Ok(plan) = FramePlan::new(random_processes(&mut random), &[]) else { continue };
            let view = |name: &str, kind: ViewKind| {
                RenderView::new(&Camera { kind, ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO) })
            };
            let names = [("main", ViewKind::Main), ("mirror", ViewKind::Reflection), ("other", ViewKind::Reflection)];
            let views: Vec<_> = names[..random.usize(1..4)].iter().map(|(name, kind)| view(name, *kind)).collect();
            let Ok(frame) = plan.passes(&views) else { continue };
            let schedule = MipSchedule::new(&plan, &views, (&frame.passes, &frame.sampled_views));
            let (mut outdated, mut generated): (HashSet<(usize, usize)>, HashSet<_>) = Default::default();
            for (index, pass) in frame.passes.iter().enumerate() {
                let find = |view: usize, name: &str| {
                    let is_wanted = |target: &PlannedTarget| target.name == name && target.views == views[view].kind();
                    let target = plan.targets().iter().position(is_wanted).unwrap();
                    plan.targets()[target].mipmapped.then_some((view, target))
                };
                for (name, access) in &plan.processes()[pass.process_index].declaration.accesses {
                    let sampled = match access {
                        Access::Sample => find(pass.view_index, name),
                        Access::SampleView(_, view) => {
                            frame.sampled_views.find(*pass, *view)[0].and_then(|view| find(view, name))
                        }
                        _ => None,
                    };
                    assert!(sampled.is_none_or(|target| !outdated.contains(&target)), "seed {seed}: {pass:?} {name}");
                    outdated.extend(find(pass.view_index, name).filter(|_| access.writes()));
                }
                for target in schedule.after(index) {
                    assert!(outdated.remove(target), "seed {seed}: {target:?} after {pass:?} is up to date already");
                    generations += 1;
                    repeated += usize::from(!generated.insert(*target));
                }
            }
            assert!(outdated.is_empty(), "seed {seed}: {outdated:?} at the end");
            frames += 1;
        }
        assert!(frames > 300 && generations > 1_000 && repeated > 50, "{frames} {generations} {repeated}");
    }
}
