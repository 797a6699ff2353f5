//! A backend that logs each call that frames make to another one, and how long it took.
//!
//!     cargo run --release --example logging_backend
//!
//! Copy [`LoggingBackend`] to see what a frame asks of a device, or to begin a backend that changes some of these
//! calls.

use std::error::Error;
use std::ops::Range;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::Renderer;
use drawloom::backend::{Backend, BackendError, BackendExtras, BackendLayer, NullBackend, PassRequest};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene};
use drawloom::task::Scheduler;
use drawloom_output::print_line;
use parking_lot::Mutex;

/// Passes each call on, and logs it.
struct LoggingBackend<B> {
    inner: B,
    /// In the order in which they ended.
    calls: Mutex<Vec<(String, Duration)>>,
}

impl<B> LoggingBackend<B> {
    fn log<R>(&self, name: impl Into<String>, call: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = call();
        self.calls.lock().push((name.into(), start.elapsed()));
        result
    }
}

impl<B: Backend> BackendLayer for LoggingBackend<B> {
    type Inner = B;

    fn inner(&self) -> &B {
        &self.inner
    }

    /// Gets all calls but those that are implemented below.
    fn forward<R>(&self, method: &'static str, call: impl FnOnce() -> R) -> R {
        self.log(method, call)
    }

    fn record(
        &self,
        frame: &B::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        emit: &mut dyn FnMut(B::Part),
    ) -> Result<(), BackendError> {
        let process = &pass.frame.plan.processes()[pass.pass.process_index].name;
        let view = pass.frame.views[pass.pass.view_index].name();
        self.log(format!("record {parts:?} of {process:?} in {view:?}"), || self.inner.record(frame, pass, parts, emit))
    }

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

/// Those that a frame asks for.
impl<B: Backend> BackendExtras for LoggingBackend<B> {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        Some(self.inner.extras())
    }

    fn uploaded_bytes(&self) -> u64 {
        self.log("uploaded_bytes", || self.inner.extras().uploaded_bytes())
    }

    fn has_background_work(&self) -> bool {
        self.log("has_background_work", || self.inner.extras().has_background_work())
    }

    fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
        self.log("counters", || self.inner.extras().counters(count));
    }

    fn discard_frame(&self) {
        self.log("discard_frame", || self.inner.extras().discard_frame());
    }

    fn forget_histories(&self) {
        self.log("forget_histories", || self.inner.extras().forget_histories());
    }

    fn imports_targets_of(&self, view: &str) -> bool {
        self.log("imports_targets_of", || self.inner.extras().imports_targets_of(view))
    }
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let backend = LoggingBackend { inner: NullBackend, calls: Mutex::default() };
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    let (mut renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler)?;

    let mut scene = Scene::new();
    let mesh = scene.add(Mesh::cuboid("box", Vec3::ONE)?)?;
    let material = scene.add(Material::default())?;
    for x in -1..=1 {
        scene.add_object(RenderObject::new(mesh, material, DVec3::X * f64::from(x) * 2.0))?;
    }
    scene.cameras.push(Camera::looking_at("main", DVec3::new(0.0, 2.0, 5.0), DVec3::ZERO));
    scene.lights.push(Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true });

    for frame in ["the first frame", "a frame at rest"] {
        submitter.submit(renderer.record(scene.as_scene_ref())?)?;
        print_line!("{frame}:");
        for (name, took) in renderer.backend().calls.lock().drain(..) {
            print_line!("{:10.1} us  {name}", took.as_secs_f64() * 1e6);
        }
    }
    Ok(())
}
