//! Renders a scene through the whole frame, and reports its times. Without a graphics adapter the software backend
//! draws it, but not the frames of a camera path: other processes may draw theirs on an adapter.
//!
//!     cargo run --release --example frame
//!     cargo run --release --example frame -- scene.obj --workers 4 --granularity chunk:64 --record cached --frames 100
//!     cargo run --release --example frame -- scene.obj --frames 100 --explain --html timeline.html --timeline trace.json
//!     cargo run --release --example frame -- scene.obj --frames 40..80 --path flight.txt --out shot-####.png
//!
//! Its exit status is 0 if all is drawn and written; 1 if drawing or writing failed or there is no adapter, which may
//! go well another time or on another machine; and 2 if the arguments or the files that they name are wrong, which
//! fails again.

mod arguments;
mod camera_path;
mod content;
mod device;
mod pipeline;
mod report;
mod sequence;
mod timeline;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, NullBackend, Picture, WgpuBackend};
use drawloom::process::targets;
use drawloom::scene::{Mesh, Scene};
use drawloom::task::Scheduler;
use drawloom::timeline::Log;
use drawloom::{FrameStatistics, SubmittedFrame, wgpu};
use drawloom_output::{path_text, print_diagnostic, print_line};
use drawloom_testing::adapter;
use drawloom_testing::demo;
use indicatif::{ProgressBar, ProgressStyle};

