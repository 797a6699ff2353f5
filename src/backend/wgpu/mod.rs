//! The wgpu backend.
//!
//! What it rests on was measured: vertices and indices lie in arenas, what an object is comes from one storage buffer, and
//! state is set per batch only, because that is the form of recording that is cheap and that scales with threads. A bundle
//! is replayed, and encoded for the device, inside `CommandEncoder::finish`; so every pass has an encoder of its own,
//! finished on a worker, and the device thread is left with `Queue::submit`.

mod arena;
mod assets;
mod error_scope;
mod frame_buffers;
mod layouts;
mod light_meshes;
mod picture;
mod pipelines;
mod record;
mod subdivisions;
mod targets;
mod texels;
mod textures;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Weak};

use parking_lot::{Mutex, RwLock};

use self::assets::{AssetCache, AssetSnapshot};
use self::error_scope::{caught, checked};
use self::frame_buffers::{BufferPool, FrameBuffers};
use self::layouts::Layouts;
use self::light_meshes::LightMeshes;
use self::pipelines::ProcessPipelines;
use self::subdivisions::{SubdividedMesh, Subdivisions};
use self::targets::{FrameTargets, TargetCache};
use super::{Backend, BackendError, FrameRequest};
use crate::process::{Draws, FramePlan, Pass};
use crate::queue::DrawList;
use crate::task::Worker;
use crate::view::{ObjectTable, RejectionReason};

pub use picture::{Picture, WgpuSubmission};

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
    queue: wgpu::Queue,
    layouts: Layouts,
    /// For each plan by its identity.
    pipelines: Mutex<HashMap<u64, PlanPipelines>>,
    /// Made when a plan draws lights for the first time.
    light_meshes: Mutex<Option<Arc<LightMeshes>>>,
    assets: Mutex<AssetCache>,
    subdivisions: Subdivisions,
    targets: Mutex<TargetCache>,
    buffers: Arc<BufferPool>,
}

impl WgpuBackend {
    /// The features a device must have: none beyond WebGPU's own.
    pub const REQUIRED_FEATURES: wgpu::Features = wgpu::Features::empty();

    /// The limits a device must have. Higher ones are used where it has them: for larger pictures, and for more objects.
    pub const REQUIRED_LIMITS: wgpu::Limits = wgpu::Limits::downlevel_defaults();

    /// A backend on the engine's device.
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
        Ok(Self {
            device,
            queue,
            layouts,
            pipelines: Mutex::default(),
            light_meshes: Mutex::default(),
            assets: Mutex::default(),
            subdivisions: Subdivisions::default(),
            targets: Mutex::default(),
            buffers: Arc::default(),
        })
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// What is kept on the device from frame to frame, beside the scene's own meshes and textures.
    pub fn resources(&self) -> WgpuResources {
        let kept = self.pipelines.lock();
        let mut distinct: Vec<_> = kept.values().flat_map(|kept| &kept.of_processes).collect();
        distinct.sort_by_key(|pipelines| Arc::as_ptr(pipelines));
        distinct.dedup_by_key(|pipelines| Arc::as_ptr(pipelines));
        let pipelines = distinct.into_iter().map(|pipelines| pipelines.prepared().len()).sum();
        let (targets, target_bytes) = self.targets.lock().current().sizes();
        WgpuResources { pipelines, targets, target_bytes, buffer_bytes: self.buffers.bytes() }
    }

