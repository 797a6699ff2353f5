//! The wgpu backend.
//!
//! What it rests on was measured: vertices and indices lie in arenas, what an object is comes from one storage buffer, and
//! state is set per batch only, because that is the form of recording that is cheap and that scales with threads.
//!
//! There are several ways to make commands of a pass's batches ([`Record`]) and to encode them ([`Encode`]). A bundle is not
//! a thing of the device: it is replayed, and encoded, inside `CommandEncoder::finish`. So it costs more than recording
//! straight into the pass if it is replayed once, and a tenth of it if it is kept; but whole frames can be recorded by
//! several workers only in bundles or in several encoders. Which way is the cheapest depends on the adapter and the scene, so
//! every pass finds out for itself (`chooser`), unless an engine says. None of them changes the picture.
//!
//! Each frame has buffers of its own, and with them is kept from frame to frame what they are bound in: bind groups,
//! bundles, arguments of indirect draws. Nothing of it is used again unless all that it was made of is compared and is the
//! same; after an error nothing is.

mod arena;
mod arguments;
mod assets;
mod begin;
mod chooser;
mod device_clock;
mod encode;
mod error_scope;
mod frame;
mod frame_buffers;
mod frame_pass;
mod growing_buffer;
mod kept;
mod layouts;
mod light_meshes;
mod pass_times;
mod picture;
mod pipelines;
mod record;
mod subdivided_mesh;
mod targets;
mod textures;
mod timestamps;
mod uploads;
mod vertices;
mod ways;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Weak};

use parking_lot::Mutex;

use self::arena::new_buffer;
use self::assets::AssetCache;
use self::error_scope::{caught, checked};
use self::frame::{Commands, Part};
use self::frame_buffers::BufferPool;
use self::layouts::Layouts;
use self::light_meshes::LightMeshes;
use self::pipelines::ProcessPipelines;
use self::subdivided_mesh::SubdividedMesh;
use self::targets::TargetCache;
use self::timestamps::Timing;
use self::uploads::Uploads;
use self::ways::Ways;
use super::subdivisions::Subdivisions;
use super::{Backend, BackendError, FrameRequest, PassRequest};
use crate::process::{Draws, Pass};
use crate::task::Worker;
use crate::view::ObjectTable;

pub use device_clock::DeviceClock;
pub use frame::{WgpuCommands, WgpuFrame, WgpuPart};
pub use pass_times::{PassTime, PassTimes};
pub use picture::WgpuSubmission;
pub use ways::{Encode, Record, WgpuPass};

/// Draws with wgpu, on a device that the engine made.
///
/// Drawloom builds wgpu with Vulkan, Metal, DX12 and `noop`, and WGSL. An engine that depends on wgpu 30 itself can switch
/// on more of it.
///
/// Errors of what Drawloom records come back as `Result`. What the device does on its own accord does not: an engine sets
/// its own `Device::set_device_lost_callback` and `Device::on_uncaptured_error`. A lost device takes what is submitted
/// without a word; the next [`WgpuSubmission::wait`] or [`WgpuSubmission::read`] tells, and so does the next frame.
pub struct WgpuBackend {
    device: wgpu::Device,
    uploads: Uploads,
    layouts: Layouts,
    /// For each plan by its identity.
    pipelines: Mutex<HashMap<u64, PlanPipelines>>,
    /// Made when a plan draws lights for the first time.
    light_meshes: Mutex<Option<Arc<LightMeshes>>>,
    assets: Mutex<AssetCache>,
    subdivisions: Subdivisions<SubdividedMesh>,
    targets: Mutex<TargetCache>,
    buffers: Arc<BufferPool>,
    ways: Ways,
    /// How many frames were begun.
    frames: AtomicU64,
    /// How many workers have taken part so far.
    workers: AtomicUsize,
    /// The passes of commands of the frame that was submitted last.
    latest: Mutex<Vec<WgpuPass>>,
    /// `None` where passes are not timed.
    timing: Option<Timing>,
}

impl WgpuBackend {
    /// The features a device must have: none beyond WebGPU's own.
    pub const REQUIRED_FEATURES: wgpu::Features = wgpu::Features::empty();

    /// Features that are used where a device has them: for [`Record::Indirect`].
    pub const OPTIONAL_FEATURES: wgpu::Features = wgpu::Features::INDIRECT_FIRST_INSTANCE;

