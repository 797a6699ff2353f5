//! Draws opaque objects, and counts the fragments that are shaded.

use std::error::Error;
use std::ops::AddAssign;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use drawloom::backend::SoftwareBackend;
use drawloom::process::{
    ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, ObjectCpuShader, ObjectPixel, PassInputs,
    RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::quality::{DepthPrecision, Quality};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Camera, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};

/// The process's name.
pub const SURFACES: &str = "surfaces";

/// The target: 0 where nothing was drawn, and 255 elsewhere.
pub const COVERAGE: &str = "coverage";

/// Draws opaque objects. Only the CPU shader counts.
#[derive(Clone, Default)]
pub struct Surfaces {
    fragments: Arc<AtomicU64>,
}

impl RenderProcess for Surfaces {
    fn name(&self) -> &str {
        SURFACES
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(COVERAGE, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: include_str!("fragment_counter.wgsl"), ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.clone()))
    }
}

impl<R: Real> ObjectCpuShader<R> for Surfaces {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, _pass: &PassInputs<'_, R>, _pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        // Relaxed: the count is read after the frame has been submitted, by which time it is drawn.
        self.fragments.fetch_add(1, Ordering::Relaxed);
        targets[0] = Vector4::splat(R::one());
        true
    }
}

/// The counts of one frame or several.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Fragments that passed the depth test.
    pub fragments: u64,
    /// Pixels that a fragment was written to.
    pub covered: u64,
    /// Instanced draws.
    pub draws: usize,
}

impl Counts {
    pub fn overdraw(&self) -> f64 {
        self.fragments as f64 / self.covered as f64
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.fragments += other.fragments;
        self.covered += other.covered;
        self.draws += other.draws;
    }
}

/// A renderer on the software backend.
pub struct FragmentCounter {
    pub renderer: Renderer<SoftwareBackend>,
    submitter: Submitter<SoftwareBackend>,
    fragments: Arc<AtomicU64>,
}

impl FragmentCounter {
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn new(scheduler: &Arc<Scheduler>) -> Result<Self, Box<dyn Error>> {
        let surfaces = Surfaces::default();
        let fragments = Arc::clone(&surfaces.fragments);
        let backend = SoftwareBackend::new(Arc::clone(scheduler));
        let (renderer, submitter) =
            Renderer::builder(backend).process(surfaces).output(COVERAGE).build(Arc::clone(scheduler))?;
        Ok(Self { renderer, submitter, fragments })
    }

    /// Draws the opaque objects that a camera sees in this order.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    pub fn count(&mut self, scene: &Scene, camera: &Camera, order: DepthPrecision) -> Result<Counts, Box<dyn Error>> {
        self.renderer.set_quality(Quality { opaque_order: order, ..Quality::default() })?;
        self.fragments.store(0, Ordering::Relaxed);
        let scene = SceneRef { cameras: std::slice::from_ref(camera), ..scene.as_scene_ref() };
        let submitted = self.submitter.submit(self.renderer.record(scene)?)?;
        let picture = submitted.submission.read(0, COVERAGE)?;
        Ok(Counts {
            fragments: self.fragments.load(Ordering::Relaxed),
            covered: picture.bytes.chunks_exact(4).filter(|pixel| pixel[0] != 0).count() as u64,
            draws: submitted.statistics.views.iter().map(|view| view.batches).sum(),
        })
    }
}
