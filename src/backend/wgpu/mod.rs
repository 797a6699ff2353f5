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
mod picture;
mod pipelines;
mod record;
mod targets;
mod texels;
mod textures;

use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use self::assets::{AssetCache, AssetSnapshot};
use self::error_scope::{caught, checked};
use self::frame_buffers::{BufferPool, FrameBuffers};
use self::layouts::Layouts;
use self::pipelines::ProcessPipelines;
use self::targets::{TargetCache, ViewTargets};
use super::{Backend, BackendError, FrameRequest};
use crate::process::{Draws, FramePlan, Pass};
use crate::queue::DrawList;
use crate::task::Worker;
use crate::view::ObjectTable;

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
    /// One for each process of the plan.
    pipelines: Mutex<Vec<Arc<ProcessPipelines>>>,
    assets: Mutex<AssetCache>,
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
            assets: Mutex::default(),
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

    /// The pipelines of every process, made anew where a process draws in another way than it did.
    fn pipelines(&self, plan: &FramePlan, draws: &[Draws<'_>]) -> Result<Vec<Arc<ProcessPipelines>>, BackendError> {
        let mut pipelines = self.pipelines.lock();
        for (index, (planned, draws)) in plan.processes().iter().zip(draws).enumerate() {
            if pipelines.get(index).is_some_and(|pipelines| pipelines.fit(draws)) {
                continue;
            }
            let label = format!("the shader of {:?}", planned.process.name());
            let make = || ProcessPipelines::new(&self.device, &self.layouts, plan, planned, draws);
            let made = Arc::new(checked(&self.device, &label, make)?);
            // Processes are made in order, so the new one replaces another or comes at the end.
            match pipelines.get_mut(index) {
                Some(old) => *old = made,
                None => pipelines.push(made),
            }
        }
        Ok(pipelines.clone())
    }

    fn start(&self, request: &FrameRequest<'_>) -> Result<WgpuFrame, BackendError> {
        let FrameRequest { plan, draws, views, passes, scene, rejections } = *request;
        let pipelines = self.pipelines(plan, draws)?;
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
                pipelines[pass.process].process_group(&self.device, parameters, &targets[pass.view], declaration)
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
            targets,
            process_groups,
            background: scene.background.as_dvec3().to_array(),
            buffers,
        })
    }

    /// Drops everything that is kept from frame to frame. After a device error some of it may be unusable, and the next
    /// frame is to find out for itself.
    fn forget(&self) {
        *self.assets.lock() = AssetCache::default();
        *self.targets.lock() = TargetCache::default();
        self.buffers.forget();
    }
}

/// A frame on its way through the wgpu backend.
pub struct WgpuFrame {
    labels: Vec<String>,
    passes: Vec<Pass>,
    /// One for each process.
    pipelines: Vec<Arc<ProcessPipelines>>,
    assets: Arc<AssetSnapshot>,
    targets: Vec<Arc<ViewTargets>>,
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

    fn prepare(&self, _worker: &Worker, frame: &WgpuFrame, pass: Pass, list: &DrawList) -> Result<(), BackendError> {
        let index = frame.index(pass);
        let pipelines = &frame.pipelines[pass.process];
        let made = checked(&self.device, &frame.labels[index], || {
            frame.buffers.write_drawn(&self.queue, index, &list.objects);
            pipelines.make_missing(&self.device, &list.batches)
        })?;
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
                Draws::Raw(raw) => record::raw(&self.device, &mut encoder, frame, pass, *raw)?,
                draws => {
                    let declaration = &request.plan.processes()[pass.process].declaration;
                    record::pass(&mut encoder, frame, index, declaration, draws, &bundles)?;
                }
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
