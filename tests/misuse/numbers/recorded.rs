//! Indices of views, rectangles and places of recorded and submitted frames.

use drawloom::FencePoint;
use drawloom::glam::Vec2;
use drawloom::process::Deferred;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{COUNTS, Fixture, ensure, refused, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "frames_are_asked_for_any_view_and_rectangle",
        numbers: &[
            "FencePoint::Pass::view",
            "FencePoint::View",
            "RecordedFrame::camera",
            "RecordedFrame::read_back",
            "RecordedFrame::read_back_whole",
            "backend::WgpuSubmission::read",
            "backend::WgpuSubmission::texture",
        ],
        check: recorded,
    },
    NumberCase {
        name: "frames_of_the_software_backend_are_asked_for_any_view",
        numbers: &["backend::SoftwareSubmission::read", "backend::SoftwareSubmission::numbers"],
        check: software,
    },
    NumberCase {
        name: "pictures_of_any_size",
        numbers: &[
            "scene::Camera::size",
            "scene::Camera::cube_faces",
            "scene::Camera::tile",
            "scene::Camera::jittered",
            "backend::Picture::bytes",
            "backend::Picture::height",
            "backend::Picture::width",
            "backend::Picture::texel",
        ],
        check: sizes,
    },
    NumberCase {
        name: "surfaces_of_any_size",
        // There is no surface without a window: `examples/window`'s tests resize one.
        numbers: &["backend::WindowSurface::acquire"],
        check: || Ok(()),
    },
];

/// Views that the frames here do not have.
const NO_VIEWS: [usize; 3] = [50, 1 << 63, usize::MAX];

fn recorded() -> Result<(), Failed> {
    let (scene, mut fixture) = (scene(), Fixture::noop(1, Deferred::to_picture())?);
    let mut recorded = fixture.record(&scene)?;
    for view in NO_VIEWS {
        ensure(recorded.camera(view).is_none(), "there is no such view")?;
        refused(recorded.read_back(view, "picture", [0; 2], [1; 2]), "picture")?;
        refused(recorded.read_back_whole(view, "picture"), "picture")?;
        refused(recorded.fence_at(FencePoint::View(view)), "place")?;
        refused(recorded.fence_at(FencePoint::Pass { process: "geometry buffer", view }), "place")?;
    }
    for number in COUNTS {
        for other in COUNTS {
            let is_within = |origin: u32, size: u32| size > 0 && u64::from(origin) + u64::from(size) <= 16;
            let read = recorded.read_back(0, "picture", [number, 0], [other, 1]);
            ensure(read.is_ok() == is_within(number, other), format_args!("{number} {other}"))?;
            let read = recorded.read_back(0, "picture", [0, number], [1, other]);
            ensure(read.is_ok() == is_within(number, other), format_args!("{number} {other}"))?;
        }
    }
    let submitted = fixture.submitter.submit(recorded)?;
    for view in NO_VIEWS {
        ensure(submitted.submission.texture(view, "picture").is_err(), "there is no such view")?;
        refused(submitted.submission.read(view, "picture"), "picture")?;
    }
    Ok(())
}

fn software() -> Result<(), Failed> {
    let submitted = Fixture::software(Deferred::to_picture())?.draw(&scene())?;
    for view in NO_VIEWS {
        refused(submitted.submission.read(view, "picture"), "picture")?;
        refused(submitted.submission.numbers(view, "picture"), "picture")?;
    }
    Ok(())
}

fn sizes() -> Result<(), Failed> {
    // The null backend draws nothing, so it has no largest picture.
    for number in COUNTS {
        for size in [[number, 16], [16, number], [number; 2]] {
            let is_small = size.iter().all(|side| *side <= 16);
            let mut scene = scene();
            scene.cameras[0].size = size;
            let is_empty = size.contains(&0);
            ensure(Fixture::null(1).draw(&scene).is_ok() != is_empty, format_args!("{size:?} on null"))?;
            let drawn = [
                Fixture::noop(1, Deferred::to_picture())?.draw(&scene).map(drop),
                Fixture::software(Deferred::to_picture())?.draw(&scene).map(drop),
            ];
            for drawn in drawn {
                ensure(drawn.is_ok() == (is_small && !is_empty), format_args!("{size:?}: {drawn:?}"))?;
            }
        }
        let mut scene = scene();
        scene.cameras.extend(drawloom::scene::Camera::cube_faces("cube", Default::default(), number, 0.1));
        // One pixel would do, but nothing draws reflections here.
        let problem = if number == 0 { "0x0 pixels" } else { "cube/0" };
        refused(Fixture::noop(1, Deferred::to_picture())?.record(&scene), problem)?;
    }
    let camera = scene().cameras.remove(0);
    for count in [1, 2, u32::MAX] {
        let last = count - 1;
        let mut scene = scene();
        scene.cameras[0] = camera.tile([last, 0], count);
        let drawn = Fixture::null(1).draw(&scene);
        // A four-billionth of a picture is narrower than f32 can say.
        ensure(drawn.is_ok() || count == u32::MAX, format_args!("a tile of {count}"))?;
    }
    for offset in crate::fixture::FLOATS {
        let mut scene = scene();
        scene.cameras[0] = camera.jittered(Vec2::splat(offset));
        let drawn = Fixture::null(1).draw(&scene);
        ensure(drawn.is_ok() || offset.abs() > 16.0 || offset.is_nan(), format_args!("a jitter of {offset}"))?;
    }
    let picture = drawloom::backend::Picture {
        width: u32::MAX,
        height: u32::MAX,
        format: drawloom::process::Format::Rgba8Unorm,
        bytes: vec![0; 4],
    };
    // It says so in its documentation, as a slice does.
    ensure(drawloom::task::catch(|| picture.texel([u32::MAX; 2])).is_err(), "there is no such pixel")
}
