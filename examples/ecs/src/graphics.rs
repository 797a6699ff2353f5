//! The device, the renderer on it, and what does not change in the scene.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{Deferred, targets};
use drawloom::scene::{Assets, Camera, Changes, Light, Material, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, wgpu};
use drawloom_testing::scenes::cube;

use crate::population::{Looks, Population};
use crate::scene_columns::LentScene;

/// The device, the renderer on it, and what does not change in the scene.
pub struct Graphics {
    device_name: String,
    pub scheduler: Arc<Scheduler>,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    assets: Assets,
    pub looks: Looks,
    lights: [Light; 1],
    cameras: [Camera; 1],
    picture: Option<Picture>,
}

impl Graphics {
    const SIZE: [u32; 2] = [960, 540];

    /// On a device.
    ///
    /// # Errors
    /// If Drawloom cannot draw on it.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Result<Self, Box<dyn Error>> {
        let device_name = device.adapter_info().name;
        let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
        let (renderer, submitter) = Renderer::builder(WgpuBackend::new(device, queue)?)
            .pipeline(Deferred::to_picture())
            .build(Arc::clone(&scheduler))?;
        let mut assets = Assets::default();
        let mesh = cube();
        let bounds = mesh.bounds();
        let mesh = assets.add(mesh)?;
        let mut material =
            |name: &str, diffuse| assets.add(Material { name: name.into(), diffuse, ..Material::default() });
        let materials = [
            material("rust", Vec3::new(0.7, 0.25, 0.15))?,
            material("sand", Vec3::new(0.75, 0.6, 0.35))?,
            material("sea", Vec3::new(0.2, 0.45, 0.55))?,
        ];
        let direction = Vec3::new(-0.5, -0.8, -0.4).normalize();
        Ok(Self {
            device_name,
            scheduler,
            renderer,
            submitter,
            assets,
            looks: Looks { mesh, bounds, materials },
            lights: [Light::Directional { direction, illuminance: Vec3::splat(2.5), casts_shadow: false }],
            cameras: [Camera { size: Self::SIZE, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) }],
            picture: None,
        })
    }

    pub fn device_name(&self) -> &str {
        &self.device_name
    }

    /// Looks at a whole population.
    pub fn look_at(&mut self, population: Population) {
        let radius = f64::from(population.entities).sqrt() * 0.4 + 2.0;
        let position = DVec3::new(0.6, 0.6, 1.4) * radius;
        self.cameras = [Camera { size: Self::SIZE, ..Camera::looking_at("main", position, DVec3::ZERO) }];
    }

    /// Records and submits a frame. Returns how long each took.
    ///
    /// # Errors
    /// If the frame is impossible.
    pub fn draw(&mut self, lent: LentScene<'_>, keeps_picture: bool) -> Result<[Duration; 2], Box<dyn Error>> {
        let scene = SceneRef {
            positions: lent.positions,
            orientations: lent.orientations,
            scales: lent.scales,
            bounds: lent.bounds,
            meshes: lent.meshes,
            materials: lent.materials,
            changes: Changes::Ranges(lent.changed),
            lights: &self.lights,
            cameras: &self.cameras,
            ambient: Vec3::splat(0.1),
            background: Vec3::new(0.02, 0.03, 0.05),
            ..SceneRef::new(&self.assets)
        };
        let began = Instant::now();
        let mut recorded = self.renderer.record(scene)?;
        let record = began.elapsed();
        let read_back =
            if keeps_picture { Some(recorded.read_back(0, targets::PICTURE, [0, 0], Self::SIZE)?) } else { None };
        let began = Instant::now();
        self.submitter.submit(recorded)?;
        let submit = began.elapsed();
        if let Some(read_back) = read_back {
            self.picture = Some(read_back.read()?);
        }
        Ok([record, submit])
    }

    /// The last picture of the population that was drawn last.
    ///
    /// # Errors
    /// If nothing was drawn.
    pub fn picture(&self) -> Result<&Picture, Box<dyn Error>> {
        self.picture.as_ref().ok_or_else(|| "nothing was drawn".into())
    }
}
