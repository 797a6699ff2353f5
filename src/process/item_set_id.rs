//! What sets of items are known by from frame to frame.

use super::ItemViews;
use super::plan::ProcessId;
use crate::scene::ViewKind;

/// What a set of items is known by from frame to frame.
#[derive(Debug)]
pub(crate) struct ItemSetId {
    process: ProcessId,
    views: SetViews,
}

/// [`ItemViews`] with a name of its own.
#[derive(Debug)]
enum SetViews {
    All,
    OfKind(ViewKind),
    Named(String),
}

impl ItemSetId {
    /// Makes `id` that of the set for these views of a process. Returns false if it is that already.
    pub(crate) fn replace(id: &mut Option<Self>, process: ProcessId, views: ItemViews<'_>) -> bool {
        let is_same = |id: &Self| id.process == process && id.views() == views;
        if id.as_ref().is_some_and(is_same) {
            return false;
        }
        let views = match views {
            ItemViews::All => SetViews::All,
            ItemViews::OfKind(kind) => SetViews::OfKind(kind),
            ItemViews::Named(name) => SetViews::Named(name.to_owned()),
        };
        *id = Some(Self { process, views });
        true
    }

    fn views(&self) -> ItemViews<'_> {
        match &self.views {
            SetViews::All => ItemViews::All,
            SetViews::OfKind(kind) => ItemViews::OfKind(*kind),
            SetViews::Named(name) => ItemViews::Named(name),
        }
    }
}
