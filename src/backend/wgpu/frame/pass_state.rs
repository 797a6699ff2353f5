//! The state of one pass in a frame's buffers.

use std::fmt::Write;
use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::RwLock;

use super::bundle_cache::BundleCache;
use super::indirect_arguments::IndirectArguments;
use super::pass_statistics::WgpuPassStatistics;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::{CachedBindGroup, GrowingBuffer, UploadQueue};
use crate::backend::wgpu::strategy::{EncodingStrategy, PassStrategy, RecordingStrategy};
use crate::backend::wgpu::timing::PassTiming;
use crate::command::Version;
use crate::process::{Draws, Pass};
use crate::tuning::CostSample;

/// One pass of a frame, and what it caches for the next frame that uses the same buffers.
pub(crate) struct WgpuPassState {
    pub(crate) pass: Pass,
    /// Process and view, for error messages.
    pub(crate) label: String,
    /// Its index among the passes of commands; `None` for other passes.
    pub(crate) command_pass_index: Option<usize>,
    /// Its index among the timed passes; `None` for a pass that is not timed.
    pub(crate) timed_pass_index: Option<usize>,
    /// Offset and size of its parameters; `None` for a pass without.
    pub(crate) parameters: Option<(usize, usize)>,
    /// `@group(0)`.
    pub(crate) frame_bind_group: Option<wgpu::BindGroup>,
    /// `@group(2)`: the parameters, and the targets that the process samples.
    pub(crate) process_bind_group: Option<CachedBindGroup>,
    /// `@group(3)`: the columns and the engine's own resources that the process reads.
    pub(crate) engine_bind_group: Option<CachedBindGroup>,
    /// The version of the draw list whose objects the buffers hold.
    pub(crate) uploaded_list: RwLock<Version>,
    pub(crate) strategy: PassStrategy,
    /// The strategy's index in the backend's set, and whether the frame only tries it.
    pub(crate) strategy_index: usize,
    pub(crate) is_trial: bool,
    /// Whether the strategy's cache was there when the frame began.
    is_warm: bool,
    /// The number of batches that it drew when a frame last recorded it; `None` for another pass than in that frame.
    latest_batches: Option<usize>,
    /// Whether it may be encoded together with its neighbours.
    pub(crate) can_share_encoder: bool,
    /// Whether it is finished together with the pass before it.
    pub(crate) continues_previous: bool,
    /// Whether it is in the encoder of the pass before it.
    pub(crate) is_in_previous_encoder: AtomicBool,
    pub(crate) bundle_cache: BundleCache,
    pub(crate) indirect_arguments: IndirectArguments,
    /// The indices of partial batches' remaining triangles.
    pub(crate) partial_indices: RwLock<GrowingBuffer>,
    pub(crate) timing: PassTiming,
}

impl Default for WgpuPassState {
    fn default() -> Self {
        Self {
            pass: Pass { process_index: 0, view_index: 0 },
            label: String::new(),
            command_pass_index: None,
            timed_pass_index: None,
            parameters: None,
            frame_bind_group: None,
            process_bind_group: None,
            engine_bind_group: None,
            uploaded_list: RwLock::default(),
            strategy: PassStrategy { recording: RecordingStrategy::Direct, encoding: EncodingStrategy::PerPass },
            strategy_index: 0,
            is_trial: false,
            is_warm: false,
            latest_batches: None,
            can_share_encoder: false,
            continues_previous: false,
            is_in_previous_encoder: AtomicBool::new(false),
            bundle_cache: BundleCache::default(),
            indirect_arguments: IndirectArguments::default(),
            partial_indices: RwLock::new(new_index_buffer()),
            timing: PassTiming::default(),
        }
    }
}

impl WgpuPassState {
    /// A batch takes some 0.1 µs to record, and an encoder 4 to 5 µs to make, finish and submit.
    const MAX_BATCHES_OF_SMALL_PASS: usize = 64;

