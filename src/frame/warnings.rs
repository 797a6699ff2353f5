//! Warnings about what a frame leaves out or cannot draw as requested.

use crate::view::{Rejection, RejectionReason};

/// The rejections that the latest warnings were about: each is reported when it changes, not in every frame.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    reported: Vec<Rejection>,
}

impl Warnings {
    /// Warns of the rejections of a frame that are not reported yet. Only drawing shadow maps finds coarse edges, so a frame that
    /// reads cached maps leaves that report as it is.
    pub(super) fn report(&mut self, rejections: &[Rejection], has_cached_maps: bool) {
        for rejection in rejections {
            // A light that is switched off is no mistake.
            if rejection.reason == RejectionReason::DarkLight || self.reported.contains(rejection) {
                continue;
            }
            let (reason, count, first) = (rejection.reason.name(), rejection.count, rejection.first);
            tracing::warn!(target: "drawloom", count, first, "not drawn as requested: {reason}");
        }
        let is_unknown = |rejection: &Rejection| has_cached_maps && rejection.reason == RejectionReason::CoarseEdges;
        self.reported.retain(is_unknown);
        self.reported.extend(rejections.iter().filter(|rejection| !is_unknown(rejection)));
    }
}