    /// Features that [`WgpuBackend::time_passes`] has a use for. It needs `TIMESTAMP_QUERY`; with the other one it times passes
    /// that encode themselves as well.
    pub const TIMING_FEATURES: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// The limits a device must have. Higher ones are used where it has them: for larger pictures, and for more objects.
    pub const REQUIRED_LIMITS: wgpu::Limits = wgpu::Limits::downlevel_defaults();

    /// A backend on the engine's device. How passes are recorded and encoded is measured, and chosen for each of them.
    ///
    /// # Errors
    /// If the device lacks a feature or a limit, naming it.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Result<Self, BackendError> {
        let missing = Self::REQUIRED_FEATURES - device.features();
        if !missing.is_empty() {
            return Err(BackendError::MissingFeature { missing: missing.to_string() });
        }
        let mut short = None;
        let limits = device.limits();
        Self::REQUIRED_LIMITS.check_limits_with_fail_fn(&limits, true, |limit, needed, allowed| {
            short.get_or_insert(BackendError::Limit { limit, allowed, needed });
        });
        if let Some(error) = short {
            return Err(error);
        }
        let layouts = checked(&device, "Drawloom's bind group layouts", || Layouts::new(&device))?;
        let has_indirect = device.features().contains(Self::OPTIONAL_FEATURES) && takes_indirect(&device);
        // There wgpu panics over the arguments' alignment, unless its check of indirect calls is switched off.
        let tries_indirect = has_indirect && device.adapter_info().backend != wgpu::Backend::Noop;
        Ok(Self {
            device,
            uploads: Uploads::new(queue),
            layouts,
            pipelines: Mutex::default(),
            light_meshes: Mutex::default(),
            assets: Mutex::default(),
            subdivisions: Subdivisions::default(),
            targets: Mutex::default(),
            buffers: Arc::default(),
            ways: Ways::new(has_indirect, tries_indirect),
            frames: AtomicU64::new(0),
            workers: AtomicUsize::new(1),
            latest: Mutex::default(),
            timing: None,
        })
    }

    /// Records every pass this way, instead of the one that was measured to be the cheapest.
    ///
    /// # Errors
    /// If the device lacks a feature for it, naming it.
    pub fn record(self, record: Record) -> Result<Self, BackendError> {
        if record == Record::Indirect && !self.ways.has_indirect() {
            let missing = (Self::OPTIONAL_FEATURES - self.device.features()).to_string();
            // WebGPU promises it; some devices behind OpenGL have it not, and then it is no feature that could be asked for.
            let missing = if missing.is_empty() { "INDIRECT_EXECUTION".to_owned() } else { missing };
            return Err(BackendError::MissingFeature { missing });
        }
        Ok(Self { ways: self.ways.only_record(record), ..self })
    }

    /// Encodes every pass this way, instead of the one that was measured to be the cheapest.
    pub fn encode(self, encode: Encode) -> Self {
        Self { ways: self.ways.only_encode(encode), ..self }
    }

    /// Has the device write down when it begins and ends each pass: see [`WgpuSubmission::pass_times`], and [`DeviceClock`] for
    /// how they get into a log. Of [raw passes](crate::process::RawPass) it does so only where it has
    /// `TIMESTAMP_QUERY_INSIDE_ENCODERS`.
    ///
    /// # Errors
    /// If the device lacks `TIMESTAMP_QUERY`, or is wgpu's `noop` backend, which has it and writes nothing.
    pub fn time_passes(self) -> Result<Self, BackendError> {
        let timing = Some(Timing::new(&self.device, self.queue())?);
        Ok(Self { timing, ..self })
    }

    /// How the passes of commands of the frame that was submitted last were recorded, in the order of submission.
    pub fn passes(&self) -> Vec<WgpuPass> {
        self.latest.lock().clone()
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        self.uploads.queue()
    }

    /// What is kept on the device from frame to frame, beside the scene's own meshes and textures.
    pub fn resources(&self) -> WgpuResources {
        let kept = self.pipelines.lock();
        let mut distinct: Vec<_> = kept.values().flat_map(|kept| kept.of_processes.iter()).collect();
        distinct.sort_by_key(|pipelines| Arc::as_ptr(pipelines));
        distinct.dedup_by_key(|pipelines| Arc::as_ptr(pipelines));
        let pipelines = distinct.into_iter().map(|pipelines| pipelines.prepared().len()).sum();
        let (targets, target_bytes) = self.targets.lock().current().sizes();
        WgpuResources { pipelines, targets, target_bytes, buffer_bytes: self.buffers.bytes() }
    }

    /// The pipelines of every process of a plan: those there are, also from other plans, or new ones where a process draws in
    /// another way than it did, or the quality is another.
    fn pipelines(
        &self,
        &FrameRequest { plan, draws, quality, .. }: &FrameRequest<'_>,
    ) -> Result<Arc<[Arc<ProcessPipelines>]>, BackendError> {
        let mut kept = self.pipelines.lock();
        let there = kept.get(&plan.identity()).map(|kept| &kept.of_processes);
        if let Some(of_plan) =
            there.filter(|of_plan| of_plan.iter().zip(draws).all(|(one, draws)| one.still_fit(draws, quality)))
        {
            return Ok(Arc::clone(of_plan));
        }
        let mut of_plan = there.map_or_else(Vec::new, |of_plan| of_plan.to_vec());
        for (index, (planned, draws)) in plan.processes().iter().zip(draws).enumerate() {
            if of_plan.get(index).is_some_and(|pipelines| pipelines.still_fit(draws, quality)) {
                continue;
            }
            let mut all = kept.values().flat_map(|kept| kept.of_processes.iter());
            let fitting = all.find(|pipelines| pipelines.fit(plan, planned, draws, quality)).cloned();
            let made = match fitting {
                Some(fitting) => fitting,
                None => {
                    let label = format!("the shader of {:?}", planned.process.name());
                    let make = || ProcessPipelines::new(&self.device, &self.layouts, plan, planned, draws, quality);
                    Arc::new(checked(&self.device, &label, make)?)
                }
            };
            // Processes are gone through in order, so the new one replaces another or comes at the end.
            match of_plan.get_mut(index) {
                Some(old) => *old = made,
                None => of_plan.push(made),
            }
        }
        // What only plans that are gone had in common with this one was found above.
        kept.retain(|_, kept| kept.plan.strong_count() > 0);
        let of_plan: Arc<[_]> = of_plan.into();
        kept.insert(plan.identity(), PlanPipelines { plan: plan.alive(), of_processes: Arc::clone(&of_plan) });
        Ok(of_plan)
    }

    /// The geometry of lights, where something draws it.
    fn light_meshes(&self, draws: &[Draws<'_>]) -> Result<Option<Arc<LightMeshes>>, BackendError> {
        if !draws.iter().any(|draws| matches!(draws, Draws::Lights(_))) {
            return Ok(None);
        }
        let mut kept = self.light_meshes.lock();
        if kept.is_none() {
            let make = || LightMeshes::new(&self.device, &self.uploads);
            *kept = Some(Arc::new(checked(&self.device, "the geometry of lights", make)??));
        }
        Ok(kept.clone())
    }

    /// Drops everything that is kept from frame to frame. After a device error some of it may be unusable, and the next
    /// frame is to find out for itself.
    fn forget(&self) {
        *self.assets.lock() = AssetCache::default();
        *self.light_meshes.lock() = None;
        self.subdivisions.forget();
        *self.targets.lock() = TargetCache::default();
        self.buffers.forget();
    }
}

