//! The gallery of the example `views`: its contact sheet is compared with the one that is shown, and what stands for
//! something else in it with what that stands for.
//!
//! Without an adapter the cases on one are reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter
//! fails them. Slow cases are ignored without `DRAWLOOM_SLOW_CASES=1`. `DRAWLOOM_RENEW_REFERENCES=1` rewrites the
//! sheet: look at it before you commit it.

#[path = "../../examples/views/contact_sheet.rs"]
mod contact_sheet;
#[path = "../../examples/views/gallery.rs"]
#[expect(dead_code, reason = "what views cost is not measured here")]
mod gallery;
#[path = "../pictures/image_distance.rs"]
#[expect(dead_code, reason = "the pictures of other tests are compared in more ways")]
mod image_distance;
#[path = "../../examples/views/impostor.rs"]
mod impostor;
#[path = "../../examples/views/mirror_ball.rs"]
mod mirror_ball;
#[path = "../../examples/views/processes.rs"]
mod processes;
#[path = "../../examples/views/smoke.rs"]
mod smoke;
#[path = "../../examples/views/surface.rs"]
mod surface;

use std::path::PathBuf;
use std::sync::Arc;

use drawloom::backend::{
    Backend, BackendError, Picture, SoftwareBackend, SoftwareSubmission, WgpuBackend, WgpuSubmission,
};
use drawloom::glam::DVec3;
use drawloom::process::{Deferred, ToneMapping};
use drawloom::scene::{Camera, LayerMask, Scene};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter};
use drawloom_testing::{adapter, slow_cases};
use image::{GenericImageView, Rgb, RgbImage};
use libtest_mimic::{Arguments, Failed, Trial};

use crate::gallery::Gallery;
use crate::image_distance::{Distance, as_image};
use crate::smoke::{Smoke, UpsampledSmoke};

type Case = fn() -> Result<(), Failed>;

/// Cases that take several seconds.
const SLOW_CASES: [&str; 3] =
    ["an_impostor_looks_like_what_it_stands_for", IN_SOFTWARE, "the_contact_sheet_is_the_one_that_is_shown"];
const IN_SOFTWARE: &str = "in_software_the_contact_sheet_is_the_same";

const CASES_ON_ADAPTER: [(&str, Case); 4] = [
    ("the_contact_sheet_is_the_one_that_is_shown", contact_sheet),
    ("an_impostor_looks_like_what_it_stands_for", impostor),
    ("an_impostor_is_drawn_again_when_it_has_turned", impostor_turns),
    ("smoke_with_a_quarter_of_the_pixels_looks_like_smoke_with_all", smoke),
];

fn main() {
    let arguments = Arguments::from_args();
    let has_adapter = adapter::device().is_ok();
    let requires_adapter = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let ignores_adapter = !has_adapter && !requires_adapter;
    let trial = |(name, case)| {
        let is_ignored = ignores_adapter || slow_cases::leave_out(&SLOW_CASES, name);
        Trial::test(name, case).with_ignored_flag(is_ignored)
    };
    let mut trials = Vec::from(CASES_ON_ADAPTER.map(trial));
    let software = Trial::test(IN_SOFTWARE, contact_sheet_in_software);
    trials.push(software.with_ignored_flag(slow_cases::leave_out(&SLOW_CASES, IN_SOFTWARE)));
    trials.push(Trial::test("a_cell_without_its_content_exceeds_the_sheets_bound", a_cell_without_its_content));
    libtest_mimic::run(&arguments, trials).exit();
}

type Builder = RendererBuilder<WgpuBackend>;

fn built(add: impl FnOnce(Builder) -> Builder) -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Failed> {
    let (device, queue) = adapter::device()?;
    Ok(add(Renderer::builder(WgpuBackend::new(device, queue)?)).build(Arc::new(Scheduler::new(2)?))?)
}

fn contact_sheet() -> Result<(), Failed> {
    let drawn = drawn_sheet(built(processes::add_to)?, |submission: &WgpuSubmission, view, target: &str| {
        submission.read(view, target)
    })?;
    if std::env::var_os("DRAWLOOM_RENEW_REFERENCES").is_some() {
        drawn.save(stored_sheet())?;
    }
    expect_stored_sheet(&drawn, "drawloom-sheet.png")
}

