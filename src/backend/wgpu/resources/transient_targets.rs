//! Which targets share textures because their lives do not overlap.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::target_texture::TextureKind;
use crate::process::{Access, FramePlan, Pass, PlannedTarget, SampledViews};
use crate::view::RenderView;

/// Which targets of a frame are transient, and the textures that they share.
///
/// The life of a view's target begins with the first pass that uses it and ends with the last one, in submission order.
/// Passes of other views that sample it count. What a texture holds when a life begins is undefined, so that first pass
/// must overwrite the target.
#[derive(Debug, Default)]
pub(crate) struct TransientTargets {
    /// For each view a slice of one entry for each of the plan's targets: the index of the texture, `None` for targets
    /// with a texture of their own.
    assigned: Vec<Option<usize>>,
    /// The number of the plan's targets.
    target_count: usize,
    textures: Vec<TextureKind>,
}

/// The passes of a frame that use a view's target, by index in submission order.
#[derive(Clone, Copy)]
struct Life {
    first: usize,
    last: usize,
    /// Whether the first pass overwrites the target.
    is_overwritten: bool,
}

impl TransientTargets {
    /// Assigns textures to the targets of these views. `passes` are at least those that [use transient
    /// targets](uses_transient). Targets for which `is_left_out` is true, by the indices of view and target, have
    /// textures of their own or of the engine's.
    pub(crate) fn new(
        plan: &FramePlan,
        views: &[RenderView],
        (passes, sampled_views): (&[Pass], &SampledViews),
        is_left_out: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let targets = plan.targets();
        let lives = lives(plan, views, passes, sampled_views);
        let can_be_transient: Vec<_> = targets.iter().map(|planned| can_be_transient(plan, planned)).collect();
        let mut transient: Vec<(usize, Option<Life>, TextureKind)> = Vec::new();
        for (view_index, view) in views.iter().enumerate().filter(|(_, view)| view.camera.redraw.is_every_frame()) {
            let own = targets.iter().enumerate().filter(|(_, planned)| planned.views == view.kind());
            for (target_index, planned) in own.filter(|(index, _)| can_be_transient[*index]) {
                let index = view_index * targets.len() + target_index;
                let life = lives[index];
                if life.is_some_and(|life| !life.is_overwritten) || is_left_out(view_index, target_index) {
                    continue;
                }
                transient.push((index, life, TextureKind::of(planned, view.camera.size)));
            }
        }
        // Those that no pass uses come last, so that they need no textures of their own.
        transient.sort_by_key(|(_, life, _)| life.map_or(usize::MAX, |life| life.first));

        let (mut assigned, mut textures) = (vec![None; lives.len()], Vec::new());
        // For each kind of texture the last pass that uses it so far, and its index.
        let mut in_use: HashMap<TextureKind, BinaryHeap<Reverse<(usize, usize)>>> = HashMap::new();
        for (index, life, texture) in transient {
            let in_use = in_use.entry(texture).or_default();
            let is_free = |last: usize| life.is_none_or(|life| last < life.first);
            let free = in_use.peek().filter(|Reverse((last, _))| is_free(*last)).map(|Reverse((_, free))| *free);
            if free.is_some() {
                in_use.pop();
            }
            let free = free.unwrap_or_else(|| {
                textures.push(texture);
                textures.len() - 1
            });
            in_use.push(Reverse((life.map_or(0, |life| life.last), free)));
            assigned[index] = Some(free);
        }
        Self { assigned, target_count: targets.len(), textures }
    }

    /// The textures that targets share.
    pub(crate) fn textures(&self) -> &[TextureKind] {
        &self.textures
    }

    /// The index of the texture of a view's target, by the index of the target in the plan; `None` if it has a texture
    /// of its own.
    pub(crate) fn texture_of(&self, view_index: usize, target_index: usize) -> Option<usize> {
        self.assigned.get(view_index * self.target_count + target_index).copied().flatten()
    }
}

/// Whether a pass may use transient targets. The others may come and go, as views are cached, without a change of the
/// textures that targets have.
pub(crate) fn uses_transient(plan: &FramePlan, views: &[RenderView], pass: Pass) -> bool {
    let declaration = &plan.processes()[pass.process_index].declaration;
    let samples_view = |(_, access): &(String, Access)| matches!(access, Access::SampleView(..));
    views[pass.view_index].camera.redraw.is_every_frame() || declaration.accesses.iter().any(samples_view)
}

