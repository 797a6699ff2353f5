//! A frame that cannot be drawn returns an error that names the cause, and the next frame is complete.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::BackendError;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel,
    ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess, ShaderObject, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector4};
use drawloom::{FrameError, SubmitError};
use drawloom_testing::scenes::field;

use crate::{Fixture, deferred};

/// The function of the CPU shader that panics.
const NONE: usize = 0;
const CPU_SHADER: usize = 1;
const VERTEX: usize = 2;
const FRAGMENT: usize = 3;

/// A process whose CPU shader panics in a chosen function.
#[derive(Clone)]
struct PanickingProcess(Arc<AtomicUsize>);

impl PanickingProcess {
    fn panic_in(&self, function: usize) {
        assert!(self.0.load(Ordering::Relaxed) != function, "a deliberate panic");
    }
}

impl RenderProcess for PanickingProcess {
    fn name(&self) -> &str {
        "panicking"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        self.panic_in(CPU_SHADER);
        Some(CpuShader::objects(self.clone()))
    }
}

impl<R: Real> ObjectCpuShader<R> for PanickingProcess {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        self.panic_in(VERTEX);
        let relative = object.origin + object.orientation.rotate(object.scale * vertex.position);
        let [x, y, z, w] = pass.view.clip_from_relative;
        let clip = x * relative[0] + y * relative[1] + z * relative[2] + w;
        VertexOutput { clip, varyings: [R::zero(); drawloom::process::VARYINGS] }
    }

    fn fragment(&self, _pass: &PassInputs<'_, R>, _pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        self.panic_in(FRAGMENT);
        targets[0] = Vector4::splat(R::one());
        true
    }
}

#[test]
fn a_panic_in_a_cpu_shader_names_the_process_and_the_next_frame_is_complete() {
    let panicking_function = Arc::new(AtomicUsize::new(NONE));
    let process = PanickingProcess(Arc::clone(&panicking_function));
    let mut fixture = Fixture::new(3, |builder| builder.process(process).output("own"));
    let scene = field(200);
    let expected = fixture.draw(&scene).read(0, "own").unwrap();
    assert!(expected.bytes.contains(&255) && expected.bytes.contains(&0));
    for function in [CPU_SHADER, VERTEX, FRAGMENT, CPU_SHADER, FRAGMENT] {
        panicking_function.store(function, Ordering::Relaxed);
        let error = match fixture.renderer.record(scene.as_scene_ref()) {
            Err(FrameError::Backend(error)) if function == CPU_SHADER => error,
            Ok(recorded) if function != CPU_SHADER => match fixture.submitter.submit(recorded) {
                Err(SubmitError::Backend(error)) => error,
                other => panic!("{function}: {:?}", other.err()),
            },
            other => panic!("{function}: {:?}", other.err()),
        };
        let BackendError::CpuShaderPanicked { process, message } = error else { panic!("{function}: {error}") };
        assert_eq!((process.as_str(), message.as_str()), ("panicking", "a deliberate panic"));
        panicking_function.store(NONE, Ordering::Relaxed);
        assert!(fixture.draw(&scene).read(0, "own").unwrap() == expected);
    }
}

/// A process with no CPU shader, or with one of the wrong kind.
struct InvalidProcess {
    cpu_shader: Option<CpuShader>,
    samples_its_target: bool,
}

impl RenderProcess for InvalidProcess {
    fn name(&self) -> &str {
        "invalid"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.after("transparency");
        if self.samples_its_target {
            declare.samples("radiance");
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        self.cpu_shader.clone()
    }
}

struct DiscardAll;

impl<R: Real> FullScreenCpuShader<R> for DiscardAll {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, _: &mut [Vector4<R>]) -> bool {
        false
    }
}

fn error_of(process: impl RenderProcess + 'static) -> BackendError {
    let mut fixture = Fixture::new(2, |builder| builder.pipeline(deferred()).process(process));
    match fixture.renderer.record(field(10).as_scene_ref()) {
        Err(FrameError::Backend(error)) => error,
        other => panic!("{:?}", other.err()),
    }
}

#[test]
fn the_error_names_a_process_without_a_cpu_shader() {
    let error = error_of(InvalidProcess { cpu_shader: None, samples_its_target: false });
    assert!(matches!(&error, BackendError::NoCpuShader { process } if process == "invalid"), "{error}");
}

#[test]
fn a_cpu_shader_of_another_kind_is_refused() {
    let cpu_shader = Some(CpuShader::objects(PanickingProcess(Arc::default())));
    let error = error_of(InvalidProcess { cpu_shader, samples_its_target: false });
    assert!(matches!(&error, BackendError::Validation { label, .. } if label == "invalid"), "{error}");
}

#[test]
fn a_process_that_samples_a_target_that_it_writes_is_refused() {
    let error =
        error_of(InvalidProcess { cpu_shader: Some(CpuShader::full_screen(DiscardAll)), samples_its_target: true });
    assert!(matches!(&error, BackendError::Validation { label, .. } if label == "invalid"), "{error}");
}

#[test]
fn picture_sizes_and_camera_positions_have_limits() {
    let mut fixture = Fixture::new(2, |builder| builder.pipeline(deferred()));
    let expected = fixture.picture(&field(10));
    let mut large = field(10);
    large.cameras[1].size = [16_385, 1];
    match fixture.renderer.record(large.as_scene_ref()) {
        Err(FrameError::Backend(BackendError::TargetTooLarge {
            allowed: 16_384, width: 16_385, height: 1, ..
        })) => {}
        other => panic!("{:?}", other.err()),
    }
    let mut far = field(10);
    far.cameras[1].position = DVec3::X * 5e9;
    match fixture.renderer.record(far.as_scene_ref()) {
        Err(FrameError::Backend(BackendError::ViewOutOfReach { view })) => assert_eq!(view, "side"),
        other => panic!("{:?}", other.err()),
    }
    assert!(fixture.picture(&field(10)) == expected);
}

#[test]
fn the_error_names_a_missing_target() {
    let submission = Fixture::new(2, |builder| builder.pipeline(deferred())).draw(&field(10));
    for (view, target) in [(0, "pictures"), (2, "picture")] {
        match submission.read(view, target) {
            Err(BackendError::UnknownTarget { view: named, target: name, known }) => {
                assert_eq!((named, &*name), (view, target));
                assert_eq!(known.contains("\"picture\""), view == 0, "{known}");
            }
            other => panic!("{:?}", other.err()),
        }
    }
}