fn contact_sheet_in_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let backend = SoftwareBackend::new(Arc::clone(&scheduler));
    let built = processes::add_to(Renderer::builder(backend)).build(scheduler)?;
    expect_stored_sheet(
        &drawn_sheet(built, |submission: &SoftwareSubmission, view, target: &str| submission.read(view, target))?,
        "drawloom-sheet-in-software.png",
    )
}

/// Draws the contact sheet; `read` reads a target of a view, by index.
fn drawn_sheet<B: Backend>(
    (mut renderer, submitter): (Renderer<B>, Submitter<B>),
    read: impl Fn(&B::Submission, usize, &str) -> Result<Picture, BackendError>,
) -> Result<RgbImage, Failed> {
    let gallery = Gallery::new()?;
    let submitted = submitter.submit(renderer.record(gallery.scene.as_scene_ref())?)?;
    let mut sheet = read(&submitted.submission, gallery.sheet_view(), contact_sheet::TARGET)?;
    contact_sheet::draw_labels(&mut sheet);
    as_image(&sheet)
}

fn stored_sheet() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/views/sheet.png")
}

/// How much a tile of a sheet may differ from the one that is shown.
///
/// The screen and the ball show pictures that are larger than they are, one pixel of them in each of theirs. Where that
/// pixel lies next to an edge, rounding decides on which side, and all of it differs: 0.076 in the worst tile in
/// software, and 0.044 on an NVIDIA H100. A tile whose content is missing differs by more.
const MAX_WORST_TILE: f64 = 0.1;

/// Compares a sheet with the one that is shown, and stores it as the temporary file `name` if they differ.
fn expect_stored_sheet(drawn: &RgbImage, name: &str) -> Result<(), Failed> {
    let distance = Distance::between(drawn, &image::open(stored_sheet())?.to_rgb8())?;
    if distance.root_mean_square <= 0.01 && distance.worst_tile <= MAX_WORST_TILE {
        return Ok(());
    }
    let found = std::env::temp_dir().join(name);
    drawn.save(&found)?;
    Err(format!("{distance:?} between {} and {}", stored_sheet().display(), found.display()).into())
}

/// The content of each cell, which is below its label, is replaced by its mean colour: no other plain colour is nearer
/// to it.
fn a_cell_without_its_content() -> Result<(), Failed> {
    let sheet = image::open(stored_sheet())?.to_rgb8();
    let [width, height] = gallery::SIZE;
    for bottom in (contact_sheet::CELL_HEIGHT..=sheet.height()).step_by(contact_sheet::CELL_HEIGHT as usize) {
        for left in (0..sheet.width()).step_by(width as usize) {
            let content = sheet.view(left, bottom - height, width, height).to_image();
            let mut sums = [0_u32; 3];
            for pixel in content.pixels() {
                sums.iter_mut().zip(pixel.0).for_each(|(sum, channel)| *sum += u32::from(channel));
            }
            let mean = Rgb(sums.map(|sum| (sum / (width * height)) as u8));
            let distance = Distance::between(&RgbImage::from_pixel(width, height, mean), &content)?;
            if distance.worst_tile <= MAX_WORST_TILE {
                return Err(format!("the cell at {left}, {}: {distance:?}", bottom - height).into());
            }
        }
    }
    Ok(())
}

/// The gallery's scene in the dark, with these cameras.
fn dark(cameras: Vec<Camera>) -> Result<Scene, Failed> {
    let mut scene = Gallery::new()?.scene;
    scene.lights.truncate(3);
    scene.cameras = cameras;
    Ok(scene)
}

fn main_camera() -> Result<Camera, Failed> {
    let camera = Gallery::new()?.scene.cameras.into_iter().find(|camera| camera.name == "main");
    Ok(camera.ok_or("the gallery has no main camera")?)
}

/// The root mean square error of the pictures of the main view.
fn error_between(one: &Picture, other: &Picture) -> Result<f64, Failed> {
    Ok(Distance::between(&as_image(one)?, &as_image(other)?)?.root_mean_square)
}

