//! The targets that a process uses, by index.

use super::planned_process::ColorTarget;
use super::resource_names::resource_name;
use super::{PlanError, PlannedProcess, PlannedTarget, TargetIndices};
use crate::process::{Access, Declaration, list_names, source_of_previous};
use crate::scene::ViewKind;

impl TargetIndices {
    /// The targets of a process among those of its plan.
    ///
    /// # Errors
    /// If there is no target of a name that the process uses: the graph took another resource for it.
    pub(super) fn new(planned: &PlannedProcess, targets: &[PlannedTarget]) -> Result<Self, PlanError> {
        let Declaration { views, accesses, resolves, .. } = &planned.declaration;
        let missing = |views: ViewKind, name: &str| {
            let known: Vec<_> = targets.iter().map(|known| resource_name(known.views, &known.name)).collect();
            PlanError::UnknownTarget {
                target: resource_name(views, name),
                processes: list_names([planned.name.as_str()].into_iter()),
                known: list_names(known.iter().map(String::as_str)),
            }
        };
        let mut indices = Self::default();
        for (name, access) in accesses {
            let of_views = access.views(*views);
            let index = match access {
                Access::SampleView(..) | Access::SampleViewPrevious(..) => sampled_target(targets, of_views, name),
                _ => target_index(targets, of_views, name),
            };
            let index = index.ok_or_else(|| missing(of_views, name))?;
            indices.accesses.push((index, *access));
            if access.is_depth() {
                indices.depth = Some((index, *access));
            }
            let clear = match access {
                Access::ClearColor(_, clear) => Some(*clear),
                Access::DrawOver => None,
                _ => continue,
            };
            let resolve = resolves.iter().find(|(source, _)| source == name);
            let into =
                resolve.map(|(_, into)| target_index(targets, *views, into).ok_or_else(|| missing(*views, into)));
            let resolved_into = into.transpose()?;
            indices.colors.push(ColorTarget { index, clear, resolved_into });
        }
        Ok(indices)
    }
}

/// The index of the target of this name in views of a kind.
pub(super) fn target_index(targets: &[PlannedTarget], views: ViewKind, name: &str) -> Option<usize> {
    targets.iter().position(|planned| planned.views == views && planned.name == name)
}