/// Whether the device can draw indirectly at all.
fn takes_indirect(device: &wgpu::Device) -> bool {
    let make = || new_buffer(device, "indirect draws", 256, wgpu::BufferUsages::INDIRECT);
    matches!(checked(device, "indirect draws", make), Ok(Ok(_)))
}

/// The pipelines of a plan.
struct PlanPipelines {
    /// Whether the plan still is.
    plan: Weak<()>,
    /// One for each process.
    of_processes: Arc<[Arc<ProcessPipelines>]>,
}

/// What a [`WgpuBackend`] keeps on the device from frame to frame, beside the scene's own meshes and textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WgpuResources {
    /// Of all processes that were drawn so far.
    pub pipelines: usize,
    /// Textures that the last frame's views draw into; one that several views share counts once.
    pub targets: usize,
    /// Their pixels.
    pub target_bytes: u64,
    /// Of the buffers for objects, views, lights, parameters and triangles that no frame on its way is using.
    pub buffer_bytes: u64,
}

impl Backend for WgpuBackend {
    type Frame = WgpuFrame;
    type Part = WgpuPart;
    type Commands = WgpuCommands;
    type Submission = WgpuSubmission;

    fn adapter(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({})", info.name, info.backend)
    }

    fn uploaded(&self) -> u64 {
        self.uploads.bytes()
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<WgpuFrame, BackendError> {
        self.start(request).inspect_err(|_| self.forget())
    }

    fn upload_objects(
        &self,
        _worker: &Worker,
        frame: &WgpuFrame,
        objects: &ObjectTable,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        checked(&self.device, "objects", || frame.buffers.write_objects(&self.uploads, objects, blocks))
            .inspect_err(|_| self.buffers.forget())
    }

    fn prepare(
        &self,
        _worker: &Worker,
        frame: &WgpuFrame,
        &PassRequest { frame: request, pass, list }: &PassRequest<'_>,
    ) -> Result<(), BackendError> {
        let index = frame.index(pass);
        let (pipelines, pass) = (frame.pipelines(pass), frame.pass(index));
        pass.spent.set_size(list.batches.len(), list.bundle_count(), pass.way.parts(list));
        let made = checked(&self.device, &pass.label, || {
            frame.buffers.write_drawn(&self.uploads, index, &list.objects);
            pass.upload_indices(&self.device, &self.uploads, list.remaining_indices())?;
            self.subdivide(frame, request, list)?;
            match pass.way.record {
                Record::Kept => pass.kept.set_count(list.bundle_count()),
                Record::Indirect => {
                    let upload = || pass.arguments.upload(&self.device, &self.uploads, &frame.assets, list);
                    pass.spent.alone(upload)?;
                }
                Record::Direct | Record::Bundles => {}
            }
            Ok::<_, BackendError>(pipelines.make_missing(&self.device, &list.batches))
        })
        .flatten()
        // Of what was made just now some may be unusable.
        .inspect_err(|_| {
            self.subdivisions.forget();
            self.buffers.forget();
        })?;
        pipelines.keep(made);
        Ok(())
    }

    fn parts(&self, frame: &WgpuFrame, pass: &PassRequest<'_>) -> usize {
        frame.pass(frame.index(pass.pass)).way.parts(pass.list)
    }

    fn record(
        &self,
        worker: &Worker,
        frame: &WgpuFrame,
        &PassRequest { frame: request, pass, list }: &PassRequest<'_>,
        mut parts: Range<usize>,
        put: &mut dyn FnMut(WgpuPart),
    ) -> Result<(), BackendError> {
        self.workers.fetch_max(worker.index() + 1, Ordering::Relaxed);
        let index = frame.index(pass);
        let pass = frame.pass(index);
        let encoders = pass.way.encoders(list.bundle_count());
        // What is there already needs no scope: a scope locks the device twice.
        pass.spent.on_parts(|| {
            while let Some(kept) = (!parts.is_empty()).then(|| record::kept(frame, index, list, parts.start)).flatten()
            {
                put(kept);
                parts.start += 1;
            }
        });
        if parts.is_empty() {
            return Ok(());
        }
        let record = |part| match encoders {
            1 => record::bundle(&self.device, frame, index, list, part).map(Part::Bundle),
            _ => self.record_encoder(frame, request, index, list, part),
        };
        let all = || parts.map(record).try_for_each(|part| part.map(|part| put(WgpuPart(part))));
        // One scope for all the others.
        pass.spent
            .on_parts(|| checked(&self.device, &pass.label, || caught(&pass.label, all)))
            .flatten()
            .flatten()
            .inspect_err(|_| self.buffers.forget())
    }

    fn finish(
        &self,
        worker: &Worker,
        frame: &WgpuFrame,
        &PassRequest { frame: request, pass, list }: &PassRequest<'_>,
        parts: &mut Vec<WgpuPart>,
    ) -> Result<WgpuCommands, BackendError> {
        self.workers.fetch_max(worker.index() + 1, Ordering::Relaxed);
        if matches!(parts.first(), Some(WgpuPart(Part::Encoder(_)))) {
            return Ok(WgpuCommands(Commands::Parts(std::mem::take(parts))));
        }
        let index = frame.index(pass);
        let pass = frame.pass(index);
        let finish = || {
            let encoder = self.encode_pass(frame, request, index, list, parts)?;
            Ok(match pass.way.encode {
                Encode::OnSubmit => Commands::Open(encoder),
                Encode::PerPass | Encode::Split => Commands::Finished(encoder.finish()),
            })
        };
        let commands = pass.spent.alone(|| checked(&self.device, &pass.label, finish)).flatten();
        commands.map(WgpuCommands).inspect_err(|_| self.buffers.forget())
    }

    fn submit(&self, frame: WgpuFrame, passes: Vec<(Pass, WgpuCommands)>) -> Result<WgpuSubmission, BackendError> {
        self.submit_frame(&frame, passes).inspect_err(|_| {
            self.buffers.forget();
            if let Some(timing) = &self.timing {
                timing.readbacks.forget();
            }
        })
    }
}
