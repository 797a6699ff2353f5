//! Renderers of a small scene.

use std::fmt::{Debug, Display};
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Backend, NullBackend, SoftwareBackend, WgpuBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, Texture};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{FrameError, RecordedFrame, Renderer, SubmittedFrame, Submitter};
use drawloom_testing::adapter::noop_device;
use libtest_mimic::Failed;

/// Longer than anything here takes, also on a machine that is busy.
pub const LONG: Duration = Duration::from_secs(100);

/// Numbers that mean "as many as there are", and what overflows when it is added to or multiplied.
pub const SIZES: [usize; 7] = [0, 1, u32::MAX as usize, 1 << 62, 1 << 63, usize::MAX - 1, usize::MAX];

/// The same for 32 bits.
pub const COUNTS: [u32; 5] = [0, 1, 1 << 31, u32::MAX - 1, u32::MAX];

/// The same for times.
pub const DURATIONS: [Duration; 6] = [
    Duration::ZERO,
    Duration::from_nanos(1),
    Duration::from_nanos(u64::MAX),
    Duration::from_secs(1 << 62),
    Duration::from_secs(u64::MAX),
    Duration::MAX,
];

/// Special numbers.
pub const FLOATS: [f32; 12] = [
    0.0,
    -0.0,
    -1.0,
    1.0,
    f32::MIN_POSITIVE,
    1e-45,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    16_777_216.0,
];

/// Fails unless a condition holds.
pub fn ensure(holds: bool, otherwise: impl Display) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(otherwise.to_string().into()) }
}

/// Fails unless something is an error whose message contains a text.
pub fn refused<T, E: Display>(result: Result<T, E>, text: &str) -> Result<(), Failed> {
    match result {
        Err(error) if error.to_string().contains(text) => Ok(()),
        Err(error) => Err(format!("the error does not contain {text:?}: {error}").into()),
        Ok(_) => Err(format!("there is no error with {text:?}").into()),
    }
}

/// Fails unless both are equal.
pub fn same<T: PartialEq + Debug>(found: T, expected: T, what: impl Display) -> Result<(), Failed> {
    ensure(found == expected, format_args!("{what}: {found:?} instead of {expected:?}"))
}

/// A box with a texture, a lamp with a shadow, and a camera.
pub fn scene() -> Scene {
    let mut scene = Scene::new();
    let texture = scene.add(Texture::new("grey", 2, 2, vec![200; 16]).unwrap()).unwrap();
    let material = scene.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
    let mesh = scene.add(Mesh::cuboid("box", Vec3::ONE).unwrap()).unwrap();
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    scene.cameras.push(Camera { size: [16, 16], ..Camera::looking_at("main", DVec3::Z * 3.0, DVec3::ZERO) });
    let (position, intensity) = (DVec3::new(0.0, 1.0, 3.0), Vec3::ONE * 5.0);
    scene.lights.push(Light::Point { position, intensity, range: 20.0, casts_shadow: true });
    scene.ambient = Vec3::splat(0.25);
    scene
}

/// Maps that the software backend draws in no time.
pub fn small_maps() -> ShadowMaps {
    ShadowMaps { side: 16, ..ShadowMaps::default() }
}

/// A renderer with a submitter.
pub struct Fixture<B: Backend> {
    pub renderer: Renderer<B>,
    pub submitter: Submitter<B>,
}

impl Fixture<NullBackend> {
    pub fn null(workers: usize) -> Self {
        Self::new(NullBackend, workers, Deferred::to_picture()).unwrap()
    }
}

impl Fixture<SoftwareBackend> {
    pub fn software(deferred: Deferred) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(1)?);
        let backend = SoftwareBackend::new(Arc::clone(&scheduler));
        let builder = Renderer::builder(backend).pipeline(deferred).shadow_maps(small_maps());
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Self { renderer, submitter })
    }
}

impl Fixture<WgpuBackend> {
    /// On the device of wgpu that does nothing, but checks everything.
    pub fn noop(workers: usize, deferred: Deferred) -> Result<Self, Failed> {
        Self::new(noop_backend()?, workers, deferred)
    }
}

pub fn noop_backend() -> Result<WgpuBackend, Failed> {
    let (device, queue) = noop_device()?;
    Ok(WgpuBackend::new(device, queue)?)
}

impl<B: Backend> Fixture<B> {
    pub fn new(backend: B, workers: usize, deferred: Deferred) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let (renderer, submitter) = Renderer::builder(backend).pipeline(deferred).build(scheduler)?;
        Ok(Self { renderer, submitter })
    }

    pub fn record(&mut self, scene: &Scene) -> Result<RecordedFrame<B>, FrameError> {
        self.renderer.record(scene.as_scene_ref())
    }

    pub fn draw(&mut self, scene: &Scene) -> Result<SubmittedFrame<B>, Failed> {
        let recorded = self.record(scene)?;
        Ok(self.submitter.submit(recorded)?)
    }

    /// Fails unless the usual scene is drawn, with its object.
    pub fn expect_usual(&mut self, when: impl Display) -> Result<(), Failed> {
        let submitted = self.draw(&scene()).map_err(|failed| format!("{when}: {failed:?}"))?;
        same(submitted.statistics.views[0].visible, 1, when)
    }
}
