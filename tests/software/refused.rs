//! What cannot be drawn is an error that names it, and the next frame is whole.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::BackendError;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CommandDraws, Corner, Declare, Draws, Format, FullScreen, FullScreenPixel, FullScreenTwin, ObjectPixel,
    ObjectTwin, ObjectValues, PassValues, RenderProcess, Twin, VertexValues, ViewValues,
};
use drawloom::raster::{Real, Vector4};
use drawloom::{FrameError, SubmitError};
use drawloom_testing::scenes::field;

use crate::{Studio, deferred};

/// Where a twin panics.
const NOWHERE: usize = 0;
const ASKED: usize = 1;
const VERTEX: usize = 2;
const FRAGMENT: usize = 3;

/// A process whose twin panics where it is told to.
#[derive(Clone)]
struct Fragile(Arc<AtomicUsize>);

impl Fragile {
    fn is_at(&self, place: usize) {
        assert!(self.0.load(Ordering::Relaxed) != place, "the glass is broken");
    }
}

impl RenderProcess for Fragile {
    fn name(&self) -> &str {
        "fragile"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }

    fn twin(&self) -> Option<Twin> {
        self.is_at(ASKED);
        Some(Twin::objects(self.clone()))
    }
}

impl<R: Real> ObjectTwin<R> for Fragile {
    fn vertex(&self, view: &ViewValues<R>, object: &ObjectValues<R>, vertex: &VertexValues<R>) -> Corner<R> {
        self.is_at(VERTEX);
        let place = object.origin + object.orientation.rotate(object.scale * vertex.position);
        let [x, y, z, w] = view.clip_from_relative;
        let clip = x * place[0] + y * place[1] + z * place[2] + w;
        Corner { clip, varyings: [R::zero(); drawloom::process::VARYINGS] }
    }

    fn fragment(&self, _pass: &PassValues<'_, R>, _pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        self.is_at(FRAGMENT);
        targets[0] = Vector4::splat(R::one());
        true
    }
}

#[test]
fn a_panic_in_a_twin_names_the_process_and_the_next_frame_is_whole() {
    let place = Arc::new(AtomicUsize::new(NOWHERE));
    let fragile = Fragile(Arc::clone(&place));
    let mut studio = Studio::new(3, |builder| builder.process(fragile).output("own"));
    let scene = field(200);
    let whole = studio.draw(&scene).read(0, "own").unwrap();
    assert!(whole.bytes.contains(&255) && whole.bytes.contains(&0));
    for broken in [ASKED, VERTEX, FRAGMENT, ASKED, FRAGMENT] {
        place.store(broken, Ordering::Relaxed);
        let error = match studio.renderer.record(scene.as_scene_ref()) {
            Err(FrameError::Backend(error)) if broken == ASKED => error,
            Ok(recorded) if broken != ASKED => match studio.submitter.submit(recorded) {
                Err(SubmitError::Backend(error)) => error,
                other => panic!("{broken}: {:?}", other.err()),
            },
            other => panic!("{broken}: {:?}", other.err()),
        };
        let BackendError::TwinPanicked { process, message } = error else { panic!("{broken}: {error}") };
        assert_eq!((process.as_str(), message.as_str()), ("fragile", "the glass is broken"));
        place.store(NOWHERE, Ordering::Relaxed);
        assert!(studio.draw(&scene).read(0, "own").unwrap() == whole);
    }
}

/// A process with no twin, or with one of the wrong kind.
struct Mistaken {
    twin: Option<Twin>,
    reads_what_it_writes: bool,
}

impl RenderProcess for Mistaken {
    fn name(&self) -> &str {
        "mistaken"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.after("transparency");
        if self.reads_what_it_writes {
            declare.samples("radiance");
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }

    fn twin(&self) -> Option<Twin> {
        self.twin.clone()
    }
}

struct Nothing;

impl<R: Real> FullScreenTwin<R> for Nothing {
    fn fragment(&self, _: &PassValues<'_, R>, _: &FullScreenPixel<R>, _: &mut [Vector4<R>]) -> bool {
        false
    }
}

fn error_of(process: impl RenderProcess + 'static) -> BackendError {
    let mut studio = Studio::new(2, |builder| builder.deferred(deferred()).process(process));
    match studio.renderer.record(field(10).as_scene_ref()) {
        Err(FrameError::Backend(error)) => error,
        other => panic!("{:?}", other.err()),
    }
}

#[test]
fn a_process_without_a_twin_is_named() {
    let error = error_of(Mistaken { twin: None, reads_what_it_writes: false });
    assert!(matches!(&error, BackendError::NoTwin { process } if process == "mistaken"), "{error}");
}

#[test]
fn a_twin_of_another_kind_is_refused() {
    let twin = Some(Twin::objects(Fragile(Arc::default())));
    let error = error_of(Mistaken { twin, reads_what_it_writes: false });
    assert!(matches!(&error, BackendError::Validation { label, .. } if label == "mistaken"), "{error}");
}

#[test]
fn a_target_that_is_read_as_it_is_written_is_refused() {
    let error = error_of(Mistaken { twin: Some(Twin::full_screen(Nothing)), reads_what_it_writes: true });
    assert!(matches!(&error, BackendError::Validation { label, .. } if label == "mistaken"), "{error}");
}

#[test]
fn pictures_and_places_have_limits() {
    let mut studio = Studio::new(2, |builder| builder.deferred(deferred()));
    let whole = studio.picture(&field(10));
    let mut large = field(10);
    large.cameras[1].size = [16_385, 1];
    match studio.renderer.record(large.as_scene_ref()) {
        Err(FrameError::Backend(BackendError::Limit { allowed: 16_384, needed: 16_385, .. })) => {}
        other => panic!("{:?}", other.err()),
    }
    let mut far = field(10);
    far.cameras[1].position = DVec3::X * 5e9;
    match studio.renderer.record(far.as_scene_ref()) {
        Err(FrameError::Backend(BackendError::ViewOutOfReach { view })) => assert_eq!(view, "side"),
        other => panic!("{:?}", other.err()),
    }
    assert!(studio.picture(&field(10)) == whole);
}

#[test]
fn a_target_that_is_not_there_is_named() {
    let submission = Studio::new(2, |builder| builder.deferred(deferred())).draw(&field(10));
    for (view, target) in [(0, "pictures"), (2, "picture")] {
        match submission.read(view, target) {
            Err(BackendError::UnknownTarget { view: named, target: name }) => {
                assert_eq!((named, &*name), (view, target))
            }
            other => panic!("{:?}", other.err()),
        }
    }
}
