//! Fences at places in a frame.

use std::time::Duration;

use drawloom::fence::FenceError;
use drawloom::{FencePoint, FrameError};

use crate::{Fixture, LONG};

#[test]
fn the_device_sets_fences_in_the_order_of_their_places() {
    let mut fixture = Fixture::new(Duration::from_millis(20));
    let mut frame = fixture.record();
    let views = frame.queues().len();
    assert!(views > 1, "two cameras");
    // Asked for backwards, so that the order is that of the places.
    let end = frame.fence_at(FencePoint::End).unwrap();
    let of_views: Vec<_> = (0..views).rev().map(|view| frame.fence_at(FencePoint::View(view)).unwrap()).collect();
    let mut passes: Vec<_> = frame.queues().iter().flat_map(|queue| &queue.passes).map(|(pass, _)| *pass).collect();
    passes.sort_by_key(|pass| pass.view_index);
    let process_of = |index: usize| fixture.renderer.plan().processes()[index].name.clone();
    let of_passes: Vec<_> = passes
        .iter()
        .map(|pass| {
            let (process, view) = (process_of(pass.process_index), pass.view_index);
            (*pass, frame.fence_at(FencePoint::Pass { process: &process, view }).unwrap())
        })
        .collect();
    let submitted = fixture.submitter.submit(frame).unwrap();
    end.wait(LONG).unwrap();

    let end = end.set_at().unwrap();
    let time_of = |process: &str, view: usize| {
        let found = of_passes.iter().find(|(pass, _)| {
            pass.view_index == view && fixture.renderer.plan().processes()[pass.process_index].name == process
        });
        // Those of the last pass have the place of the end, and are set after it, as they were asked for later.
        let (_, fence) = found.unwrap();
        fence.wait(LONG).unwrap();
        fence.set_at().unwrap()
    };
    // The submission lists the passes in the order in which they were submitted.
    let order: Vec<_> = submitted.submission.passes.iter().map(|pass| time_of(&pass.process, pass.view)).collect();
    assert_eq!(order.len(), of_passes.len());
    assert!(order.is_sorted() && order[0] < *order.last().unwrap(), "{order:?}");
    for (view, fence) in (0..views).rev().zip(&of_views) {
        let last = submitted.submission.passes.iter().rposition(|pass| pass.view == view).unwrap();
        fence.wait(LONG).unwrap();
        let of_view = fence.set_at().unwrap();
        // The fence of the last pass has the same place, and was asked for later.
        assert!(order[last - 1] < of_view && of_view <= order[last], "view {view}");
    }
    assert!(order[order.len() - 2] < end && end <= order[order.len() - 1]);
}

#[test]
fn a_place_that_a_frame_does_not_have_is_an_error() {
    let mut fixture = Fixture::new(Duration::ZERO);
    let mut frame = fixture.record();
    let views = frame.queues().len();
    for (place, message) in [
        (FencePoint::View(views), format!("the frame draws nothing at this place: view {views}")),
        (
            FencePoint::Pass { process: "no such process", view: 0 },
            "the frame draws nothing at this place: process \"no such process\" in view 0".to_owned(),
        ),
    ] {
        let error = frame.fence_at(place).unwrap_err();
        assert!(matches!(error, FrameError::UnknownPlace { .. }));
        assert_eq!(error.to_string(), message);
    }
    fixture.submitter.submit(frame).unwrap();
}

#[test]
fn the_fences_of_a_frame_that_is_dropped_are_abandoned() {
    let mut fixture = Fixture::new(Duration::ZERO);
    let mut frame = fixture.record();
    let fences = [frame.fence_at(FencePoint::View(0)).unwrap(), frame.fence_at(FencePoint::End).unwrap()];
    drop(frame);
    for fence in fences {
        assert!(matches!(fence.wait(LONG), Err(FenceError::Abandoned { .. })));
    }
}

#[test]
fn a_fence_of_one_frame_may_hold_up_a_later_one() {
    let mut fixture = Fixture::new(Duration::from_millis(10));
    let mut first = fixture.record();
    let drawn = first.fence_at(FencePoint::End).unwrap();
    let mut second = fixture.record();
    second.submit_after(&drawn, LONG);
    fixture.submitter.submit(first).unwrap();
    fixture.submitter.submit(second).unwrap();
    assert!(drawn.is_set(), "the second frame was submitted before the first one was drawn");
}
