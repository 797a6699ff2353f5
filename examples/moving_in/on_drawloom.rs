//! The engine's renderer on Drawloom, which culls, sorts and records on all workers, and keeps what did not change.
//!
//! Drawables, shaders, pipelines, bind groups and targets are the engine's, and stay as they are. The engine's
//! `DrawPass` wraps a [`RenderEncoder`], which in wgpu is a pass or a bundle. An engine that wraps a
//! [`wgpu::RenderPass`] either changes that type, or lends its drawables as [`ItemRecorder::Pass`]; then no bundles are
//! kept.

use std::error::Error;
use std::slice;
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, Items, RecordItems,
    RenderProcess,
};
use drawloom::scene::{Assets, Camera, Changes, ClipPlane, LayerMask, Projection, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::BoundingSphere;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, Granularity, Renderer, Submitter};

use super::drawables::Sphere;
use super::engine::{Engine, FIELD_OF_VIEW, MAIN, MIRROR, NEAR, SHADOW, SIZES, SKY};

pub struct OnDrawloom {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    /// Empty: meshes and materials are the engine's.
    assets: Assets,
    // Of each drawable:
    bounds: Vec<BoundingSphere>,
    layers: Vec<LayerMask>,
    versions: Vec<u64>,
}

impl OnDrawloom {
    pub fn new(engine: &Engine, scheduler: Arc<Scheduler>, granularity: Granularity) -> Result<Self, Box<dyn Error>> {
        let backend = WgpuBackend::new(engine.device.clone(), engine.queue.clone())?;
        let builder = Renderer::builder(backend).process(ShadowMap).process(Surfaces).output(PICTURE);
        let (renderer, submitter) = builder.granularity(granularity).build(scheduler)?;
        Ok(Self {
            renderer,
            submitter,
            assets: Assets::default(),
            bounds: engine.spheres.iter().map(bounding_sphere).collect(),
            layers: engine.view_masks.iter().map(|&views| LayerMask(views)).collect(),
            // A drawable that moves has the same draw calls: its position is in a buffer.
            versions: vec![0; engine.spheres.len()],
        })
    }

    /// Draws a frame.
    pub fn draw(&mut self, engine: &Engine) -> Result<(), Box<dyn Error>> {
        for (bounds, sphere) in self.bounds.iter_mut().zip(&engine.spheres[..engine.moving]) {
            *bounds = bounding_sphere(sphere);
        }
        let cameras = cameras(engine);
        // Materials sample the shadow map and the mirror's picture, so these stay the engine's textures.
        for (camera, view) in cameras.iter().zip(&engine.views) {
            let (target, texture) = match &view.color {
                Some(color) => (PICTURE, &color.texture),
                None => (DEPTH, &view.depth.texture),
            };
            self.renderer.backend().import_target(camera.name.as_str(), target, texture.clone());
        }
        let moving = 0..engine.moving as u32;
        let items_of = |process| Items {
            bounds: &self.bounds,
            layers: &self.layers,
            versions: &self.versions,
            changes: Changes::Ranges(slice::from_ref(&moving)),
            ..Items::new(process, &engine.keys, ItemRecorder::Any(engine))
        };
        let recorded = self.renderer.record_with(FrameInputs {
            items: &[items_of(ShadowMap.name()), items_of(Surfaces.name())],
            ..FrameInputs::new(SceneRef { cameras: &cameras, ..SceneRef::new(&self.assets) })
        })?;
        self.submitter.submit(recorded)?;
        Ok(())
    }
}

impl RecordItems for Engine {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        drawables: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let view = match context.view.kind() {
            ViewKind::Shadow => SHADOW,
            ViewKind::Reflection => MIRROR,
            _ => MAIN,
        };
        self.draw_all(encoder, view, drawables.items().iter().copied());
        Ok(())
    }
}

const PICTURE: &str = "picture";
const DEPTH: &str = "depth";

struct ShadowMap;

impl RenderProcess for ShadowMap {
    fn name(&self) -> &str {
        "shadow map"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth(DEPTH, Format::Depth32Float);
        // Only the engine's own bind groups refer to the map, so the frame sees no process that samples it.
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

/// What the main camera and the mirrored one see.
struct Surfaces;

impl RenderProcess for Surfaces {
    fn name(&self) -> &str {
        "surfaces"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Main);
        declare.also_views(ViewKind::Reflection);
        declare.clears_color(PICTURE, Format::Rgba8Srgb, ClearColor::Value(SKY));
        declare.clears_depth(DEPTH, Format::Depth32Float);
        // The mirror's bind group has the reflection.
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

/// Cameras that see what the engine's matrices show, in the order of its views. Frames draw views in the order of their
/// kinds, which is that of the engine too.
fn cameras(engine: &Engine) -> [Camera; 3] {
    let reach = engine.shadow_reach;
    let sun = Camera {
        kind: ViewKind::Shadow,
        projection: Projection::Orthographic { height: 2.0 * reach },
        near: 1.0,
        far: 2.0 * reach,
        size: SIZES[SHADOW],
        layers: LayerMask::layer(SHADOW as u32),
        ..Camera::looking_at("sun", engine.shadow_eye().as_dvec3(), DVec3::ZERO)
    };
    let main = Camera {
        projection: Projection::Perspective { field_of_view: FIELD_OF_VIEW },
        near: NEAR,
        size: SIZES[MAIN],
        layers: LayerMask::layer(MAIN as u32),
        ..Camera::looking_at("main", engine.eye.as_dvec3(), DVec3::ZERO)
    };
    let ground = ClipPlane { point: DVec3::ZERO, normal: Vec3::Y };
    let mirror =
        Camera { size: SIZES[MIRROR], layers: LayerMask::layer(MIRROR as u32), ..main.reflected("mirror", ground) };
    [sun, mirror, main]
}

fn bounding_sphere(sphere: &Sphere) -> BoundingSphere {
    BoundingSphere { center: sphere.center.as_dvec3(), radius: sphere.radius }
}
