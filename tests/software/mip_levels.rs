//! Targets with mip levels.

use std::sync::Arc;

use drawloom::backend::SoftwareBackend;
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, SubmitError};
use drawloom_testing::mip_levels::{
    ATLAS_FORMATS, ATLAS_SIZES, DrawnFrame, OUTPUTS, Shown, atlas_name, atlas_scene, check, check_atlas, with_atlases,
    with_mip_levels,
};

use crate::Fixture;

fn check_levels(mut fixture: Fixture) {
    let checked = check(1e-5, |frame, scene| {
        let recorded = fixture.renderer.record(scene.as_scene_ref()).unwrap();
        let is_drawn = recorded.statistics().views.iter().map(|view| view.age == 0).collect();
        if frame == 2 {
            // A frame that is dropped leaves nothing.
            drop(fixture.renderer.record(scene.as_scene_ref()).unwrap());
        }
        let submission = fixture.submitter.submit(recorded)?.submission;
        let outputs = OUTPUTS.map(|output| submission.numbers(0, output).unwrap());
        Ok::<_, SubmitError>(DrawnFrame { is_drawn, outputs })
    });
    assert_eq!(checked, Ok(()));
}

#[test]
fn levels_are_means_in_every_view_and_frame() {
    check_levels(Fixture::new(2, with_mip_levels));
    check_levels(reference(with_mip_levels));
}

/// A renderer in f64.
fn reference(build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>) -> Fixture {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (renderer, submitter) = build(Renderer::builder(SoftwareBackend::reference())).build(scheduler).unwrap();
    Fixture { renderer, submitter }
}

#[test]
fn levels_are_means_at_every_size_and_in_every_format() {
    let single = (Fixture::new(2, with_atlases), Shown::Rounded);
    for (mut fixture, shown) in [single, (reference(with_atlases), Shown::Exact)] {
        let submission = fixture.draw(&atlas_scene());
        for (view, size) in ATLAS_SIZES.into_iter().enumerate() {
            for format in ATLAS_FORMATS {
                let atlas = submission.numbers(view, atlas_name(format)).unwrap();
                assert_eq!(check_atlas(shown, format, size, &atlas), Ok(()), "{shown:?}");
            }
        }
    }
}