/// Whether nothing outside of a frame uses the target.
fn can_be_transient(plan: &FramePlan, planned: &PlannedTarget) -> bool {
    // Copied at the end of the frame.
    let has_history = plan
        .targets()
        .iter()
        .any(|copy| copy.views == planned.views && copy.copy_of.as_deref() == Some(planned.name.as_str()));
    !(planned.output || planned.layered || planned.copy_of.is_some() || has_history)
}

/// The life of each of the plan's targets in each view; `None` for those that no pass uses.
fn lives(plan: &FramePlan, views: &[RenderView], passes: &[Pass], sampled_views: &SampledViews) -> Vec<Option<Life>> {
    let targets = plan.targets();
    let mut lives: Vec<Option<Life>> = vec![None; views.len() * targets.len()];
    for (pass_index, pass) in passes.iter().enumerate() {
        for &(target_index, access) in &plan.processes()[pass.process_index].targets.accesses {
            let sampled = match access {
                Access::SampleView(_, index) => sampled_views.find(*pass, index),
                // An array and a history, which are not transient.
                Access::SampleLayers(_) | Access::SampleViewPrevious(..) => &[],
                _ => &[Some(pass.view_index)],
            };
            // No process draws a view that has another kind than the target.
            let views = sampled.iter().flatten().filter(|view| views[**view].kind() == targets[target_index].views);
            for view_index in views {
                let overwrites = access.format().is_some();
                let life = &mut lives[view_index * targets.len() + target_index];
                let life = life.get_or_insert(Life { first: pass_index, last: pass_index, is_overwritten: overwrites });
                life.last = pass_index;
                life.is_overwritten &= overwrites || pass_index > life.first;
            }
        }
    }
    lives
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};
    use std::sync::Arc;

    use fastrand::Rng;
    use glam::DVec3;

    use super::*;
    use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, TargetSize};
    use crate::scene::{Camera, Redraw, ViewKind};

    /// A process that reads and writes at random.
    #[derive(Default)]
    struct RandomProcess {
        name: String,
        kinds: Vec<ViewKind>,
        once_a_frame: bool,
        /// Each with whether it is overwritten first, whether it is smaller, and whether a raw pass writes it.
        writes: Vec<(String, bool, bool, bool)>,
        samples: Vec<String>,
        samples_previous: Vec<String>,
        /// Each with whether it is what the view held in the frame before.
        samples_views: Vec<(ViewKind, &'static str, String, bool)>,
        after: Option<String>,
    }

    impl RenderProcess for RandomProcess {
        fn name(&self) -> &str {
            &self.name
        }

        fn declare(&self, declare: &mut Declare) {
            declare.views(self.kinds[0]);
            self.kinds[1..].iter().for_each(|kind| declare.also_views(*kind));
            for (target, is_overwritten, is_small, is_raw) in &self.writes {
                match (is_overwritten, is_raw) {
                    (true, false) => declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Background),
                    (true, true) => declare.writes(target, Format::Rgba8Unorm),
                    (false, false) => declare.draws_over(target),
                    (false, true) => declare.changes(target),
                }
                if *is_overwritten && target.ends_with('1') {
                    declare.mipmapped(target);
                }
                if *is_overwritten && *is_small {
                    declare.size(target, TargetSize::Divided(2));
                }
            }
            self.samples.iter().for_each(|target| declare.samples(target));
            self.samples_previous.iter().for_each(|target| declare.samples_previous(target));
            for (kind, view, target, is_previous) in &self.samples_views {
                if *is_previous {
                    declare.samples_view_previous(*kind, view, target);
                } else {
                    declare.samples_view(*kind, view, target);
                }
            }
            if self.once_a_frame {
                declare.once_a_frame();
            }
            self.after.iter().for_each(|after| declare.after(after));
            declare.keep();
        }

        fn draws(&self) -> Draws<'_> {
            Draws::FullScreen(FullScreen::default())
        }
    }

    fn random_processes(random: &mut Rng) -> Vec<Arc<dyn RenderProcess>> {
        use ViewKind::{Main, Reflection, Shadow};
        // The targets that all views of a kind have so far, and whether they are small.
        let mut known: HashMap<ViewKind, Vec<(String, bool)>> = HashMap::new();
        // The same, with those that only one view of the kind draws.
        let mut created: HashMap<ViewKind, Vec<String>> = HashMap::new();
        let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
        for index in 0..random.usize(2..9) {
            let kinds = match random.usize(0..6) {
                0 => vec![Reflection],
                1 => vec![Shadow],
                2 | 3 => vec![Main],
                _ => vec![Main, Reflection],
            };
            let kind = kinds[0];
            let in_all = |known: &HashMap<ViewKind, Vec<(String, bool)>>| {
                let of = |kind: &ViewKind| known.get(kind).cloned().unwrap_or_default();
                of(&kind).into_iter().filter(|target| kinds.iter().all(|kind| of(kind).contains(target))).collect()
            };
            let usable: Vec<(String, bool)> = in_all(&known);
            let mut process = RandomProcess { name: format!("process {index}"), kinds, ..RandomProcess::default() };
            process.once_a_frame = random.usize(0..8) == 0;
            let (is_small, is_raw) = (random.bool(), random.usize(0..4) == 0);
            for (target, small) in &usable {
                match random.usize(0..6) {
                    0 if *small == is_small && !process.once_a_frame => {
                        process.writes.push((target.clone(), false, *small, is_raw));
                    }
                    1 | 2 => process.samples.push(target.clone()),
                    3 if random.usize(0..4) == 0 => process.samples_previous.push(target.clone()),
                    _ => {}
                }
            }
            for new in 0..random.usize(0..3) {
                // Some targets are overwritten again by later processes.
                let again = usable.iter().filter(|(target, small)| {
                    *small == is_small
                        && !process.samples.contains(target)
                        && process.writes.iter().all(|(written, ..)| written != target)
                });
                let again = again.map(|(target, _)| target.clone()).next().filter(|_| random.usize(0..3) == 0);
                let target = again.unwrap_or_else(|| format!("target {index}.{new}"));
                process.writes.push((target, true, is_small, is_raw));
            }
            let (sampled, names) = match process.kinds[..] {
                [Main] => (Reflection, ["mirror", "portal"]),
                [Shadow] => (Main, ["main", "other"]),
                _ => (Main, ["", ""]),
            };
            for target in created.get(&sampled).into_iter().flatten().filter(|_| !names[0].is_empty()) {
                if random.usize(0..3) == 0 {
                    let is_previous = random.usize(0..4) == 0;
                    process.samples_views.push((sampled, names[random.usize(0..2)], target.clone(), is_previous));
                }
            }
            for kind in &process.kinds {
                let writes = process.writes.iter().filter(|(_, is_overwritten, ..)| *is_overwritten);
                created.entry(*kind).or_default().extend(writes.clone().map(|(target, ..)| target.clone()));
                let known = known.entry(*kind).or_default();
                let writes = writes.filter(|_| !process.once_a_frame);
                known.extend(writes.map(|(target, _, small, _)| (target.clone(), *small)));
                known.sort();
                known.dedup();
            }
            process.after = index.checked_sub(1).map(|before| format!("process {before}"));
            processes.push(Arc::new(process));
        }
        processes
    }

    fn random_views(random: &mut Rng) -> Vec<RenderView> {
        let names = ["main", "other", "mirror", "main/mirror", "other/mirror", "other/portal"];
        let count = random.usize(1..8);
        let view = |_| {
            let index = random.usize(0..names.len());
            let kind = match (index, random.usize(0..6)) {
                (_, 0) => ViewKind::Shadow,
                (..=1, _) => ViewKind::Main,
                _ => ViewKind::Reflection,
            };
            let size = [[64, 32], [64, 32], [17, 90]][random.usize(0..3)];
            let redraw = if random.u8(0..4) == 0 { Redraw::Interval(2) } else { Redraw::EveryFrame };
            let camera = Camera { kind, size, redraw, ..Camera::looking_at(names[index], DVec3::Z, DVec3::ZERO) };
            let age = if redraw.is_every_frame() { 0 } else { random.u32(0..2) };
            RenderView { age, ..RenderView::new(&camera) }
        };
        (0..count).map(view).collect()
    }

    /// The indices of a view and of a target.
    type ViewAndTarget = (usize, usize);

    /// Where a view's target is: in a texture that it shares, or in its own.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    enum Storage {
        Shared(usize),
        Own(usize, usize),
    }

    /// A frame of a random plan and views.
    struct RandomFrame {
        plan: FramePlan,
        views: Vec<RenderView>,
        passes: Vec<Pass>,
        sampled_views: SampledViews,
        imported: HashSet<(usize, String)>,
        transient: TransientTargets,
    }

    impl RandomFrame {
        /// `None` if the processes make no plan, or the views sample each other.
        fn new(seed: u64) -> Option<Self> {
            let mut random = Rng::with_seed(seed);
            let processes = random_processes(&mut random);
            let outputs: Vec<_> = (0..processes.len())
                .filter(|_| random.usize(0..4) == 0)
                .map(|index| format!("target {index}.0"))
                .collect();
            let plan = FramePlan::new(processes, &outputs).ok()?;
            let views = random_views(&mut random);
            let frame_passes = plan.passes(&views).ok()?;
            let (passes, sampled_views) = (frame_passes.passes, frame_passes.sampled_views);
            let mut imported = HashSet::new();
            for (index, view) in views.iter().enumerate() {
                let own = plan.targets().iter().filter(|target| target.views == view.kind());
                let some = own.filter(|_| random.usize(0..12) == 0);
                imported.extend(some.map(|target| (index, target.name.clone())));
            }
            let is_imported =
                |view: usize, target: usize| imported.contains(&(view, plan.targets()[target].name.clone()));
            let used: Vec<_> = passes.iter().copied().filter(|pass| uses_transient(&plan, &views, *pass)).collect();
            let transient = TransientTargets::new(&plan, &views, (&used, &sampled_views), is_imported);
            Some(Self { plan, views, passes, sampled_views, imported, transient })
        }

        /// The index of a target by the view's kind and its name.
        fn target(&self, view: usize, name: &str) -> Option<usize> {
            let kind = self.views[view].kind();
            self.plan.targets().iter().position(|target| target.views == kind && target.name == name)
        }

        fn storage(&self, view: usize, target: usize) -> Storage {
            self.transient.texture_of(view, target).map_or(Storage::Own(view, target), Storage::Shared)
        }

        /// What a pass reads, and then what it overwrites or changes: views and targets.
        fn uses(&self, pass: Pass) -> (Vec<ViewAndTarget>, Vec<ViewAndTarget>) {
            let (mut reads, mut writes) = (Vec::new(), Vec::new());
            let own = pass.view_index;
            for (name, access) in &self.plan.processes()[pass.process_index].declaration.accesses {
                let found = |view| (view, self.target(view, name).unwrap());
                match access {
                    Access::ClearColor(..) | Access::Write(_) => writes.push(found(own)),
                    Access::DrawOver | Access::Change => {
                        reads.push(found(own));
                        writes.push(found(own));
                    }
                    Access::Sample | Access::SamplePrevious => reads.push(found(own)),
                    // No process may draw in that kind of view.
                    Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
                        let sampled = self.sampled_views.find(pass, *index).iter().flatten();
                        reads.extend(sampled.filter_map(|view| Some((*view, self.target(*view, name)?))));
                    }
                    other => panic!("{other:?} is not among the random accesses"),
                }
            }
            (reads, writes)
        }

        /// Runs the frame twice, and fails where a texture holds another target than the one that is read.
        fn check_contents(&self) {
            let mut contents: HashMap<Storage, (usize, usize)> = HashMap::new();
            for _ in 0..2 {
                for pass in &self.passes {
                    let (reads, writes) = self.uses(*pass);
                    let used: HashSet<_> = reads.iter().chain(&writes).copied().collect();
                    let storages: HashSet<_> = used.iter().map(|&(view, target)| self.storage(view, target)).collect();
                    assert_eq!(used.len(), storages.len(), "{pass:?} uses one texture as two targets");
                    for (view, target) in reads {
                        let storage = self.storage(view, target);
                        let content = contents.get(&storage).copied();
                        // A history, a cached view, or what is drawn in one view only.
                        let is_empty = content.is_none() && matches!(storage, Storage::Own(..));
                        assert!(content == Some((view, target)) || is_empty, "{pass:?} reads {content:?}");
                    }
                    contents
                        .extend(writes.into_iter().map(|(view, target)| (self.storage(view, target), (view, target))));
                }
                for (view, target, planned) in self.targets() {
                    let held = |target| contents.get(&self.storage(view, target)).copied();
                    let is_drawn = self.passes.iter().any(|pass| self.uses(*pass).1.contains(&(view, target)));
                    assert!(!planned.output || !is_drawn || held(target) == Some((view, target)), "an output is lost");
                    if let Some(source) = &planned.copy_of {
                        let source = self.target(view, source).unwrap();
                        let is_drawn = self.passes.iter().any(|pass| self.uses(*pass).1.contains(&(view, source)));
                        assert!(!is_drawn || held(source) == Some((view, source)), "a history is lost");
                        contents.insert(self.storage(view, target), (view, target));
                    }
                }
            }
        }

        fn targets(&self) -> impl Iterator<Item = (usize, usize, &PlannedTarget)> {
            let of_view = |(index, view): (usize, &RenderView)| {
                let (targets, kind) = (self.plan.targets().iter().enumerate(), view.kind());
                targets
                    .filter(move |(_, planned)| planned.views == kind)
                    .map(move |(target, planned)| (index, target, planned))
            };
            self.views.iter().enumerate().flat_map(of_view).collect::<Vec<_>>().into_iter()
        }

        /// Fails unless textures fit their targets and are as few as possible. Returns the number of transient targets.
        fn check_textures(&self) -> usize {
            let mut sharing: HashMap<usize, Vec<(usize, usize)>> = HashMap::new();
            for (view, target, planned) in self.targets() {
                let Some(texture) = self.transient.texture_of(view, target) else { continue };
                sharing.entry(texture).or_default().push((view, target));
                let kind = self.transient.textures()[texture];
                let [width, height] = planned.size.in_view(self.views[view].camera.size);
                assert_eq!((kind.format, kind.size), (planned.format, [width, height]));
                assert_eq!((kind.stored, kind.mipmapped), (planned.stored, planned.mipmapped));
                assert!(!self.imported.contains(&(view, planned.name.clone())), "an imported target is transient");
                assert!(!planned.output && planned.copy_of.is_none());
                assert!(self.views[view].camera.redraw.is_every_frame(), "the target of a cached view is transient");
            }
            assert_eq!(sharing.len(), self.transient.textures().len(), "a texture is not used");
            for kind in self.transient.textures() {
                let textures = self.transient.textures().iter().filter(|other| *other == kind).count();
                let alike: Vec<_> =
                    sharing.iter().filter(|(texture, _)| self.transient.textures()[**texture] == *kind).collect();
                // At each pass, the targets that were used before or are used now, and will be or are.
                let used: Vec<HashSet<_>> = self
                    .passes
                    .iter()
                    .map(|pass| self.uses(*pass))
                    .map(|(reads, writes)| reads.into_iter().chain(writes).collect())
                    .collect();
                let alive = |index: usize| {
                    let targets = alike.iter().flat_map(|(_, targets)| targets.iter());
                    let is_alive = |target: &&(usize, usize)| {
                        used[..=index].iter().any(|used| used.contains(*target))
                            && used[index..].iter().any(|used| used.contains(*target))
                    };
                    targets.filter(is_alive).count()
                };
                let needed = (0..self.passes.len()).map(alive).max().unwrap_or(0).max(1);
                assert_eq!(textures, needed, "{kind:?}");
            }
            sharing.values().map(Vec::len).sum()
        }
    }

    #[test]
    fn no_pass_reads_what_another_target_left_in_a_texture() {
        let (mut frames, mut targets, mut textures) = (0, 0, 0);
        for seed in 0..3_000 {
            let Some(frame) = RandomFrame::new(seed) else { continue };
            let checked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                frame.check_contents();
                frame.check_textures()
            }));
            let Ok(transient) = checked else { panic!("seed {seed}: {:?} {:?}", frame.passes, frame.transient) };
            frames += 1;
            targets += transient;
            textures += frame.transient.textures().len();
        }
        assert!(
            frames > 1_000 && targets > 3 * textures / 2,
            "{frames} frames, {targets} targets in {textures} textures"
        );
    }
}
