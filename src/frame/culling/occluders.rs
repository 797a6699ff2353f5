//! Which objects of a view may occlude others.

use crate::command::{Blending, Selection};
use crate::process::{Access, Draws, FramePlan, Pass};
use crate::view::RenderView;

/// The objects that may occlude others in a view, as the selections of the passes that draw them. Those of them with a
/// mask do not.
///
/// `None` where a hidden object could still be visible in the picture, so that no object may be removed:
/// - in shadow maps, which show objects that are hidden from elsewhere;
/// - where a pass changes the stencil of pixels that are hidden;
/// - where a pass draws without testing the view's single depth target, or tests its stencil alone;
/// - where an object is tested before all occluders are drawn, or after the depth is cleared again;
/// - where occluders are drawn into different colour targets.
pub(super) fn occluders(
    plan: &FramePlan,
    draws: &[Draws<'_>],
    passes: &[Pass],
    (index, view): (usize, &RenderView),
) -> Option<Vec<Selection>> {
    if !view.kind().rules().culls_hidden {
        return None;
    }
    // Passes are in draw order.
    let of_view = || passes.iter().filter(|pass| pass.view_index == index);
    let depth_of = |pass: &Pass| plan.processes()[pass.process_index].declaration.depth();
    let colors_of = |pass: &Pass| -> Vec<&str> {
        plan.processes()[pass.process_index].declaration.colors().map(|(target, _)| target).collect()
    };
    let (mut depth, mut colors, mut tests_only, mut occluders) = (None, Vec::new(), false, Vec::new());
    for pass in of_view() {
        let Some(selection) = draws[pass.process_index].selection() else { continue };
        if draws[pass.process_index].writes_stencil_where_hidden() {
            return None;
        }
        let (target, access) = depth_of(pass)?;
        if access == Access::TestStencil {
            return None;
        }
        if *depth.get_or_insert(target) != target {
            return None;
        }
        if access.writes_depth() && draws[pass.process_index].hides() && selection.blending != Blending::Blended {
            let own = colors_of(pass);
            if tests_only || !(colors.is_empty() || own.is_empty() || own == colors) {
                return None;
            }
            if !own.is_empty() {
                colors = own;
            }
            occluders.push(view.selection_of(selection));
        } else {
            tests_only = true;
        }
    }
    let clears = |pass: &&Pass| depth_of(pass).is_some_and(|(target, access)| depth == Some(target) && !access.reads());
    (of_view().filter(clears).count() <= 1 && !occluders.is_empty()).then_some(occluders)
}
