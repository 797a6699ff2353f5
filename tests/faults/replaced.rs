//! Another backend takes the place of one that is lost.

use drawloom::SubmitError;
#[cfg(feature = "wgpu")]
use drawloom::backend::WgpuBackend;
use drawloom::backend::{NullBackend, SoftwareBackend};
use drawloom::scene::Changes;
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use libtest_mimic::Failed;

use crate::Case;
use crate::calls::expect;
use crate::fixture::{Fixture, Setting, two_scenes};
use crate::subjects::Subject;

pub const CASES: &[Case] = &[
    ("a_null_backend_takes_the_place_of_another", replaced::<NullBackend>),
    ("a_software_backend_takes_the_place_of_another", replaced::<SoftwareBackend>),
    ("cached_views_of_a_software_backend_are_drawn_anew_by_the_next", cached_views::<SoftwareBackend>),
];

#[cfg(feature = "wgpu")]
pub const CASES_OF_ADAPTERS: &[Case] = &[
    ("a_wgpu_backend_takes_the_place_of_another", replaced::<WgpuBackend>),
    ("cached_views_of_a_wgpu_backend_are_drawn_anew_by_the_next", cached_views::<WgpuBackend>),
];

/// After frames that succeeded, after one that failed in the middle, and with one in flight.
fn replaced<S: Subject>() -> Result<(), Failed> {
    let setting = Setting::FULL;
    let (scenes, moved) = two_scenes()?;
    let expected = [
        Fixture::<S>::new(setting)?.picture(&scenes[0], Changes::Unknown)?,
        Fixture::<S>::new(setting)?.picture(&scenes[1], Changes::Unknown)?,
    ];
    let mut fixture = Fixture::<S>::new(setting)?;
    fixture.picture(&scenes[0], Changes::Unknown)?;
    fixture.picture(&scenes[0], Changes::NONE)?;
    for (turn, kind) in [None, Some(CallKind::Finish), Some(CallKind::Submit)].into_iter().enumerate() {
        let next = (turn + 1) % 2;
        if let Some(kind) = kind {
            fixture.renderer.backend().inject(kind, 3, Fault::DeviceLost);
            if kind == CallKind::Submit {
                fixture.renderer.backend().inject(kind, 0, Fault::DeviceLost);
            }
            expect(fixture.draw(&scenes[turn % 2], Changes::NONE)?.is_err(), || format!("{kind:?} does not fail"))?;
        }
        fixture.renderer.backend().clear();
        let of_device_before = fixture.renderer.record(scenes[turn % 2].as_scene_ref())?;
        let backend = FaultyBackend::new(S::open(&fixture.scheduler)?);
        let submitter_before = std::mem::replace(&mut fixture.submitter, fixture.renderer.replace_backend(backend));
        let refused = fixture.submitter.submit(of_device_before).err();
        expect(matches!(refused, Some(SubmitError::ForeignFrame)), || format!("{refused:?}"))?;
        // The engine reports what changed, and nothing else.
        let picture = fixture.picture(&scenes[next], Changes::Objects(&moved))?;
        expect(picture == expected[next], || format!("{kind:?}: the next picture is another one"))?;
        let of_new_device = fixture.renderer.record(scenes[next].as_scene_ref())?;
        let refused = submitter_before.submit(of_new_device).err();
        expect(matches!(refused, Some(SubmitError::ForeignFrame)), || format!("{refused:?}"))?;
        let picture = fixture.picture(&scenes[next], Changes::NONE)?;
        expect(picture == expected[next], || format!("{kind:?}: the picture after that is another one"))?;
    }
    Ok(())
}

/// The targets of views that the next frame would not draw are lost too.
fn cached_views<S: Subject>() -> Result<(), Failed> {
    let setting = Setting { shadow_interval: 4, ..Setting::FULL };
    let ([scene, _], _) = two_scenes()?;
    let expected = Fixture::<S>::new(setting)?.picture(&scene, Changes::Unknown)?;
    let mut fixture = Fixture::<S>::new(setting)?;
    for frames in 1..=4 {
        for _ in 0..frames {
            fixture.picture(&scene, Changes::NONE)?;
        }
        // A frame in flight says at its end that it was never drawn, which is of no concern to the new backend.
        let of_device_before = fixture.renderer.record(scene.as_scene_ref())?;
        let backend = FaultyBackend::new(S::open(&fixture.scheduler)?);
        fixture.submitter = fixture.renderer.replace_backend(backend);
        for frame in 0..3 {
            let picture = fixture.picture(&scene, Changes::NONE)?;
            expect(picture == expected, || format!("after {frames} frames, picture {frame} is another one"))?;
        }
        drop(of_device_before);
    }
    Ok(())
}
