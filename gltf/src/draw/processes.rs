//! The processes of a world, and its shadow maps.

use std::sync::Arc;

use drawloom::RendererBuilder;
use drawloom::backend::Backend;
use drawloom::process::{Deferred, RenderProcess};
use drawloom::view::ShadowMaps;

use super::deformation::SkinsAndMorphs;
use super::surfaces::Surfaces;
use crate::surface_kind::SurfaceKind;
use crate::world::World;

/// Adds to a renderer what draws a world: `deferred` as its pipeline, with the world's deformation, and a process for
/// each kind of surface.
///
/// The renderer draws this world only: another one needs another renderer.
pub fn add_world<B: Backend>(builder: RendererBuilder<B>, mut deferred: Deferred, world: &World) -> RendererBuilder<B> {
    let deformation = || SkinsAndMorphs::new(Arc::clone(&world.palette), Arc::clone(&world.morphs));
    let has_deformed = world.surfaces.iter().any(|&(_, is_deformed)| is_deformed);
    if has_deformed {
        deferred = deferred.deformation(deformation());
    }
    // Without a light that casts shadows, nothing else would clear the maps into which masked surfaces are drawn.
    if world.surfaces.iter().any(|&(kind, _)| kind == SurfaceKind::Masked) {
        deferred = deferred.keep("shadow casters");
    }
    // The last shipped process that draws shadow maps.
    let last = deferred.names().into_iter().rfind(|name| name.ends_with("shadow casters"));
    let mut builder = builder.pipeline(deferred);
    let (mut previous, mut previous_casters) = (None, last);
    for &(kind, is_deformed) in &world.surfaces {
        let draw = |kind, after| Surfaces::new(kind, is_deformed.then(deformation), after);
        if kind == SurfaceKind::Masked {
            let casters = draw(SurfaceKind::MaskedCasters, previous_casters);
            previous_casters = Some(casters.name().to_owned());
            builder = builder.process(casters);
        }
        let surfaces = draw(kind, previous);
        previous = Some(surfaces.name().to_owned());
        builder = builder.process(surfaces);
    }
    builder
}

/// Shadow maps that cover a world as its camera sees it, for [`Deferred::shadow_maps`].
pub fn shadow_maps(world: &World) -> ShadowMaps {
    let columns = world.columns();
    let scene = world.as_scene_ref(&columns);
    let (center, radius) = scene.bounding_sphere();
    let distance = scene.cameras.iter().map(|camera| camera.position.distance(center)).fold(0.0, f64::max);
    let max_distance = (distance + radius).clamp(1e-3, 1e6) as f32;
    ShadowMaps { side: 2048, max_distance, ..ShadowMaps::default() }
}