    /// The pipelines of every process of a plan: those there are, also from other plans, or new ones where a process draws in
    /// another way than it did.
    fn pipelines(&self, plan: &FramePlan, draws: &[Draws<'_>]) -> Result<Vec<Arc<ProcessPipelines>>, BackendError> {
        let mut kept = self.pipelines.lock();
        let mut of_plan = kept.get(&plan.identity()).map_or_else(Vec::new, |kept| kept.of_processes.clone());
        for (index, (planned, draws)) in plan.processes().iter().zip(draws).enumerate() {
            if of_plan.get(index).is_some_and(|pipelines| pipelines.still_fit(draws)) {
                continue;
            }
            let mut all = kept.values().flat_map(|kept| &kept.of_processes);
            let fitting = all.find(|pipelines| pipelines.fit(plan, planned, draws)).cloned();
            let made = match fitting {
                Some(fitting) => fitting,
                None => {
                    let label = format!("the shader of {:?}", planned.process.name());
                    let make = || ProcessPipelines::new(&self.device, &self.layouts, plan, planned, draws);
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
        kept.insert(plan.identity(), PlanPipelines { plan: plan.alive(), of_processes: of_plan.clone() });
        Ok(of_plan)
    }

    /// The geometry of lights, where something draws it.
    fn light_meshes(&self, draws: &[Draws<'_>]) -> Result<Option<Arc<LightMeshes>>, BackendError> {
        if !draws.iter().any(|draws| matches!(draws, Draws::Lights(_))) {
            return Ok(None);
        }
        let mut kept = self.light_meshes.lock();
        if kept.is_none() {
            let make = || LightMeshes::new(&self.device, &self.queue);
            *kept = Some(Arc::new(checked(&self.device, "the geometry of lights", make)??));
        }
        Ok(kept.clone())
    }

    fn start(&self, request: &FrameRequest<'_>) -> Result<WgpuFrame, BackendError> {
        let FrameRequest { plan, draws, views, passes, scene, rejections, .. } = *request;
        let pipelines = self.pipelines(plan, draws)?;
        let light_meshes = self.light_meshes(draws)?;
        self.subdivisions.begin(scene.assets);
        let assets = checked(&self.device, "meshes, materials and textures", || {
            self.assets.lock().update(&self.device, &self.queue, &self.layouts, scene.assets, rejections)
        })??;
        let targets = checked(&self.device, "targets", || self.targets.lock().update(&self.device, plan, views))??;
        let (buffers, process_groups) = checked(&self.device, "the frame's buffers", || {
            let mut buffers = self.buffers.take();
            buffers.begin(&self.device, &self.queue, &self.layouts, request)?;
            let groups = passes.iter().enumerate().map(|(index, pass)| {
                let parameters = buffers.parameters(index);
                let declaration = &plan.processes()[pass.process].declaration;
                pipelines[pass.process].process_group(&self.device, parameters, &targets, pass.view, declaration)
            });
            let groups: Vec<_> = groups.collect();
            Ok::<_, BackendError>((buffers, groups))
        })??;
        let label = |pass: &Pass| {
            format!("{:?} in view {:?}", plan.processes()[pass.process].process.name(), views[pass.view].name())
        };
        Ok(WgpuFrame {
            labels: passes.iter().map(label).collect(),
            passes: passes.to_vec(),
            pipelines,
            assets,
            light_meshes,
            subdivided: RwLock::default(),
            targets,
            process_groups,
            background: scene.background.as_dvec3().to_array(),
            buffers,
        })
    }

    /// Finds or makes the subdivided meshes that batches draw.
    fn subdivide(&self, frame: &WgpuFrame, request: &FrameRequest<'_>, list: &DrawList) -> Result<(), BackendError> {
        for batch in list.batches.iter().filter(|batch| batch.state.halvings() > 0) {
            let halvings = batch.state.halvings();
            let assets = request.scene.assets;
            let mesh = self.subdivisions.find(&self.device, &self.queue, assets, batch.mesh, halvings)?;
            if mesh.is_coarse {
                for rank in batch.first..batch.first + batch.count {
                    request.rejections.count_once(RejectionReason::CoarseEdges, list.objects[rank as usize] as usize);
                }
            }
            frame.subdivided.write().insert((batch.mesh, halvings), mesh);
        }
        Ok(())
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

/// The pipelines of a plan.
struct PlanPipelines {
    /// Whether the plan still is.
    plan: Weak<()>,
    /// One for each process.
    of_processes: Vec<Arc<ProcessPipelines>>,
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
    /// Of the buffers for objects, views, lights and parameters that no frame on its way is using.
    pub buffer_bytes: u64,
}

/// A frame on its way through the wgpu backend.
pub struct WgpuFrame {
    labels: Vec<String>,
    passes: Vec<Pass>,
    /// One for each process.
    pipelines: Vec<Arc<ProcessPipelines>>,
    assets: Arc<AssetSnapshot>,
    light_meshes: Option<Arc<LightMeshes>>,
    /// By mesh slot, and how often its edges are halved.
    subdivided: RwLock<HashMap<(u32, u32), Arc<SubdividedMesh>>>,
    targets: FrameTargets,
    /// For each pass, its targets and parameters at `@group(2)`; none for a pass without.
    process_groups: Vec<Option<wgpu::BindGroup>>,
    background: [f64; 3],
    /// Given back to the pool when the frame is dropped.
    buffers: FrameBuffers,
}

impl WgpuFrame {
    /// The index of a pass among the frame's.
    fn index(&self, pass: Pass) -> usize {
        // Passes are in the order of their process, then their view, which is the order of `Pass`.
        self.passes.partition_point(|other| *other < pass)
    }
}

impl Backend for WgpuBackend {
    type Frame = WgpuFrame;
    type Bundle = wgpu::RenderBundle;
    type Commands = wgpu::CommandBuffer;
    type Submission = WgpuSubmission;

    fn adapter(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({})", info.name, info.backend)
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
        checked(&self.device, "objects", || {
            for block in blocks {
                let (first, records) = objects.records_of(block);
                frame.buffers.write_objects(&self.queue, first, &records);
            }
        })
    }

    fn prepare(
        &self,
        _worker: &Worker,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        pass: Pass,
        list: &DrawList,
    ) -> Result<(), BackendError> {
        let index = frame.index(pass);
        let pipelines = &frame.pipelines[pass.process];
        let made = checked(&self.device, &frame.labels[index], || {
            frame.buffers.write_drawn(&self.queue, index, &list.objects);
            self.subdivide(frame, request, list)?;
            Ok::<_, BackendError>(pipelines.make_missing(&self.device, &list.batches))
        })
        .flatten()
        // Of what was made just now some may be unusable.
        .inspect_err(|_| self.subdivisions.forget())?;
        pipelines.keep(made);
        Ok(())
    }

    fn record(
        &self,
        _worker: &Worker,
        frame: &WgpuFrame,
        pass: Pass,
        list: &DrawList,
        bundles: Range<usize>,
    ) -> Result<Vec<wgpu::RenderBundle>, BackendError> {
        let index = frame.index(pass);
        let label = &frame.labels[index];
        let record = |bundle| record::bundle(&self.device, frame, index, list.bundle(bundle));
        // One scope for the whole job: a scope locks the device twice.
        checked(&self.device, label, || caught(label, || bundles.map(record).collect::<Result<_, _>>()))??
    }

    fn finish(
        &self,
        _worker: &Worker,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        pass: Pass,
        bundles: Vec<wgpu::RenderBundle>,
    ) -> Result<wgpu::CommandBuffer, BackendError> {
        let index = frame.index(pass);
        checked(&self.device, &frame.labels[index], || {
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(&frame.labels[index]) });
            match &request.draws[pass.process] {
                Draws::Raw(raw) => record::raw(&self.device, &mut encoder, frame, request, pass, *raw)?,
                _ => record::pass(&mut encoder, frame, request, index, &bundles)?,
            }
            Ok(encoder.finish())
        })?
    }

    fn submit(
        &self,
        frame: WgpuFrame,
        passes: Vec<(Pass, wgpu::CommandBuffer)>,
    ) -> Result<WgpuSubmission, BackendError> {
        checked(&self.device, "the frame", || {
            let index = self.queue.submit(passes.into_iter().map(|(_, commands)| commands));
            // The clone leaves the frame whole, whose buffers go back to the pool from here.
            WgpuSubmission::new(self.device.clone(), self.queue.clone(), index, frame.targets.clone())
        })
    }
}
