//! What the render world says of its frames. If it is pipelined, it says so from a thread of its own.

use std::any::TypeId;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bevy_app::SubApp;
use bevy_core_pipeline::core_3d::Opaque3d;
use bevy_ecs::resource::Resource;
use bevy_ecs::schedule::IntoScheduleConfigs;
use bevy_ecs::system::Res;
use bevy_ecs::world::World;
use bevy_render::batching::gpu_preprocessing::SceneUnpackingBuffers;
use bevy_render::render_phase::{BinnedRenderPhase, ViewBinnedRenderPhases};
use bevy_render::render_resource::{CachedPipelineState, PipelineCache};
use bevy_render::view::RetainedViewEntity;
use bevy_render::{ExtractSchedule, Render, RenderSystems};

use crate::contender::Failure;

/// The longest time in which a frame is rendered.
const TIMEOUT: Duration = Duration::from_mins(10);

/// Counts frames, and on request what they draw.
#[derive(Clone, Default, Resource)]
pub struct Probe(Arc<Shared>);

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    rendered: Condvar,
}

struct State {
    /// The numbers of frames that were extracted, and that were submitted.
    extracted: usize,
    rendered: usize,
    /// When the first frame since [`Probe::start`] was submitted, and the last one.
    first: Option<Instant>,
    last: Option<Instant>,
    /// Whether the next frame is counted.
    counts: bool,
    drawn: Result<Vec<usize>, String>,
}

impl Default for State {
    fn default() -> Self {
        let drawn = Err("Bevy rendered no frame".to_owned());
        Self { extracted: 0, rendered: 0, first: None, last: None, counts: false, drawn }
    }
}

impl Probe {
    /// Adds the probe's systems to the render world.
    pub fn add_to(&self, render_app: &mut SubApp) {
        render_app
            .insert_resource(self.clone())
            .add_systems(ExtractSchedule, |probe: Res<Probe>| probe.state().extracted += 1)
            .add_systems(Render, frame_ends.after(RenderSystems::Render).before(RenderSystems::Cleanup));
    }

    /// Waits until all extracted frames are submitted.
    ///
    /// # Errors
    /// Returns an error if a frame takes too long.
    pub fn wait(&self) -> Result<(), Failure> {
        let is_rendering = |state: &mut State| state.rendered < state.extracted;
        let waited = self.0.rendered.wait_timeout_while(self.state(), TIMEOUT, is_rendering);
        match waited.unwrap_or_else(PoisonError::into_inner).1.timed_out() {
            true => Err("Bevy's render world does not finish its frame".into()),
            false => Ok(()),
        }
    }

    /// Forgets when earlier frames were submitted.
    pub fn start(&self) {
        let mut state = self.state();
        (state.first, state.last) = (None, None);
    }

    /// The time between the first and the last submit since [`Self::start`].
    pub fn elapsed(&self) -> Duration {
        let state = self.state();
        state.last.zip(state.first).map_or(Duration::ZERO, |(last, first)| last - first)
    }

    /// Requests [`Self::drawn`] of the next frame.
    pub fn count(&self) {
        self.state().counts = true;
    }

    /// How many objects the counted frame hands to the device, camera by camera.
    ///
    /// # Errors
    /// Returns an error if a pipeline is not ready, because what needs it is not drawn.
    pub fn drawn(&self) -> Result<Vec<usize>, Failure> {
        Ok(self.state().drawn.clone()?)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Notices that a frame is submitted.
fn frame_ends(world: &World) {
    let now = Instant::now();
    let probe = world.resource::<Probe>();
    let mut state = probe.state();
    state.rendered += 1;
    state.first.get_or_insert(now);
    state.last = Some(now);
    if std::mem::take(&mut state.counts) {
        state.drawn = drawn(world);
    }
    probe.0.rendered.notify_all();
}

fn drawn(world: &World) -> Result<Vec<usize>, String> {
    for pipeline in world.resource::<PipelineCache>().pipelines() {
        match &pipeline.state {
            CachedPipelineState::Ok(_) => {}
            CachedPipelineState::Err(error) => return Err(format!("a pipeline of Bevy is invalid: {error}")),
            CachedPipelineState::Queued | CachedPipelineState::Creating(_) => {
                return Err("a pipeline of Bevy is not ready".to_owned());
            }
        }
    }
    let unpacked = world.resource::<SceneUnpackingBuffers>();
    let phases = world.resource::<ViewBinnedRenderPhases<Opaque3d>>().iter();
    let count = |(view, phase): (&RetainedViewEntity, &BinnedRenderPhase<Opaque3d>)| {
        // Jobs that unpack the bins of multi-draws on the device, and other bins.
        let of_view = unpacked.view_phase_buffers.iter();
        let of_view = of_view.filter(|(key, _)| key.phase == TypeId::of::<Opaque3d>() && key.view == *view);
        let jobs = of_view.flat_map(|(_, buffers)| &buffers.indexed_unpacking_jobs);
        let batches = phase.batchable_meshes.values().map(|bin| bin.entities().len());
        let single = phase.unbatchable_meshes.values().map(|bin| bin.entities.len());
        jobs.map(|job| job.mesh_instance_count as usize).chain(batches).chain(single).sum()
    };
    Ok(phases.map(count).collect())
}