fn impostor() -> Result<(), Failed> {
    let (mut renderer, submitter) = built(processes::add_to)?;
    let mut draw = |cameras: Vec<Camera>| -> Result<Picture, Failed> {
        let scene = dark(cameras)?;
        Ok(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "picture")?)
    };
    let viewer = main_camera()?;
    let with = |layers: LayerMask| Camera { layers, ..viewer.clone() };
    let camera = impostor::camera(&viewer, None).ok_or("the tree is around the camera")?;
    let without = LayerMask(viewer.layers.0 & !impostor::LAYER.0);
    let original = draw(vec![with(without | impostor::TREE_LAYER)])?;
    let found = draw(vec![viewer.clone(), camera.clone()])?;
    let missing = draw(vec![with(without)])?;
    let [error, of_missing] = [error_between(&original, &found)?, error_between(&original, &missing)?];
    if error > of_missing * 0.3 {
        return Err(format!("the impostor differs by {error}, and without a tree it would be {of_missing}").into());
    }
    // From a little to the side, its picture stays, and is still nearer to the tree than nothing.
    let side = Camera { position: viewer.position + DVec3::X * 0.25, ..viewer.clone() };
    let kept = impostor::camera(&side, Some(&camera)).ok_or("the tree is around the camera")?;
    let original = draw(vec![Camera { layers: without | impostor::TREE_LAYER, ..side.clone() }])?;
    let missing = draw(vec![Camera { layers: without, ..side.clone() }])?;
    let found = draw(vec![side, kept])?;
    let [error, of_missing] = [error_between(&original, &found)?, error_between(&original, &missing)?];
    if error > of_missing * 0.7 {
        return Err(format!("from the side it differs by {error}, and without a tree it would be {of_missing}").into());
    }
    Ok(())
}

fn impostor_turns() -> Result<(), Failed> {
    let viewer = main_camera()?;
    let (center, radius) = impostor::TREE;
    let first = impostor::camera(&viewer, None).ok_or("the tree is around the camera")?;
    let mut around = viewer.clone();
    let turned = |angle: f64| center + drawloom::glam::DQuat::from_rotation_y(angle) * (viewer.position - center);
    let mut latest = first.clone();
    let mut redrawn = Vec::new();
    for step in 0..40 {
        let angle = 0.01 * f64::from(step);
        around.position = turned(angle);
        let next = impostor::camera(&around, Some(&latest)).ok_or("the tree is around the camera")?;
        let seen = (center - next.position).angle_between(center - around.position);
        if seen > impostor::MAX_ANGLE + 1e-9 {
            return Err(format!("at {angle} the picture has turned by {seen}").into());
        }
        if next != latest {
            redrawn.push(step);
        }
        latest = next;
    }
    // The camera is above the tree, so 0.39 radians around its axis are a smaller angle, but more than three times that
    // of a redraw.
    if redrawn.len() != 3 {
        return Err(format!("it was drawn again at steps {redrawn:?}").into());
    }
    around.position = center + DVec3::X * (radius * 0.9);
    match impostor::camera(&around, Some(&latest)) {
        None => Ok(()),
        Some(_) => Err("there is an impostor for a camera in the tree".into()),
    }
}

fn smoke() -> Result<(), Failed> {
    let viewer = main_camera()?;
    let draw = |divisor: Option<u32>| -> Result<Picture, Failed> {
        let (mut renderer, submitter) = built(|builder| {
            let builder = builder.pipeline(Deferred::new().post(ToneMapping::default()));
            match divisor {
                Some(divisor) => builder.process(Smoke::new(divisor)).process(UpsampledSmoke::new(divisor)),
                None => builder,
            }
        })?;
        let mut scene = dark(vec![viewer.clone()])?;
        // Nearer, so that candles stand before it.
        scene.cameras[0].position = DVec3::new(-1.6, 2.0, 7.5);
        Ok(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "picture")?)
    };
    let [none, all, quarter] = [draw(None)?, draw(Some(1))?, draw(Some(2))?];
    let smoke = Distance::between(&as_image(&none)?, &as_image(&all)?)?;
    let found = Distance::between(&as_image(&all)?, &as_image(&quarter)?)?;
    if found.root_mean_square > smoke.root_mean_square * 0.1 || found.worst_tile > 0.03 {
        return Err(format!("with a quarter of the pixels it differs by {found:?}; the smoke is {smoke:?}").into());
    }
    Ok(())
}
