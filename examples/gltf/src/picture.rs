//! The engine: its device, and a renderer for a world.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::process::{Deferred, Fxaa, RenderProcess, ToneMapping};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, wgpu};

use crate::deformation::SkinsAndMorphs;
use crate::device_textures::upload;
use crate::surface_kind::SurfaceKind;
use crate::surfaces::Surfaces;
use crate::world::World;

/// Opens a device on the best adapter, with all its limits: poses and morph targets take storage buffers beyond those
/// that Drawloom requires.
///
/// # Errors
/// If there is no adapter, or it has not what Drawloom requires.
pub fn open_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).map_err(
        |_| "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software",
    )?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}

/// Draws a world. `exposure` multiplies its radiance.
///
/// # Errors
/// If the device cannot draw it.
pub fn draw(
    (device, queue): (wgpu::Device, wgpu::Queue),
    scheduler: Arc<Scheduler>,
    world: &World,
    exposure: f32,
) -> Result<Picture, Box<dyn Error>> {
    let textures = upload(&device, &queue, &world.textures)?;
    let deformation = |material_bindings| {
        SkinsAndMorphs::new(Arc::clone(&world.palette), Arc::clone(&world.morphs), material_bindings)
    };
    let has_deformed = world.surfaces.iter().any(|&(_, is_deformed)| is_deformed);
    let mut deferred = Deferred::new().shadow_maps(Some(shadow_maps(world)));
    deferred = deferred.post(ToneMapping::new(exposure)).post(Fxaa::default());
    if has_deformed {
        deferred = deferred.deformation(deformation(0));
    }
    // Without a light that casts shadows, nothing else would clear the maps into which masked surfaces are drawn.
    if world.surfaces.iter().any(|&(kind, _)| kind == SurfaceKind::Masked) {
        deferred = deferred.keep("shadow casters");
    }
    // The last shipped process that draws shadow maps.
    let last = deferred.names().into_iter().rfind(|name| name.ends_with("shadow casters"));
    let mut builder = Renderer::builder(WgpuBackend::new(device, queue)?).deferred(deferred);
    let (mut previous, mut previous_casters) = (None, last);
    for &(kind, is_deformed) in &world.surfaces {
        let draw = |kind, after| Surfaces::new(kind, is_deformed.then(|| deformation(1)), &textures, after);
        if kind == SurfaceKind::Masked {
            let casters = draw(SurfaceKind::MaskedCasters, previous_casters);
            previous_casters = Some(casters.name().to_owned());
            builder = builder.process(casters);
        }
        let surfaces = draw(kind, previous);
        previous = Some(surfaces.name().to_owned());
        builder = builder.process(surfaces);
    }
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
    Ok(submitter.submit(recorded)?.submission.read(0, "picture")?)
}

/// Shadow maps that cover the scene as its camera sees it.
fn shadow_maps(world: &World) -> ShadowMaps {
    let columns = world.columns();
    let scene = world.as_scene_ref(&columns);
    let (center, radius) = scene.bounding_sphere();
    let distance = scene.cameras.iter().map(|camera| camera.position.distance(center)).fold(0.0, f64::max);
    let max_distance = (distance + radius).clamp(1e-3, 1e6) as f32;
    ShadowMaps { side: 2048, max_distance, ..ShadowMaps::default() }
}
