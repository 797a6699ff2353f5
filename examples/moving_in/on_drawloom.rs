//! The same engine on Drawloom. Its world, shaders, pipelines, bind groups and targets are those of [`engine`]; the
//! loop that culls, sorts and draws is gone.
//!
//! [`engine`]: super::engine

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, Items, RecordItems,
    RenderProcess,
};
use drawloom::scene::{Assets, Camera, ClipPlane, LayerMask, Projection, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::BoundingSphere;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, Renderer, Submitter, wgpu};

use super::engine::{Engine, FIELD_OF_VIEW, MAIN, MIRROR, NEAR, Object, SHADOW, SIZES, SKY};

/// The engine, and what Drawloom has of its objects.
pub struct EngineOnDrawloom {
    pub engine: Engine,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    /// There are none: meshes and materials are the engine's.
    assets: Assets,
    keys: Vec<u64>,
    bounds: Vec<BoundingSphere>,
    layers: Vec<LayerMask>,
    versions: Vec<u64>,
}

impl EngineOnDrawloom {
    pub fn new(engine: Engine, scheduler: Arc<Scheduler>) -> Result<Self, Box<dyn Error>> {
        let backend = WgpuBackend::new(engine.device.clone(), engine.queue.clone())?;
        let builder = Renderer::builder(backend).process(ShadowMap).process(Surfaces).output(PICTURE);
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Self {
            renderer,
            submitter,
            assets: Assets::default(),
            keys: engine.objects.iter().map(|object| engine.key(object)).collect(),
            bounds: engine.objects.iter().map(bounding_sphere).collect(),
            layers: engine.objects.iter().map(|object| LayerMask(object.views)).collect(),
            // Objects that move keep their draw calls: where they are is in a buffer.
            versions: vec![0; engine.objects.len()],
            engine,
        })
    }

    /// Draws a frame.
    pub fn draw(&mut self) -> Result<(), Box<dyn Error>> {
        let engine = &self.engine;
        for (bounds, object) in self.bounds.iter_mut().zip(&engine.objects[..engine.moving]) {
            *bounds = bounding_sphere(object);
        }
        let cameras = cameras(engine);
        let backend = self.renderer.backend();
        // Materials sample the shadow map and the mirror's picture, so these stay the engine's textures.
        backend.import_target(cameras[SHADOW].name.as_str(), DEPTH, engine.views[SHADOW].depth.texture.clone());
        for view in [MIRROR, MAIN] {
            if let Some(color) = &engine.views[view].color {
                backend.import_target(cameras[view].name.as_str(), PICTURE, color.texture.clone());
            }
        }
        let items_of = |process| Items {
            process,
            keys: &self.keys,
            bounds: &self.bounds,
            layers: &self.layers,
            versions: &self.versions,
            recorder: ItemRecorder::Any(engine),
        };
        let recorded = self.renderer.record_with(FrameInputs {
            items: &[items_of(ShadowMap.name()), items_of(Surfaces.name())],
            ..FrameInputs::new(SceneRef { cameras: &cameras, ..SceneRef::new(&self.assets) })
        })?;
        self.submitter.submit(recorded)?;
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
        // The engine's own bind groups have the map, so no process says that it samples it.
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
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

/// Cameras that see what the engine's matrices show, by the engine's numbers of views.
fn cameras(engine: &Engine) -> [Camera; 3] {
    let reach = engine.shadow_reach();
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
    let mirrored = main.reflected("mirror", ground);
    let mirror = Camera { size: SIZES[MIRROR], layers: LayerMask::layer(MIRROR as u32), ..mirrored };
    [sun, mirror, main]
}

fn bounding_sphere(object: &Object) -> BoundingSphere {
    let (center, radius) = object.sphere();
    BoundingSphere { center: center.as_dvec3(), radius }
}

impl RecordItems for Engine {
    /// The loop of the engine's `draw_objects`, with another type of encoder.
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        objects: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let view = match context.view.kind() {
            ViewKind::Shadow => SHADOW,
            ViewKind::Reflection => MIRROR,
            ViewKind::Main | ViewKind::Post => MAIN,
        };
        encoder.set_bind_group(0, Some(&self.views[view].group), &[]);
        if view != SHADOW {
            encoder.set_bind_group(2, Some(&self.light), &[]);
        }
        let (mut last_shading, mut last_mesh) = (None, None);
        // A key is one material.
        for (_, run) in objects.runs() {
            let material = &self.materials[self.objects[run[0] as usize].material];
            if last_shading.replace(material.shading) != Some(material.shading) {
                encoder.set_pipeline(self.pipeline(view, material.shading));
            }
            encoder.set_bind_group(1, Some(&material.group), &[]);
            for &index in run {
                let mesh_index = self.objects[index as usize].mesh;
                let mesh = &self.meshes[mesh_index];
                if last_mesh.replace(mesh_index) != Some(mesh_index) {
                    encoder.set_vertex_buffer(0, Some(mesh.vertices.slice(..)));
                    encoder.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint16);
                }
                encoder.draw_indexed(0..mesh.index_count, 0, index..index + 1);
            }
        }
        Ok(())
    }
}
