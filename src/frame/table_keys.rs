//! Which view and which pass each of the frame's tables belongs to.

use std::collections::HashMap;
use std::sync::Arc;

use crate::backend::kept_views;
use crate::process::{FramePlan, Pass};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The views and passes of a stage graph: by these a later graph finds the tables that go on.
pub(super) struct TableKeys {
    plan: Arc<FramePlan>,
    passes: Vec<Pass>,
    /// Kind and name of each view.
    views: Vec<(ViewKind, String)>,
}

/// Where the tables of another graph go.
pub(super) struct TakenTables {
    /// For each view the index of the view whose tables it takes.
    pub(super) of_views: Vec<Option<usize>>,
    /// For each pass the index of the pass whose table it takes.
    pub(super) of_passes: Vec<Option<usize>>,
}

impl TableKeys {
    pub(super) fn new(plan: &Arc<FramePlan>, passes: &[Pass], views: &[RenderView]) -> Self {
        let views = views.iter().map(|view| (view.kind(), view.name().to_owned())).collect();
        Self { plan: Arc::clone(plan), passes: passes.to_vec(), views }
    }

    /// Which tables of the graph `before` go on in this one, whose views are `views`. A view takes those of the view of
    /// its kind and name, or else of one that is gone. That is safe, because a table records the inputs that it was
    /// made from.
    pub(super) fn taken_from(&self, before: &Self, views: &[RenderView]) -> TakenTables {
        let names = before.views.iter().map(|(kind, name)| (*kind, name.as_str()));
        let of_views: Vec<_> = kept_views(names, views).into_iter().map(|kept| kept.map(|kept| kept.index)).collect();
        let names = before.passes.iter().map(|pass| (pass.view_index, before.process_of(pass)));
        let passes_before: HashMap<_, _> = names.zip(0..).collect();
        let taken = |pass: &Pass| passes_before.get(&(of_views[pass.view_index]?, self.process_of(pass))).copied();
        let of_passes = self.passes.iter().map(taken).collect();
        TakenTables { of_views, of_passes }
    }

    fn process_of(&self, pass: &Pass) -> &str {
        &self.plan.processes()[pass.process_index].name
    }
}

/// Makes `tables` those at the indices in `taken`, each at most once. Where there is none, one that is left, or a new
/// one.
pub(super) fn rearrange<T: Default>(tables: &mut Vec<T>, taken: &[Option<usize>]) {
    let mut before: Vec<_> = tables.drain(..).map(Some).collect();
    let taken: Vec<_> = taken.iter().map(|index| before.get_mut((*index)?)?.take()).collect();
    let mut left = before.into_iter().flatten();
    tables.extend(taken.into_iter().map(|table| table.or_else(|| left.next()).unwrap_or_default()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_go_where_they_are_wanted_and_others_are_used_again() {
        let mut tables = vec![10, 11, 12, 13];
        rearrange(&mut tables, &[Some(2), None, Some(0), None]);
        assert_eq!(tables, [12, 11, 10, 13]);
        rearrange(&mut tables, &[None, Some(0), None, None, None]);
        assert_eq!(tables, [11, 12, 10, 13, 0]);
        rearrange(&mut tables, &[Some(9)]);
        assert_eq!(tables, [11]);
    }
}
