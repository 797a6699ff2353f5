//! Views that show what each other held in the frame before.

use drawloom::backend::SoftwareBackend;
use drawloom::task::Scheduler;
use drawloom::{Renderer, SubmitError};
use drawloom_testing::feedback::{DrawnView, check, with_feedback};
use std::sync::Arc;

use crate::Fixture;

fn check_feedback(mut fixture: Fixture) {
    let checked = check(|frame, scene| {
        let recorded = fixture.renderer.record(scene.as_scene_ref()).unwrap();
        let ages: Vec<_> = recorded.statistics().views.iter().map(|view| view.age).collect();
        if frame == 2 {
            drop(fixture.renderer.record(scene.as_scene_ref()).unwrap());
        }
        let submission = fixture.submitter.submit(recorded)?.submission;
        let view = |(view, age): (usize, &u32)| {
            let values = submission.numbers(view, "light").unwrap().iter().map(|pixel| pixel[0]).collect();
            DrawnView { is_drawn: *age == 0, values: Some(values) }
        };
        Ok::<_, SubmitError>(ages.iter().enumerate().map(view).collect())
    });
    assert_eq!(checked, Ok(()));
}

#[test]
fn views_show_what_each_other_held_in_the_frame_before() {
    check_feedback(Fixture::new(2, with_feedback));
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = with_feedback(Renderer::builder(SoftwareBackend::reference()));
    let (renderer, submitter) = builder.build(scheduler).unwrap();
    check_feedback(Fixture { renderer, submitter });
}
