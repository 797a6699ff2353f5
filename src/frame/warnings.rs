//! Warnings about what a frame leaves out or cannot draw as requested, and what raw passes do not use.

#[cfg(feature = "wgpu")]
use crate::process::{Draws, FramePlan, RequestLog};
use crate::view::{Rejection, RejectionReason};

/// What warnings were about: each is reported when it changes, not in every frame.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    /// The rejections of the latest frames.
    reported: Vec<Rejection>,
    /// Processes with raw passes, each with something that it declares, from plans whose frames were observed.
    #[cfg(feature = "wgpu")]
    observed: Vec<(String, String)>,
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

    /// Ends a frame of this plan. Warns of what raw passes have not asked for in the first frames that encoded them, though their processes
    /// declare it. A process is in many plans: what one of them has shown is not observed again.
    #[cfg(feature = "wgpu")]
    pub(super) fn report_unrequested(&mut self, plan: &FramePlan, draws: &[Draws<'_>]) {
        for (planned, draws) in plan.processes().iter().zip(draws) {
            let Draws::Raw(_) = draws else { continue };
            for (resource, is_requested) in planned.requests.end_frame(&planned.declaration) {
                let declared = (planned.name.clone(), resource);
                if self.observed.contains(&declared) {
                    continue;
                }
                if !is_requested {
                    let ((process, resource), frames) = (&declared, RequestLog::OBSERVED_FRAMES);
                    tracing::warn!(
                        target: "drawloom",
                        %process,
                        "declares {resource}, which its raw pass has not asked for in {frames} frames"
                    );
                }
                self.observed.push(declared);
            }
        }
    }
}