    pub(crate) fn set_label(&mut self, process: &str, view: &str) {
        self.label.clear();
        // Writing into a string cannot fail.
        let _ = write!(self.label, "{process:?} in view {view:?}");
    }

    /// Sets the frame's strategy. Unless it is a trial, drops the caches of other strategies.
    pub(crate) fn set_strategy(&mut self, strategy: PassStrategy, strategy_index: usize, is_trial: bool) {
        (self.strategy, self.strategy_index, self.is_trial) = (strategy, strategy_index, is_trial);
        self.is_warm = match strategy.recording {
            RecordingStrategy::CachedBundles => self.bundle_cache.is_warm(),
            RecordingStrategy::Indirect => self.indirect_arguments.is_warm(),
            RecordingStrategy::Direct | RecordingStrategy::Bundles => true,
        };
        if !is_trial && strategy.recording != RecordingStrategy::CachedBundles {
            self.bundle_cache.clear();
        }
        if !is_trial && strategy.recording != RecordingStrategy::Indirect {
            self.indirect_arguments.clear();
        }
        self.timing = PassTiming::default();
        self.is_in_previous_encoder = AtomicBool::new(false);
    }

    /// Makes this the state of a pass in the frame that begins.
    pub(crate) fn set_pass(&mut self, pass: Pass) {
        let is_same = mem::replace(&mut self.pass, pass) == pass;
        self.latest_batches = is_same.then(|| self.timing.batches());
    }

    /// Whether the pass probably takes less to encode than an encoder does.
    pub(crate) fn is_small(&self, draws: &Draws<'_>) -> bool {
        match draws {
            // The engine's own code, which may do anything.
            Draws::Raw(_) => false,
            Draws::Commands(_) => self.latest_batches.is_some_and(|batches| batches <= Self::MAX_BATCHES_OF_SMALL_PASS),
            _ => true,
        }
    }

    /// Drops the caches that keep other resources alive.
    pub(crate) fn clear_caches(&mut self) {
        (self.process_bind_group, self.engine_bind_group) = (None, None);
        self.bundle_cache.clear();
    }

    /// Uploads the remaining triangles of partial batches; drops the buffer if there are none.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn upload_partial_indices(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        indices: &[u32],
    ) -> Result<(), BackendError> {
        let mut buffer = self.partial_indices.write();
        if indices.is_empty() {
            *buffer = new_index_buffer();
        } else {
            buffer.reserve(device, size_of_val(indices))?;
            buffer.write(uploads, 0, bytemuck::cast_slice(indices));
        }
        Ok(())
    }

    /// Drops the index buffer that an earlier frame's pass at this index has left.
    pub(crate) fn clear_partial_indices(&mut self) {
        *self.partial_indices.get_mut() = new_index_buffer();
    }

    /// How the pass was recorded.
    pub(crate) fn statistics(&self, process: String) -> WgpuPassStatistics {
        WgpuPassStatistics {
            process,
            view: self.pass.view_index,
            recording: self.strategy.recording,
            encoding: self.strategy.encoding,
            encoders: if self.is_in_previous_encoder.load(Ordering::Relaxed) {
                0
            } else {
                self.strategy.encoder_count(self.timing.bundles())
            },
            batches: self.timing.batches(),
            recorded_bundles: self.timing.recorded_bundles(),
            replayed_bundles: self.timing.replayed_bundles(),
        }
    }

    /// The pass's cost in a frame whose passes cost `all` nanoseconds in total, on `workers` workers. If the other
    /// passes cannot keep the workers busy for as long as the pass's critical path, the idle time counts as its cost.
    pub(crate) fn cost_sample(&self, all: f64, workers: usize) -> CostSample {
        let own = self.timing.total();
        let cost = own.max(self.timing.critical_path(workers) * workers as f64 - (all - own));
        CostSample { nanoseconds: cost, units: self.timing.batches(), is_warm: self.is_warm }
    }
}

fn new_index_buffer() -> GrowingBuffer {
    GrowingBuffer::new("remaining triangles", wgpu::BufferUsages::INDEX)
}
