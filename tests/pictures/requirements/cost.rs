//! What a frame costs, with its picture.

use drawloom::backend::{Picture, WgpuResources};
use drawloom::process::Deferred;
use drawloom::scene::{Scene, ViewKind};
use libtest_mimic::Failed;

use super::deferred;
use crate::fixture::Fixture;

/// The processes of one frame of a new renderer, and their costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    pub passes: i64,
    pub pipelines: i64,
    pub targets: i64,
    pub target_bytes: i64,
    pub shadow_views: i64,
    pub lights: i64,
    /// Of the device, beside those of meshes and materials.
    pub buffers: i64,
    pub buffer_bytes: i64,
    pub draws: i64,
    pub commands: i64,
}

impl Cost {
    pub fn minus(self, other: Self) -> Self {
        Self {
            passes: self.passes - other.passes,
            pipelines: self.pipelines - other.pipelines,
            targets: self.targets - other.targets,
            target_bytes: self.target_bytes - other.target_bytes,
            shadow_views: self.shadow_views - other.shadow_views,
            lights: self.lights - other.lights,
            buffers: self.buffers - other.buffers,
            buffer_bytes: self.buffer_bytes - other.buffer_bytes,
            draws: self.draws - other.draws,
            commands: self.commands - other.commands,
        }
    }
}

/// A new renderer's picture of a scene, and its costs.
pub fn drawn(deferred: Deferred, scene: &Scene) -> Result<(Cost, Picture), Failed> {
    let output = deferred.output();
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    let recorded = fixture.record(scene)?;
    let views = &recorded.statistics().views;
    let mut cost = Cost {
        passes: recorded.queues().iter().map(|queue| queue.passes.len() as i64).sum(),
        shadow_views: views.iter().filter(|view| view.kind == ViewKind::Shadow).count() as i64,
        lights: views.iter().map(|view| view.lights as i64).sum(),
        draws: views.iter().map(|view| view.batches as i64).sum(),
        commands: views.iter().map(|view| view.commands as i64).sum(),
        ..Cost::default()
    };
    let picture = fixture.submit(recorded)?.read(0, output)?;
    let WgpuResources { pipelines, targets, target_bytes, buffers, buffer_bytes, .. } =
        fixture.renderer.backend().resources();
    (cost.pipelines, cost.targets, cost.target_bytes) = (pipelines as i64, targets as i64, target_bytes as i64);
    (cost.buffers, cost.buffer_bytes) = (buffers as i64, buffer_bytes as i64);
    Ok((cost, picture))
}

/// Checks a scene without a feature. Its cost and its picture must equal those of a bare pipeline without a process for
/// the feature, and its cost must be lower than that of the scene with everything, by `saved`.
pub fn expect_saved(
    full: &(Cost, Picture),
    context: &str,
    scene: &Scene,
    bare: Deferred,
    saved: Cost,
) -> Result<(), Failed> {
    let (cost, picture) = drawn(deferred(), scene)?;
    let (bare_cost, bare_picture) = drawn(bare, scene)?;
    if cost != bare_cost {
        return Err(format!("{context}: {cost:?}, where a pipeline without it has {bare_cost:?}").into());
    }
    if picture != bare_picture {
        return Err(format!("{context}: a pipeline without it draws another picture").into());
    }
    expect_difference(context, full.0.minus(cost), saved)?;
    expect_changed(context, &full.1, &picture)
}

/// Compares what is saved with what should be. How many bytes, draws and commands that is depends on the objects, so of
/// these none may be added, and shadow maps save some.
pub fn expect_difference(context: &str, saved: Cost, expected: Cost) -> Result<(), Failed> {
    let Cost { buffers, buffer_bytes, draws, commands, .. } = saved;
    let counted = Cost { buffers, buffer_bytes, draws, commands, ..expected };
    let least = i64::from(expected.shadow_views > 0);
    if saved != counted || buffers < 0 || buffer_bytes < least || draws < least || commands < least {
        return Err(format!("{context}: {saved:?} is saved, and should be {expected:?}").into());
    }
    Ok(())
}

/// Fails if two pictures differ by no more than rounding.
pub fn expect_changed(context: &str, one: &Picture, other: &Picture) -> Result<(), Failed> {
    let changed = different_pixels(one, other).filter(|is_different| *is_different).count();
    if changed >= 20 { Ok(()) } else { Err(format!("{context}: only {changed} pixels change").into()) }
}

/// For each pixel, whether two pictures differ by more than rounding.
pub fn different_pixels<'a>(one: &'a Picture, other: &'a Picture) -> impl Iterator<Item = bool> + 'a {
    let pixels = one.bytes.chunks_exact(4).zip(other.bytes.chunks_exact(4));
    pixels.map(|(one, other)| one.iter().zip(other).any(|(one, other)| one.abs_diff(*other) > 8))
}

pub fn expect_same(context: &str, one: &(Cost, Picture), other: &(Cost, Picture)) -> Result<(), Failed> {
    if one.0 != other.0 {
        return Err(format!("{context}: {:?} should be {:?}", one.0, other.0).into());
    }
    if one.1 == other.1 { Ok(()) } else { Err(format!("{context}: the picture differs").into()) }
}
