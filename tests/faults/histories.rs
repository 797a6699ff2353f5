//! A frame that fails is not the frame before: histories are those of the latest frame that was submitted.

use std::sync::Arc;

use drawloom::backend::SoftwareBackend;
#[cfg(feature = "wgpu")]
use drawloom::backend::WgpuBackend;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use drawloom_testing::feedback::{frames, with_feedback};
use libtest_mimic::Failed;

use crate::Case;
use crate::calls::expect;
use crate::subjects::Subject;

pub const CASES: &[Case] =
    &[("frames_that_fail_leave_the_histories_of_the_software_backend", histories::<SoftwareBackend>)];

#[cfg(feature = "wgpu")]
pub const CASES_OF_ADAPTERS: &[Case] = &[("frames_that_fail_leave_the_histories_of_wgpu", histories::<WgpuBackend>)];

/// Frames of [`frames`] in which every view is drawn: a frame that fails takes a view's turn.
const FRAMES: usize = 9;

struct Fixture<S: Subject> {
    renderer: Renderer<FaultyBackend<S>>,
    submitter: Submitter<FaultyBackend<S>>,
}

impl<S: Subject> Fixture<S> {
    fn new() -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = with_feedback(Renderer::builder(FaultyBackend::new(S::open(&scheduler)?).joining_passes()));
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Self { renderer, submitter })
    }

    /// What each view shows, which has in it what they held.
    fn draw(&mut self, scene: &Scene) -> Result<Vec<Vec<u8>>, Failed> {
        let submission = self.submitter.submit(self.renderer.record(scene.as_scene_ref())?)?.submission;
        (0..scene.cameras.len()).map(|view| S::read(&submission, view, "light")).collect()
    }
}

fn histories<S: Subject>() -> Result<(), Failed> {
    let scenes = frames();
    let mut fixture = Fixture::<S>::new()?;
    let expected: Result<Vec<_>, _> = scenes[..FRAMES].iter().map(|scene| fixture.draw(scene)).collect();
    let expected = expected?;
    for kind in [CallKind::Begin, CallKind::FinishTogether, CallKind::Submit] {
        let mut fixture = Fixture::<S>::new()?;
        for (frame, (scene, expected)) in scenes.iter().zip(&expected).enumerate() {
            fixture.renderer.backend().inject(kind, 0, Fault::DeviceLost);
            expect(fixture.draw(scene).is_err(), || format!("{kind:?} of frame {frame} does not fail"))?;
            let shown = fixture.draw(scene)?;
            expect(shown == *expected, || format!("{kind:?} of frame {frame} changes what views held"))?;
        }
    }
    Ok(())
}
