//! Plans of changing scenes.

use drawloom::scene::{Blend, Light, LightKind, Material, Scene};
use drawloom_testing::scenes::everything::{everything, without_shadow};
use libtest_mimic::Failed;

use super::cost::drawn;
use super::{BYTES_OF_A_MAP, GLASS_STATES, LIGHT_PIPELINES, OPAQUE_STATES, OPAQUE_STATES_IN_MAPS, deferred};
use crate::fixture::Fixture;

/// A change of the scene; the number of cached plans after it is first drawn, and the number of new pipelines then.
type Step = (&'static str, usize, usize, fn(&mut Scene) -> Result<(), Failed>);

const STEPS: &[Step] = &[
    // The plan of an empty scene always exists.
    ("everything", 2, EVERY_PIPELINE, |_| Ok(())),
    ("the last spot light with a shadow is removed", 3, 0, |scene| {
        scene.lights.retain(|light| light.kind() != LightKind::Spot || !light.casts_shadow());
        Ok(())
    }),
    ("it is added again", 3, 0, |scene| {
        scene.lights = everything().lights;
        Ok(())
    }),
    // Without shadows the shader of glass reads no maps.
    ("all shadows are disabled", 4, GLASS_STATES as usize, |scene| {
        scene.lights = everything().lights.into_iter().map(without_shadow).collect();
        Ok(())
    }),
    ("they are enabled again", 4, 0, |scene| {
        scene.lights = everything().lights;
        Ok(())
    }),
    ("most glass is removed", 4, 0, |scene| make_opaque(scene, 2)),
    ("the last glass is removed", 5, 0, |scene| make_opaque(scene, 3)),
    ("most lights are removed", 6, 0, |scene| {
        scene.lights.retain(|light| matches!(light, Light::Directional { casts_shadow: false, .. }));
        Ok(())
    }),
    // The rest requires no more than an empty scene.
    ("all lights are removed", 6, 0, |scene| {
        scene.lights.clear();
        Ok(())
    }),
    ("everything is added again", 6, 0, |scene| {
        scene.lights = everything().lights;
        make_opaque(scene, 0)
    }),
];

/// The pipelines for objects in maps, for opaque objects and for glass, for lights, and for tone mapping.
const EVERY_PIPELINE: usize = (OPAQUE_STATES_IN_MAPS + OPAQUE_STATES + GLASS_STATES + LIGHT_PIPELINES + 1) as usize;

/// Makes this many of the glass materials opaque.
fn make_opaque(scene: &mut Scene, count: usize) -> Result<(), Failed> {
    let handles = scene.assets().iter::<Material>().map(|(handle, _)| handle);
    let originals = everything();
    let originals = originals.assets().iter::<Material>().map(|(_, material)| material.clone());
    let glasses = handles.zip(originals).filter(|(_, material)| material.blend != Blend::None);
    for (index, (glass, material)) in glasses.collect::<Vec<_>>().into_iter().enumerate() {
        let blend = if index < count { Blend::None } else { material.blend };
        scene.replace(glass, Material { blend, ..material })?;
    }
    Ok(())
}

pub fn cached_plans() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
    let mut scene = everything();
    let mut pictures = Vec::new();
    let mut pipelines = 0;
    for (context, plans, new_pipelines, change) in STEPS {
        change(&mut scene)?;
        let picture = fixture.draw(&scene)?;
        if fixture.renderer.plan_count() != *plans {
            return Err(format!("{context}: {} plans should be {plans}", fixture.renderer.plan_count()).into());
        }
        let kept = fixture.renderer.backend().resources();
        pipelines += new_pipelines;
        if kept.pipelines != pipelines {
            return Err(format!("{context}: {} pipelines should be {pipelines}", kept.pipelines).into());
        }
        let (fresh, fresh_picture) = drawn(deferred(), &scene)?;
        if picture != fresh_picture {
            return Err(format!("{context}: a new renderer draws another picture").into());
        }
        // The backend keeps up to twice as many shadow maps as are drawn.
        let max_bytes = fresh.target_bytes + fresh.shadow_views * BYTES_OF_A_MAP;
        if kept.targets as i64 != fresh.targets
            || !(fresh.target_bytes..=max_bytes).contains(&(kept.target_bytes as i64))
        {
            return Err(format!("{context}: {kept:?}, where a new renderer has {fresh:?}").into());
        }
        pictures.push(picture);
    }
    let kept = |fixture: &Fixture| (fixture.renderer.plan_count(), fixture.renderer.backend().resources().pipelines);
    let before = kept(&fixture);
    for ((context, .., change), before) in STEPS.iter().zip(&pictures) {
        change(&mut scene)?;
        if fixture.draw(&scene)? != *before {
            return Err(format!("{context}: the second time, the picture differs").into());
        }
    }
    if kept(&fixture) == before { Ok(()) } else { Err(format!("{before:?} grows to {:?}", kept(&fixture)).into()) }
}
