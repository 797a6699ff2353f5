//! Warnings about what a frame leaves out or cannot draw as requested, and what raw passes do not use.

#[cfg(feature = "wgpu")]
use crate::process::{Draws, FramePlan, RequestLog};
use crate::unwind::emit;
use crate::view::{IssueReason, SceneIssue};

/// What warnings were about: each is reported when it changes, not in every frame.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    /// The scene issues of the latest frames.
    reported: Vec<SceneIssue>,
    /// Processes with raw passes, each with something that it declares, from plans whose frames were observed.
    #[cfg(feature = "wgpu")]
    observed: Vec<(String, String)>,
}

impl Warnings {
    /// Warns of the scene issues of a frame that are not reported yet. Some of them only drawing finds, so a frame with
    /// cached views finds a part of these: that many or more were reported.
    pub(super) fn report(&mut self, scene_issues: &[SceneIssue], has_cached_views: bool) {
        let is_partial = |reason| {
            use IssueReason::{CoarseEdges, LightLimit, UndrawableMesh};
            has_cached_views && matches!(reason, CoarseEdges | LightLimit | UndrawableMesh)
        };
        for issue in scene_issues {
            let is_part = |known: &SceneIssue| {
                is_partial(known.reason) && known.reason == issue.reason && known.count >= issue.count
            };
            let is_reported = self.reported.iter().any(|known| known == issue || is_part(known));
            // A light that is switched off is no mistake, and what is streamed arrives.
            let is_expected = matches!(
                issue.reason,
                IssueReason::DarkLight | IssueReason::NotResident | IssueReason::TextureNotResident
            );
            if is_expected || is_reported {
                continue;
            }
            let SceneIssue { reason, count, first, name } = issue;
            // A name is the engine's, or a file's.
            let (reason, name) = (reason.name(), name.as_deref().map(tracing::field::debug));
            emit(|| tracing::warn!(target: "drawloom", count, first, name, "not drawn as requested: {reason}"));
        }
        let before: Vec<_> = self.reported.drain(..).filter(|known| is_partial(known.reason)).collect();
        self.reported.extend_from_slice(scene_issues);
        for before in before {
            match self.reported.iter_mut().find(|known| known.reason == before.reason) {
                Some(known) if known.count < before.count => *known = before,
                Some(_) => {}
                None => self.reported.push(before),
            }
        }
    }

    /// Ends a frame of this plan. Warns of what raw passes have not asked for in the first frames that encoded them,
    /// though their processes declare it. A process is in many plans: what one of them has shown is not observed again.
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
                    emit(|| {
                        tracing::warn!(
                            target: "drawloom",
                            %process,
                            "declares {resource}, which its raw pass has not asked for in {frames} frames"
                        );
                    });
                }
                self.observed.push(declared);
            }
        }
    }
}