/// The index of the target of this name that a process samples in views of a kind. If no process of the frame draws
/// such views, it is the target of this name in views of another kind: its pixel has the same format. Where a history
/// has no copy for that reason, it is the target that it would be copied from.
pub(super) fn sampled_target(targets: &[PlannedTarget], views: ViewKind, name: &str) -> Option<usize> {
    let named = |name: &str| {
        target_index(targets, views, name).or_else(|| targets.iter().position(|target| target.name == name))
    };
    named(name).or_else(|| named(source_of_previous(name)?))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::FramePlan;
    use super::super::test_process::TestProcess;
    use super::*;
    use crate::process::{ClearColor, Declare, Format, RenderProcess, previous_name};

    fn process(name: &'static str, declare: impl Fn(&mut Declare) + Send + Sync + 'static) -> Arc<dyn RenderProcess> {
        Arc::new(TestProcess(name, move |declaration: &mut Declare| {
            declare(declaration);
            declaration.keep();
        }))
    }

    const BLACK: ClearColor = ClearColor::Value([0.0; 4]);

    /// Processes with targets of the same names in views of two kinds.
    fn plan() -> FramePlan {
        let surfaces = process("surfaces", |declare| {
            declare.also_views(ViewKind::Reflection);
            declare.clears_color("samples", Format::Rgba8Unorm, BLACK);
            declare.clears_color("other samples", Format::Rgba8Unorm, BLACK);
            declare.clears_depth("depth", Format::Depth32Float);
            for target in ["samples", "other samples", "depth"] {
                declare.multisampled(target);
            }
            declare.resolves("other samples", "resolved", Format::Rgba8Unorm);
        });
        let picture = process("picture", |declare| {
            declare.samples("resolved");
            declare.samples_previous("picture");
            declare.samples_view(ViewKind::Reflection, "mirror", "resolved");
            declare.samples_view_previous(ViewKind::Reflection, "mirror", "resolved");
            declare.samples_layers(ViewKind::Shadow, "maps");
            declare.clears_color("picture", Format::Rgba8Unorm, BLACK);
        });
        let overlay = process("overlay", |declare| declare.draws_over("picture"));
        let maps = process("maps", |declare| {
            declare.views(ViewKind::Shadow);
            declare.clears_depth_layer("maps", Format::Depth32Float);
        });
        FramePlan::new(vec![maps, overlay, picture, surfaces], &[]).unwrap()
    }

    #[test]
    fn indices_are_those_of_the_targets_that_a_process_declares() {
        let plan = plan();
        let known: Vec<_> = plan.targets().iter().map(|planned| (planned.views, planned.name.as_str())).collect();
        assert_eq!(plan.processes().len(), 5);
        for PlannedProcess { declaration, targets, name, .. } in plan.processes() {
            let own = declaration.views;
            let declared = declaration.accesses.iter().map(|(target, access)| (access.views(own), target.as_str()));
            assert!(targets.accesses.iter().map(|(index, _)| known[*index]).eq(declared), "{name}");
            let accesses = declaration.accesses.iter().map(|(_, access)| *access);
            assert!(targets.accesses.iter().map(|(_, access)| *access).eq(accesses), "{name}");
            let colors = targets.colors.iter().map(|color| (known[color.index], color.clear));
            assert!(colors.eq(declaration.colors().map(|(target, clear)| ((own, target), clear))), "{name}");
            let depth = targets.depth.map(|(index, access)| (known[index], access));
            assert_eq!(depth, declaration.depth().map(|(target, access)| ((own, target), access)), "{name}");
            let resolved: Vec<_> = targets.colors.iter().map(|color| color.resolved_into.map(|to| known[to])).collect();
            match name.as_str() {
                "surfaces" => assert_eq!(resolved, [None, Some((own, "resolved"))]),
                _ => assert!(resolved.iter().all(Option::is_none), "{name}"),
            }
        }
    }

    #[test]
    fn histories_are_copies_of_targets_of_the_same_views() {
        let plan = plan();
        let name = |index: usize| (plan.targets()[index].views, plan.targets()[index].name.clone());
        let histories: Vec<_> = plan.histories().map(|(copy, source)| (name(copy), name(source))).collect();
        let history = |views, target: &str| ((views, previous_name(target)), (views, target.to_owned()));
        assert_eq!(histories, [history(ViewKind::Main, "picture"), history(ViewKind::Reflection, "resolved")]);
    }

    #[test]
    fn what_no_view_draws_has_the_index_of_the_same_target_in_other_views() {
        let picture = process("picture", |declare| {
            declare.samples_view(ViewKind::Reflection, "mirror", "picture");
            declare.clears_color("picture", Format::Rgba8Unorm, BLACK);
        });
        let plan = FramePlan::new(vec![picture], &[]).unwrap();
        let indices: Vec<_> = plan.processes()[0].targets.accesses.iter().map(|(index, _)| *index).collect();
        assert_eq!((indices, plan.targets().len()), (vec![0, 0], 1));
    }

    #[test]
    fn a_target_that_only_the_graph_knows_by_its_name_is_missing() {
        // The graph names the maps of shadow views like this.
        let reader = process("reader", |declare| declare.samples("shadow: maps"));
        let maps = process("maps", |declare| {
            declare.views(ViewKind::Shadow);
            declare.clears_depth_layer("maps", Format::Depth32Float);
        });
        let error = FramePlan::new(vec![reader, maps], &[]).err();
        let (target, processes) = ("shadow: maps".to_owned(), "\"reader\"".to_owned());
        assert_eq!(error, Some(PlanError::UnknownTarget { known: "\"shadow: maps\"".to_owned(), target, processes }));
    }

    #[test]
    fn a_target_that_no_view_draws_is_that_of_other_views() {
        let plan = plan();
        let views =
            |name| sampled_target(plan.targets(), ViewKind::Shadow, name).map(|index| plan.targets()[index].views);
        assert_eq!((views("picture"), views("other")), (Some(ViewKind::Main), None));
    }
}