use arguments::{Arguments, BackendName, Frames};
use content::{Content, print_warnings};
use device::{Device, NoDevice, WgpuDevice};
use report::Report;
use sequence::Sequence;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(drawloom_output::diagnostics)
        .without_time()
        .with_target(false)
        .init();
    let arguments = Arguments::checked(std::env::args_os()).unwrap_or_else(|error| drawloom_output::exit_with(error));
    let with_causes = |error: Box<dyn Error>| with_causes(error.as_ref());
    match Input::load(&arguments).map_err(with_causes) {
        Ok(input) => drawloom_output::exit_code(run(&arguments, input).map_err(with_causes)),
        Err(error) => {
            print_diagnostic!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// What the files that the command line names hold.
struct Input {
    scene: Scene,
    /// What was found in the scene's file, to be printed.
    found: Option<String>,
    content: Content,
    /// Where a range of frames is to be drawn.
    sequence: Option<Sequence>,
}

impl Input {
    fn load(arguments: &Arguments) -> Result<Self, Box<dyn Error>> {
        let sequence = match &arguments.frames {
            Frames::Range(range) => Some(Sequence::new(arguments, range.clone())?),
            Frames::Count(_) => None,
        };
        let (scene, found, content) = load_scene(arguments)?;
        Ok(Self { scene, found, content, sequence })
    }
}

fn run(arguments: &Arguments, Input { scene, found, content, sequence }: Input) -> Result<(), Box<dyn Error>> {
    if let Some(sequence) = sequence {
        found.into_iter().for_each(print_line);
        return sequence.draw(arguments, scene, || pipeline::adapter_backend(arguments));
    }
    let (report, log) = match arguments.backend {
        Some(BackendName::Null) => {
            let drawn = draw(arguments, BackendName::Null, &scene, |_| NullBackend, NoDevice)?;
            (drawn.report, drawn.log)
        }
        Some(BackendName::Noop) => {
            let backend = pipeline::wgpu_backend(arguments, adapter::noop_device()?)?;
            let drawn = draw(arguments, BackendName::Noop, &scene, |_| backend, WgpuDevice::timed(false))?;
            (drawn.report, drawn.log)
        }
        Some(BackendName::Wgpu) => draw_on_adapter(arguments, &scene, pipeline::adapter_backend(arguments)?)?,
        Some(software @ (BackendName::Software | BackendName::Reference)) => {
            draw_in_software(arguments, software, &scene, None)?
        }
        None => match pipeline::adapter_backend(arguments) {
            Ok(backend) => draw_on_adapter(arguments, &scene, backend)?,
            // `--record` implies wgpu.
            Err(error) if arguments.record.is_some() => return Err(error),
            Err(error) => draw_in_software(arguments, BackendName::Software, &scene, Some(&*error))?,
        },
    };
    let report = report.with_content(content);
    // Files first: they do not depend on where the output goes.
    if let Some(file) = &arguments.report {
        report.write(file)?;
    }
    let of_timeline = timeline::write_outputs(arguments, &log)?;
    found.into_iter().for_each(print_line);
    if let Some(picture) = &arguments.out {
        print_line!("{} written", path_text(picture.path()));
    }
    print_line(&report);
    of_timeline.into_iter().for_each(print_line);
    Ok(())
}

fn draw_on_adapter(
    arguments: &Arguments,
    scene: &Scene,
    backend: WgpuBackend,
) -> Result<(Report, Log), Box<dyn Error>> {
    let is_timed = arguments.html.is_some() || arguments.timeline.is_some();
    let is_timed = is_timed && backend.device().features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let backend = if is_timed { backend.time_passes()? } else { backend };
    let drawn = draw(arguments, BackendName::Wgpu, scene, |_| backend, WgpuDevice::timed(is_timed))?;
    save(arguments, &drawn.last.submission.read(0, targets::PICTURE)?)?;
    Ok((drawn.report, drawn.log))
}

/// Draws with the software backend. `reason` is why wgpu cannot, if software was not requested.
fn draw_in_software(
    arguments: &Arguments,
    name: BackendName,
    scene: &Scene,
    reason: Option<&dyn Error>,
) -> Result<(Report, Log), Box<dyn Error>> {
    let make = |scheduler: &Arc<Scheduler>| pipeline::software_backend(Some(name), scheduler);
    let drawn = draw(arguments, name, scene, make, NoDevice)?;
    save(arguments, &drawn.last.submission.read(0, targets::PICTURE)?)?;
    Ok((drawn.report.because(reason.map(with_causes)), drawn.log))
}

fn load_scene(arguments: &Arguments) -> Result<(Scene, Option<String>, Content), Box<dyn Error>> {
    let (mut found, mut content) = (None, Content::default());
    let mut scene = match &arguments.scene {
        None => demo::colonnade()?,
        Some(path) => {
            let mut imported = drawloom_obj::load_within(path, &arguments.obj_limits())
                .inspect_err(|error| print_warnings(error.warnings()))?;
            content = Content::of_file(&imported);
            found = Some(format!(
                "{}: {} triangles, and {} degenerate ones left out",
                path_text(path),
                imported.triangles,
                imported.degenerate_triangles
            ));
            demo::add_camera_and_lights_upright(&mut imported.scene, arguments.up.axis());
            imported.scene
        }
    };
    for camera in &mut scene.cameras {
        if let Some(placed) = &arguments.camera {
            placed.apply(camera, arguments.up.axis());
        }
        camera.size = arguments.size.0;
    }
    scene.duplicate_objects(arguments.copies as usize);
    content.count(&scene);
    if arguments.cull_triangles {
        let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
        for (handle, mesh) in meshes {
            scene.replace(handle, mesh.with_triangle_culling(true))?;
        }
    }
    Ok((scene, found, content))
}

/// The results of all frames.
struct Drawn<B: Backend> {
    last: SubmittedFrame<B>,
    report: Report,
    /// Empty unless a timeline was requested.
    log: Log,
}

/// Draws all frames.
fn draw<B: Backend>(
    arguments: &Arguments,
    name: BackendName,
    scene: &Scene,
    make: impl FnOnce(&Arc<Scheduler>) -> B,
    mut device: impl Device<B>,
) -> Result<Drawn<B>, Box<dyn Error>> {
    let (mut renderer, submitter) = pipeline::renderer(arguments, scene, make)?;
    let workers = renderer.scheduler().workers();
    let timeline = Arc::clone(renderer.scheduler().timeline());
    let frames = arguments.frames.count();
    let progress = ProgressBar::new(u64::from(frames));
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {per_sec}, {eta} left")?);
    let mut measured: Vec<(Duration, FrameStatistics)> = Vec::new();
    let mut last = None;
    for number in 0..frames {
        let first_recorded_frame = timeline::first_recorded_frame(arguments);
        // One frame more is recorded first, and dropped: it describes the graph and touches the rings' memory. If there
        // are no more frames than are reported, the first one stays.
        if first_recorded_frame.is_some_and(|first| first.saturating_sub(1) == number) {
            timeline.start();
        }
        if first_recorded_frame == Some(number) {
            drop(timeline.take());
            device.start(renderer.backend(), &timeline)?;
        }
        let start = Instant::now();
        let recorded = renderer.record(scene.as_scene_ref())?;
        let frame_number = recorded.frame_number();
        let submitted = submitter.submit(recorded)?;
        let cpu = start.elapsed();
        // The next frame must not compete with a device that is still busy with this one.
        device.wait(&submitted.submission, frame_number)?;
        measured.push((cpu, submitted.statistics.clone()));
        last = Some(submitted);
        progress.inc(1);
    }
    progress.finish_and_clear();
    if let Some(file) = &arguments.graph {
        file.write_all(renderer.plan().to_dot())?;
    }

    timeline.stop();
    let log = Log { device: device.end(renderer.backend(), &timeline)?, ..timeline.take() };
    let report = Report::new(renderer.backend().adapter_name(), name, arguments, workers, &measured);
    Ok(Drawn { last: last.ok_or("no frame was drawn")?, report, log })
}

fn save(arguments: &Arguments, picture: &Picture) -> Result<(), Box<dyn Error>> {
    if let Some(file) = &arguments.out {
        file.write([picture.width, picture.height], &picture.bytes)?;
    }
    Ok(())
}

fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let inner_text = inner.to_string();
        // Some messages include their cause already.
        if !text.ends_with(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        cause = inner.source();
    }
    text
}
