//! Places in a frame.

use crate::process::Pass;

/// A place in the order in which a frame is submitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FencePoint<'a> {
    /// After everything that a process draws in a view, and all that is submitted before that.
    Pass {
        /// The process's name.
        process: &'a str,
        /// The view's index.
        view: usize,
    },
    /// After all passes of a view, by index.
    View(usize),
    /// After the whole frame, its read-backs included.
    End,
}

impl FencePoint<'_> {
    /// The number of passes before the place, of a frame whose passes are submitted in this order. `None` if the frame
    /// has no such pass, as for views that are [cached](crate::scene::Redraw).
    pub(super) fn passes_before<'a>(self, order: &[Pass], process_name: impl Fn(usize) -> &'a str) -> Option<usize> {
        let is_last = |pass: &Pass| match self {
            Self::Pass { process, view } => pass.view_index == view && process_name(pass.process_index) == process,
            Self::View(view) => pass.view_index == view,
            Self::End => true,
        };
        match self {
            Self::End => Some(order.len()),
            Self::Pass { .. } | Self::View(_) => order.iter().rposition(is_last).map(|last| last + 1),
        }
    }
}

impl std::fmt::Display for FencePoint<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Pass { process, view } => write!(formatter, "process {process:?} in view {view}"),
            Self::View(view) => write!(formatter, "view {view}"),
            Self::End => write!(formatter, "the end"),
        }
    }
}
